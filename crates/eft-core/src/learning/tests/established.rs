//! What the proofs of the learner assume of its configuration and of its start, for random parameters; and what they
//! found.

use super::*;
use crate::compensation::Calibration;
use crate::learning::saved::{SavedDistances, SavedEvidence};
use crate::learning::window::Window;

/// A small generator of random numbers.
struct Random(u64);

impl Random {
    /// In [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A factor between these two, at any order of magnitude.
    fn factor(&mut self, lowest: f64, highest: f64) -> f64 {
        libm::exp(libm::log(lowest) + self.next() * libm::log(highest / lowest))
    }

    fn bounds(&mut self, lowest: f64, highest: f64) -> [f64; 2] {
        let [a, b] = [self.factor(lowest, highest), self.factor(lowest, highest)];
        if a < b { [a, b] } else { [b, a] }
    }

    /// Parameters of which a part is accepted.
    fn parameters(&mut self) -> Parameters<'static> {
        let p = Parameters::ZHAO2005;
        let l = Learning::ADAPTIVE;
        let learning = Learning {
            adaptive: self.next() < 0.8,
            curve_correction: self.next() < 0.5,
            flow_gain_bounds: if self.next() < 0.5 { self.bounds(5e-3, 2e2) } else { l.flow_gain_bounds },
            valve_gain_bounds: if self.next() < 0.5 { self.bounds(5e-3, 2e2) } else { l.valve_gain_bounds },
            response_delay_bounds: if self.next() < 0.5 {
                self.bounds(1e-3, 1e3)
            } else {
                l.response_delay_bounds
            },
            ..l
        };
        let fastest = if self.next() < 0.5 { 1e5 } else { 1e12 };
        Parameters {
            sample_rate: self.factor(200.0, fastest),
            response_delay: if self.next() < 0.1 { 0.0 } else { self.factor(1e-6, 1.0) },
            velocity_delay: if self.next() < 0.5 { 0.0 } else { self.factor(1e-6, 1.0) },
            lead_alpha: if self.next() < 0.5 { self.factor(1e-3, 1.0) } else { 1.0 - self.factor(1e-3, 1.0) },
            proportional_gain: p.proportional_gain * self.factor(1e-9, 1e9),
            valve_gain: p.valve_gain * self.factor(1e-9, 1e9),
            null_bias: self.next() - 0.5,
            learning,
            ..p
        }
    }
}

macro_rules! holds {
    ($t:ty, $learner:expr) => {{
        let learner: &Learner<$t, 21> = $learner;
        let (flow, valve) = (&learner.flow.priors, &learner.valve.priors);
        let within =
            |x: $t, lowest: $t, highest: $t| assert!(x >= lowest && x <= highest, "{x}: {learner:?}");
        for range in [&flow.gain, &flow.delay, &valve.gain, &valve.delay] {
            let [least, most] = range.bounds;
            assert!(least <= most);
            within(range.change, 0.0, 100.0);
        }
        for [least, most] in [flow.gain.bounds, valve.gain.bounds] {
            assert!(least >= 0.01 && most <= 100.0);
        }
        let sample = learner.valve.sample;
        within(sample, 1e-13, 0.0051);
        let ([shortest, _], [least, most]) = (valve.delay.bounds, flow.delay.bounds);
        assert!(shortest >= sample + sample && valve.nominal_delay >= shortest);
        let longest = valve.delay.bounds[1].max(valve.nominal_delay);
        assert!(longest <= 10.0 && least >= -10.0 && most <= 21.0);
        within(flow.nominal_delay, least, most);
        within(learner.valve.lag_per_delay, 1.0 / 512.0, 2048.0);
        assert!(learner.valve.lag_per_delay * (longest + most + 0.5 * most) <= sample * 1_048_576.0);
        within(learner.valve.phase_deficit, 0.0, 2_097_152.0);
        within(learner.valve.lead_gain, 0.0, 1e12);
        within(learner.valve.priors.per_period, 1.0, 2e11);
        within(learner.null_gain, 0.0, 1e12);
        within(learner.curve.known_null, -0.5, 0.5);
        within(learner.known_signal, -1e12, 1e12);
        within(learner.curve.change, 0.0, 1.0);
        within(learner.curve.null_change, 0.0, 1.0);
        assert!(learner.guard.lowest == 0.5);
        assert!(learner.adapts || !learner.corrects);
        within(learner.lead.pole(), -1.0, 0.999_999_99);
        within(learner.lead.rate(), 0.0, 1001.0);
        within(learner.lead.gain(), 0.0, 1e12);
        // The start.
        let state = learner.at_rest();
        within(state.valve.found.delay.value, shortest, longest);
        within(state.flow.delay.value, least, most);
        assert!(state.flow.gain.value == 1.0 && state.valve.found.gain.value == 1.0);
    }};
}

#[test]
#[allow(clippy::float_cmp, reason = "set exactly")]
fn what_the_proofs_take_for_granted() {
    let (mut random, mut accepted) = (Random(1), 0);
    for _ in 0..20_000 {
        let p = random.parameters();
        if let Ok(learner) = Learner::<f32, 21>::new(&p) {
            holds!(f32, &learner);
            accepted += 1;
        }
        if let Ok(learner) = Learner::<f64, 21>::new(&p) {
            holds!(f64, &learner);
        }
    }
    assert!(accepted > 2000, "only {accepted} are accepted");
}

/// A network whose washout would not decay is refused for every delay that can be learned.
#[test]
fn the_pole_stays_below_one_at_the_longest_delay() {
    let p = |lead_alpha: f64| Parameters { lead_alpha, response_delay: 1.0, ..Parameters::ZHAO2005 };
    let p = |lead_alpha: f64| Parameters { learning: Learning::ADAPTIVE, ..p(lead_alpha) };
    for alpha in [0.1, 0.5, 0.9, 0.99, 0.999] {
        let Ok(learner) = Learner::<f32, 21>::new(&p(alpha)) else { continue };
        let mut found = learner.valve.at_rest().found;
        [_, found.delay.value] = learner.valve.priors.delay.bounds;
        let [_, velocity_delay] = learner.flow.priors.delay.bounds;
        let lead = learner.valve.lead(&found, 0.0, velocity_delay, 1.0);
        assert!(lead.pole() < 1.0, "{alpha}: {lead:?}");
    }
    assert!(Learner::<f32, 21>::new(&p(0.5)).is_ok());
}

/// Extreme calibrations from a file.
#[test]
fn no_saved_calibration_publishes_a_network_that_is_not_finite() {
    let mut random = Random(2);
    let mut accepted = 0;
    for _ in 0..3000 {
        let p = random.parameters();
        let Ok(learner) = Learner::<f32, 21>::new(&p) else { continue };
        for _ in 0..20 {
            let mut saved = learner.saved(&learner.at_rest());
            saved.excitation = random.factor(1e-30, 1e6);
            let mut signed =
                |most: f64| random.factor(1e-30, most) * if random.next() < 0.5 { -1.0 } else { 1.0 };
            let fastest = libm::sqrt(signed(1e12).abs());
            saved.evidence = SavedEvidence {
                time: libm::sqrt(signed(1e12).abs()),
                mean_weight: signed(1.0).abs(),
                mean_square_frequency: fastest * fastest,
                growth: fastest * signed(1.0),
                flow: signed(1e3).abs(),
                flow_rate: signed(1e9),
                rate_flow: signed(1e9),
                rate_flow_rate: signed(1e9).abs(),
                compressed_flow: signed(1e3).abs(),
                flow_error: signed(1e3).abs(),
                spool_error: signed(1e3).abs(),
                distances: SavedDistances {
                    flow_gain: signed(1e6),
                    valve_gain: signed(1e6),
                    response_delay: signed(1e6),
                    velocity_delay: signed(1e6),
                    null_offset: signed(1e6),
                },
            };
            let curve = &mut saved.curve;
            curve.sensor_offset = signed(1e3);
            (curve.mean_departure, curve.flow_gain_share) = (signed(1.0), 0.2 * signed(1.0));
            (curve.null_time, curve.null_coupling) = (signed(1e6).abs(), signed(1.0).abs());
            curve.time = signed(4.0).abs();
            curve.asymmetry_deviation = random.factor(1e-9, 1e6);
            curve.error = random.factor(1e-18, 1e3);
            let between =
                |[lowest, highest]: [f32; 2], at: f64| f64::from(lowest) + at * f64::from(highest - lowest);
            saved.flow_gain = between(learner.flow.priors.gain.bounds, random.next());
            saved.valve_gain = between(learner.valve.priors.gain.bounds, random.next());
            saved.response_delay = between(learner.valve.priors.delay.bounds, random.next());
            saved.velocity_delay = between(learner.flow.priors.delay.bounds, random.next());
            let Ok(mut state) = learner.start_from(&saved) else { continue };
            accepted += 1;
            let first = learner.first_calibration(&state);
            let Calibration { lead, .. } = learner.update(&mut state, &Window::<f32>::first(0));
            let finite = lead.pole().is_finite() && lead.rate().is_finite() && lead.gain().is_finite();
            assert!(finite && lead.gain() > 0.0, "{lead:?} {saved:?} {p:?}");
            let d = &first.deviations;
            for deviation in [d.flow_gain, d.valve_gain, d.response_delay, d.velocity_delay, d.null_offset] {
                assert!(deviation >= 0.0, "{d:?} {saved:?} {p:?}");
            }
        }
    }
    assert!(accepted > 1000, "{accepted}");
}
