//! Delays of signals with gaps, noise and ends in motion.

use super::*;
use crate::ground_motion::excitation::sine_sweep;

const RATE: f64 = 1000.0;
const BAND: (f64, f64) = (0.25, 10.0);

/// A 0–10 Hz sweep, and the same sweep delayed.
fn late(delay: f64) -> (Vec<f64>, Vec<f64>) {
    let sweep = |shift: f64| {
        let value = |i: usize| {
            let t = i as f64 / RATE - shift;
            (TAU * 0.5 * 10.0 / 32.0 * t * t).sin()
        };
        (0..32_000).map(value).collect()
    };
    (sweep(0.0), sweep(delay))
}

#[test]
fn a_pure_delay_of_either_sign_and_of_many_periods_is_found() {
    for delay in [0.0, 4.7e-3, -3e-3, 0.3] {
        let (x, y) = late(delay);
        let found = identify_delay(&x, &y, RATE, BAND).unwrap();
        assert!((found.delay - delay).abs() < 1e-4 + 0.01 * delay.abs(), "{delay}: {found:?}");
        assert!(found.coherence > 0.9);
    }
}

#[test]
fn gaps_offset_and_drift_do_not_change_the_result() {
    let (x, mut y) = late(5e-3);
    let clean = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
    y.iter_mut().enumerate().for_each(|(i, v)| *v = 0.2 * *v + 3.0 + 1e-4 * i as f64);
    for gap in [3000..3100, 12_000..13_000, 20_000..20_003] {
        y[gap].fill(f64::NAN);
    }
    let found = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
    assert!((found - clean).abs() < 0.02 * clean, "{found}, without {clean}");
}

#[test]
fn single_lost_samples_do_not_change_the_result() {
    let (mut x, mut y) = late(5e-3);
    let clean = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
    // At 10 Hz a gap of ten samples is a tenth of a period.
    x.iter_mut().skip(7).step_by(50).for_each(|v| *v = f64::NAN);
    for from in (20..32_000).step_by(150) {
        y[from..(from + 10).min(32_000)].fill(f64::NAN);
    }
    let found = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
    assert!((found - clean).abs() < 0.01 * clean, "{found}, without {clean}");
    for from in (20..32_000).step_by(150) {
        y[from..(from + 11).min(32_000)].fill(f64::NAN);
    }
    let refused = identify_delay(&x, &y, RATE, BAND).unwrap_err().to_string();
    assert!(
        refused.contains("in stretches of more than 400 without a gap: must be at least half"),
        "{refused}"
    );
}

/// Normal noise of deviation 1, as a sum of twelve uniform numbers.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

#[test]
fn a_band_that_only_the_ends_of_the_recording_excite_is_refused() {
    for (band, duration) in [
        ((60.0, 80.0), 2.0),
        ((30.0, 100.0), 2.0),
        ((60.0, 80.0), 2.1),
        ((60.0, 80.0), 3.0),
        ((6.0, 30.0), 2.0),
    ] {
        let command = sine_sweep(1.0, 0.0, 5.0, duration, RATE).unwrap().values;
        let response: Vec<f64> = (0..command.len()).map(|i| 0.9 * command[i.saturating_sub(4)]).collect();
        let said = identify_delay(&command, &response, RATE, band).unwrap_err().to_string();
        assert!(said.starts_with("command = ") && said.contains("from the ends of the recording"), "{said}");
        let inside = identify_delay(&command, &response, RATE, (0.5, 5.0)).unwrap();
        assert!((inside.delay - 4e-3).abs() < 4.0 * inside.uncertainty.max(2e-4), "{inside:?}");
    }
    // An impulse at the first sample and noise excite every band, and so does a step, whose trend is removed.
    let mut noise = noise(3);
    let impulse: Vec<f64> = (0..4000).map(|i| f64::from(i < 3)).collect();
    let step: Vec<f64> = (0..4000).map(|i| f64::from(i > 200)).collect();
    let white: Vec<f64> = (0..4000).map(|_| noise()).collect();
    for (command, known) in [(impulse, true), (white, true), (step, false)] {
        let response: Vec<f64> = (0..4000).map(|i| if i < 4 { 0.0 } else { command[i - 4] }).collect();
        for band in [(0.5, 10.0), (60.0, 80.0)] {
            let found = identify_delay(&command, &response, RATE, band).unwrap();
            let right = (found.delay - 4e-3).abs() < 4.0 * found.uncertainty.max(2e-4);
            assert!(right || !known, "{band:?}: {found:?}");
        }
    }
}

/// Motion of an oscillator under a sweep, noise or a sine that grows, cut from a longer recording.
fn resonant(seed: u64, noise: &mut impl FnMut() -> f64) -> Vec<f64> {
    let part = |n: u64| (seed * n % 97) as f64 / 97.0;
    let (samples, before) = ((4e3 * (1.0 + 6.0 * part(31))) as usize, 1000);
    let (natural, damping) = (1.0 + 7.0 * part(13), 0.005 + 0.05 * part(29));
    // A sweep that ends within the resonance.
    let highest = natural * (0.9 + 0.2 * part(41));
    let (turn, fade) = (TAU * natural / RATE, (-damping * TAU * natural / RATE).exp());
    let (mut last, mut before_last) = (0.0, 0.0);
    let mut response = Vec::with_capacity(samples + before);
    for i in 0..samples + before {
        let t = i as f64 / RATE;
        let sweep = (0.5 * TAU * highest * t * t * RATE / (samples + before) as f64).sin();
        let drive = if seed.is_multiple_of(2) { sweep } else { noise() };
        let value = 2.0 * fade * turn.cos() * last - fade * fade * before_last + drive;
        (before_last, last) = (last, value);
        response.push(value);
    }
    response.split_off(before - 8)
}

#[test]
fn the_uncertainty_holds_where_a_recording_ends_in_motion() {
    let mut noise = noise(11);
    let (mut within, mut square) = (0, 0.0);
    for seed in 0..100 {
        let motion = resonant(seed, &mut noise);
        let (late, command) = ((seed % 6) as usize, &motion[8..]);
        let largest = motion.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let size = 2e-3 * (seed % 7) as f64 / 6.0 * largest + 1e-9 * largest;
        let response: Vec<f64> =
            (0..command.len()).map(|i| 0.7 * motion[8 + i - late] + size * noise()).collect();
        let found = identify_delay(command, &response, RATE, BAND).unwrap();
        let off = (found.delay - late as f64 / RATE) / found.uncertainty;
        within += u32::from(off.abs() < 2.0);
        square += off * off / 100.0;
    }
    assert!((90..=99).contains(&within) && square > 0.3, "{within} within two deviations, {square}");
}

#[test]
fn a_single_frequency_is_refused_or_has_the_right_delay() {
    let mut noise = noise(7);
    let mut refused = 0;
    // After these the motions repeat.
    for seed in 0..194 {
        let part = |n: u64| (seed * n % 97) as f64 / 97.0;
        let (samples, frequency) = ((3e3 + 1.7e4 * part(31)) as usize, 0.5 + 5.5 * part(13));
        let damping = if seed % 2 == 0 { 0.0 } else { 0.001 + 0.03 * part(29) };
        let angle = |i: usize| TAU * frequency * i as f64 / RATE;
        let motion: Vec<f64> = (0..samples + 14)
            .map(|i| (angle(i) + 6.0 * part(41)).sin() * (-damping * angle(i)).exp())
            .collect();
        let (late, size) = (1 + (seed % 14) as usize, [0.0, 1e-4, 1e-3][(seed % 3) as usize]);
        let response: Vec<f64> = (0..samples).map(|i| motion[14 + i - late] + size * noise()).collect();
        match identify_delay(&motion[14..], &response, RATE, (0.25, 10.0)) {
            Err(error) => {
                let said = error.to_string();
                assert!(said.starts_with("command = ") && !said.contains("wiring"), "{seed}: {said}");
                refused += 1;
            }
            Ok(found) => {
                let off = (found.delay - late as f64 / RATE).abs();
                assert!(off < 4.0 * found.uncertainty.max(1e-9), "{seed}: {off} s off, {found:?}");
            }
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn noise_alone_is_refused_in_a_narrow_band_as_well() {
    let command = sine_sweep(1.0, 0.0, 400.0, 4.0, RATE).unwrap().values;
    for bins in [8, 12, 20, 40] {
        let band = (200.0, 200.0 + f64::from(bins - 1) / 4.0);
        let accepted = (0..300).filter(|seed| {
            let mut noise = noise(1 + seed);
            let response: Vec<f64> = command.iter().map(|_| noise()).collect();
            identify_delay(&command, &response, RATE, band).is_ok()
        });
        let accepted = accepted.count();
        assert!(accepted <= 2, "{accepted} of 300, {bins} frequencies");
        // The same band of a response with little noise.
        let mut noise = noise(7);
        let late: Vec<f64> =
            (0..command.len()).map(|i| command[i.saturating_sub(3)] + 0.1 * noise()).collect();
        let found = identify_delay(&command, &late, RATE, band).unwrap();
        assert!((found.delay - 3e-3).abs() < 4.0 * found.uncertainty, "{bins} frequencies: {found:?}");
    }
}

#[test]
fn the_uncertainty_is_the_scatter_by_noise() {
    let (x, y) = late(5e-3);
    let mut noise = noise(1);
    let (mut square, mut stated) = (0.0, 0.0);
    for _ in 0..30 {
        let noisy: Vec<f64> = y.iter().map(|v| v + 0.3 * noise()).collect();
        let found = identify_delay(&x, &noisy, RATE, BAND).unwrap();
        square += (found.delay - 5e-3).powi(2) / 30.0;
        stated += found.uncertainty / 30.0;
    }
    assert!((0.6..1.7).contains(&(square.sqrt() / stated)), "{} and {stated}", square.sqrt());
}

#[test]
fn unusable_data_are_refused_with_the_reason() {
    let (x, y) = late(5e-3);
    let text = |x: &[f64], y: &[f64], band| identify_delay(x, y, RATE, band).unwrap_err().to_string();
    assert!(text(&x, &y[1..], BAND).starts_with("response = 31999 samples"));
    assert!(text(&x, &y, (0.25, 600.0)).starts_with("band = (0.25, 600)"));
    assert!(text(&[1.0; 32_000], &y, BAND).starts_with("command = "));
    assert!(text(&x, &[1.0; 32_000], BAND).starts_with("response = "));
    assert!(text(&x, &[f64::NAN; 32_000], BAND).contains("0 of 32000 samples in stretches"));
    let opposite: Vec<f64> = y.iter().map(|y| 2.0 - 0.3 * y).collect();
    let text_of = text(&x, &opposite, BAND);
    assert!(text_of.contains("180° at zero frequency") && text_of.contains("check the wiring"), "{text_of}");
    let other = sine_sweep(1.0, 8.0, 0.3, 32.0, RATE).unwrap().values;
    assert!(text(&x, &other, BAND).contains("must follow the command"));
}
