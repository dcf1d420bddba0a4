//! The lead network compared with closed forms.

use std::f64::consts::PI;

use eft_core::{ConfigError, LeadNetwork, LeadState};
use proptest::prelude::*;

/// Amplitude and phase (rad) of Eq. (8) at the frequency to which Tustin maps `f` (Hz).
fn tustin_response(gain: f64, delay: f64, alpha: f64, rate: f64, f: f64) -> (f64, f64) {
    let w = 2.0 * rate * (PI * f / rate).tan();
    let t = delay / (1.0 - alpha);
    let (top, bottom) = (t * w, alpha * t * w);
    (gain * top.hypot(1.0) / bottom.hypot(1.0), top.atan() - bottom.atan())
}

/// Amplitude and phase of the network's output, over the last ten of many periods of `samples` each.
fn measured_response(lead: &LeadNetwork<f64>, samples: usize) -> (f64, f64) {
    let mut state = LeadState::default();
    let (mut re, mut im) = (0.0, 0.0);
    let settle = 20_000 / samples * samples + samples;
    for n in 0..settle + 10 * samples {
        let phase = 2.0 * PI * (n % samples) as f64 / samples as f64;
        let y = lead.step(&mut state, phase.sin());
        if n >= settle {
            re += y * phase.sin();
            im += y * phase.cos();
        }
    }
    let half = 5.0 * samples as f64;
    (re.hypot(im) / half, im.atan2(re))
}

#[test]
fn frequency_response_is_tustin_of_equation_8() {
    for (delay, alpha, rate) in
        [(5.0e-3, 0.1, 4096.0), (5.0e-3, 0.1, 1000.0), (3.0e-3, 0.5, 5000.0), (1.0e-4, 0.05, 500.0)]
    {
        let lead = LeadNetwork::<f64>::new(12.4, delay, alpha, rate).unwrap();
        for samples in [5, 16, 100, 400] {
            let (amplitude, phase) = measured_response(&lead, samples);
            let f = rate / samples as f64;
            let (expected_amplitude, expected_phase) = tustin_response(12.4, delay, alpha, rate, f);
            assert!(
                (amplitude / expected_amplitude - 1.0).abs() < 1e-9,
                "{delay} {alpha} {rate} {f}: {amplitude}"
            );
            assert!((phase - expected_phase).abs() < 1e-9, "{delay} {alpha} {rate} {f}: {phase}");
        }
    }
}

#[test]
fn lead_below_a_sample_stays_a_lead_and_does_not_ring() {
    // Slow enough that backward difference and Tustin agree: the phase is that of the delay.
    for delay in [1.0e-12, 1.0e-9, 1.0e-8] {
        let lead = LeadNetwork::<f64>::new(1.0, delay, 0.1, 4096.0).unwrap();
        let (amplitude, phase) = measured_response(&lead, 4096);
        assert!((amplitude - 1.0).abs() < 1e-9);
        assert!((phase / (2.0 * PI * delay) - 1.0).abs() < 0.01, "{phase}");
        let mut state = LeadState::default();
        lead.step(&mut state, 1.0);
        lead.step(&mut state, 1.0);
        let later = lead.step(&mut state, 1.0);
        assert_eq!(later, lead.step(&mut state, 1.0));
    }
}

#[test]
fn refusals_name_the_parameter() {
    let new = |gain, delay, alpha, rate| LeadNetwork::<f32>::new(gain, delay, alpha, rate).map(|_| ());
    assert_eq!(new(0.0, 0.005, 0.1, 4096.0), Err(ConfigError::NotPositive { parameter: "gain", value: 0.0 }));
    assert_eq!(new(f64::INFINITY, 0.005, 0.1, 4096.0), Err(ConfigError::NotFinite { parameter: "gain" }));
    for (result, name) in [
        (new(1.0e30, 0.005, 0.1, 4096.0), "gain"),
        (new(1.0, -0.001, 0.1, 4096.0), "response_delay"),
        (new(1.0, 0.005, 1.0, 4096.0), "lead_alpha"),
        (new(1.0, 0.005, 0.1, 1.0e12), "sample_rate"),
    ] {
        assert!(
            matches!(result, Err(ConfigError::OutOfRange { parameter, .. }) if parameter == name),
            "{result:?}"
        );
    }
}

macro_rules! properties {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            proptest! {
                #[test]
                fn dc_gain_is_within_one_ulp(
                    proportional in 0.01..100.0f64,
                    valve in 0.001..10.0f64,
                    delay in 0.0..0.02f64,
                    alpha in 0.01..0.9f64,
                    rate in 200.0..20_000.0f64,
                    input in -1.0..1.0f64,
                ) {
                    let gain = 1.0 / (proportional * valve);
                    let lead = LeadNetwork::<$t>::new(gain, delay, alpha, rate).unwrap();
                    let mut state = LeadState::default();
                    let lag = 2.0 * alpha / (1.0 - alpha) * delay * rate;
                    // A pole p decays by e⁻⁴⁰ in 40/|ln p| samples, one near −1 (ringing) as slowly as one near 1.
                    let settled = 100 + (20.0 * f64::max(lag, 1.0 / lag).min(1.0e4)) as usize;
                    let mut output = 0.0;
                    for _ in 0..settled {
                        output = lead.step(&mut state, 1.0);
                    }
                    let nearest = gain as $t;
                    prop_assert!(output >= nearest.next_down() && output <= nearest.next_up(), "{output} {nearest}");
                    // At rest the output is exact from the first sample.
                    let mut rest = LeadNetwork::at_rest(input as $t);
                    prop_assert_eq!(lead.step(&mut rest, input as $t), lead.gain() * input as $t);
                    prop_assert_eq!(rest, LeadNetwork::at_rest(input as $t));
                }

                #[test]
                fn step_response_decays_geometrically(
                    delay in 1.0e-4..0.02f64, alpha in 0.05..0.8f64, rate in 500.0..20_000.0f64,
                ) {
                    // After a unit step the output is gain·(1 + r·pⁿ): ratios of successive differences are p,
                    // and the sum of the washout is the delay in samples (final value theorem).
                    let lead = LeadNetwork::<$t>::new(1.0, delay, alpha, rate).unwrap();
                    let mut state = LeadState::default();
                    let washout: Vec<f64> = (0..40_000).map(|_| f64::from(lead.step(&mut state, 1.0)) - 1.0).collect();
                    // The rounded pole moves the sum by its distance from 1, which is 2/lag.
                    let lag = 2.0 * alpha / (1.0 - alpha) * delay * rate;
                    let sum: f64 = washout.iter().sum();
                    let tolerance = f64::from(<$t>::EPSILON) * (3.0e4 / (delay * rate) + lag + 10.0) + 1e-9;
                    prop_assert!((sum / (delay * rate) - 1.0).abs() < tolerance, "{sum}");
                    let pole = (lag - 1.0) / (lag + 1.0);
                    let ratio = washout[1] / washout[0];
                    prop_assert!((ratio - pole).abs() < 20.0 * f64::from(<$t>::EPSILON) * (1.0 + 1.0 / washout[0]));
                }

                #[test]
                fn output_is_bounded_whatever_the_input(
                    delay in 0.0..1.0f64, alpha in 0.001..0.999f64, rate in 1.0..1.0e6f64,
                    inputs in prop::collection::vec(-1.0..1.0f64, 200),
                ) {
                    if let Ok(lead) = LeadNetwork::<$t>::new(1.0, delay, alpha, rate) {
                        let mut state = LeadState::default();
                        // Sum of the absolute impulse response: 1 + 2·(1 − α)/α at most.
                        let bound = 2.0 / alpha;
                        for x in inputs {
                            let y = f64::from(lead.step(&mut state, x as $t));
                            prop_assert!(y.abs() <= bound * 1.001, "{y} {bound}");
                        }
                    }
                }
            }
        }
    };
}
properties!(single, f32);
properties!(double, f64);

#[test]
fn a_pole_that_rounds_to_one_is_refused_and_no_pole_rings() {
    // A lag of 1,998 s: the pole is 1e-9 below 1.
    assert!(LeadNetwork::<f32>::new(1.0, 1.0, 0.999, 1e6).is_err());
    assert!(LeadNetwork::<f64>::new(1.0, 1.0, 0.999, 1e6).is_ok());
    for delay in [0.0, 1e-9, 1e-8] {
        let lead = LeadNetwork::<f64>::new(1.0, delay, 0.1, 4096.0).unwrap();
        let mut state = LeadState::default();
        lead.step(&mut state, 1.0);
        for _ in 0..4 {
            assert!((lead.step(&mut state, 1.0) - 1.0).abs() < 1e-9, "{delay}");
        }
    }
}

#[test]
fn a_sample_that_rounds_the_pole_to_one_names_a_rate_that_does_not() {
    // The lag is 2·0.9·1/(1 - 0.9) s.
    let Err(ConfigError::OutOfRange { parameter, highest, .. }) = LeadNetwork::<f32>::new(1.0, 1.0, 0.9, 1e7)
    else {
        panic!("accepted")
    };
    assert!(
        parameter == "sample_rate" && (highest * 18.0 / 1e6 - 1.0).abs() < 1e-12,
        "{parameter} {highest}"
    );
    assert!(LeadNetwork::<f32>::new(1.0, 1.0, 0.9, highest).is_ok());
}
