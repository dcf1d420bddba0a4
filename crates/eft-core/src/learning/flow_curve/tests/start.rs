//! A curve that starts from what is known of it.

use super::super::{CurveSample, FlowCurve, Known, Memory};
use super::{CURVE, Learned};

/// Relative difference.
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// What is known of a curve, with numbers of which none is another one.
const KNOWN: Known<f64> = Known {
    mean_square: 2e-3,
    asymmetry: [0.05, 0.012],
    common: 0.04,
    share: 0.02,
    openings: 7.0,
    sensor: 0.003,
    null: [0.008, 0.002],
    memory: MEMORY,
};
const MEMORY: Memory<f64> = Memory { time: 3.0, null_time: 0.9, null_coupling: 0.6 };
/// The flow gain, and the table's slope (m³/s).
const GAINS: [f64; 2] = [1.1, 9.0];

fn knowing(known: Known<f64>) -> Learned {
    let mut l = Learned::default();
    CURVE.start((&mut l.state, &mut l.evidence), &known, GAINS);
    l
}

/// The same with another coupling of null offset and gains (1).
fn coupled(null_coupling: f64) -> Known<f64> {
    Known { memory: Memory { null_coupling, ..MEMORY }, ..KNOWN }
}

#[test]
fn what_is_known_stays_without_new_windows() {
    let nothing = CurveSample {
        demand: 0.0,
        instrument: 0.0,
        departures: 0.0,
        passed: 0.0,
        slope: 0.0,
        error: 0.0,
        reading: 0.0,
    };
    for null_coupling in [0.0, 0.3, 0.6] {
        let mut l = knowing(coupled(null_coupling));
        near("null offset in use", l.evidence.null, 0.008, 1e-12);
        let before = l.state.variance;
        for _ in 0..40 {
            let Memory { time, null_time, null_coupling: coupling } =
                CURVE.memory(&l.state, &l.evidence, 9.0);
            near("time", time, 3.0, 1e-12);
            near("null's time", null_time, 0.9, 1e-12);
            assert!((coupling - null_coupling).abs() < 1e-9, "{coupling}, not {null_coupling}");
            near("share", FlowCurve::share(&l.evidence), 0.02, 1e-12);
            near("asymmetry", l.evidence.asymmetry, 0.05, 1e-9);
            near("its deviation", CURVE.asymmetry_deviation(&l.evidence), 0.012, 1e-9);
            near("mean square", CURVE.mean_square(&l.evidence), 2e-3, 1e-12);
            near("offset", l.state.offset, 0.01, 1e-9);
            near("variance", l.state.variance, before, 1e-9);
            CURVE.update(&mut l.state, &mut l.evidence);
        }
        // It follows the one that was found.
        near("null offset in use", l.evidence.null, 0.01, 1e-9);
        // A window without motion changes neither.
        FlowCurve::add_direction(&mut l.evidence, &nothing, 1.1, 1.0);
        near("mean departure", l.evidence.common, 0.04, 1e-12);
        near("sensor", l.evidence.sensor, 0.003, 1e-12);
        near("readings", l.evidence.readings, l.evidence.windows, 1e-12);
    }
}

#[test]
fn a_known_residual_is_at_least_that_of_the_first_windows() {
    let windows = knowing(KNOWN).evidence.windows;
    let least = 10.0 * 4e-4 / (windows + 10.0);
    for (mean_square, expected) in
        [(2e-3, 2e-3), (1.01 * least, 1.01 * least), (0.5 * least, least), (0.0, least)]
    {
        let l = knowing(Known { mean_square, ..KNOWN });
        near("mean square", CURVE.mean_square(&l.evidence), expected, 1e-12);
        assert!(l.evidence.squares >= 0.0);
    }
}

#[test]
fn a_known_deviation_is_at_most_that_of_the_prior() {
    let prior = 0.03 * 0.5_f64.sqrt();
    for (deviation, expected) in [(0.012, 0.012), (0.99 * prior, 0.99 * prior), (0.1, prior)] {
        let l = knowing(Known { asymmetry: [0.05, deviation], ..KNOWN });
        near("deviation", CURVE.asymmetry_deviation(&l.evidence), expected, 1e-12);
    }
    // A null offset of which nothing is remembered has its prior.
    let l = knowing(Known { memory: Memory { null_time: 0.0, ..MEMORY }, ..KNOWN });
    near("variance", l.state.variance, 1e-4, 1e-12);
}

#[test]
fn a_gain_that_looks_like_a_null_offset_counts_for_less() {
    let variance = |null_coupling: f64| knowing(coupled(null_coupling)).state.variance;
    let information = |coupling: f64| 1.0 / variance(coupling) - 1e4;
    near("half of the information", information(0.5), 0.5 * information(0.0), 1e-9);
    near("the prior alone", variance(1.0), 1e-4, 1e-12);
    // The time is that of a slope of 9 m³/s, 63/8 steps. Windows of one error count as one.
    let slope = 9.0 * 7.0 / 8.0;
    let windows = 0.9 / (CURVE.average * 4.0);
    near("information", information(0.0), slope * slope * windows / (CURVE.correlation * 2e-3), 1e-9);
}

#[test]
fn a_window_that_agrees_with_what_is_known_changes_nothing() {
    let mut l = knowing(Known { null: [0.0; 2], ..coupled(0.0) });
    // Six steps forwards through a valve of this asymmetry. The windows count far more than what is known.
    let sample = CurveSample {
        demand: 6.0,
        instrument: 6.0,
        departures: 0.0,
        passed: 6.3,
        slope: 0.0,
        error: 0.0,
        reading: 0.0,
    };
    for _ in 0..100 {
        FlowCurve::add_direction(&mut l.evidence, &sample, 1.1, 1.0);
    }
    CURVE.update(&mut l.state, &mut l.evidence);
    CURVE.refresh(&mut l.state, &l.evidence);
    near("asymmetry", l.evidence.asymmetry, 0.05, 1e-6);
}

/// Motion in one direction: its gain looks like a null offset, while the other direction's gain has its prior.
#[test]
fn a_motion_in_one_direction_leaves_the_null_offset_unknown() {
    let window = |l: &mut Learned, instrument: f64, error: f64| {
        let passed = [9.0 * instrument, 9.0];
        let sample = CURVE.sample(&l.evidence, 9.0 * instrument + error, passed, [0.0; 2]);
        CURVE.learn(&mut l.state, &mut l.evidence, &sample, 1.0, 1.0);
        CURVE.update(&mut l.state, &mut l.evidence);
    };
    let mut before = Learned::default();
    for n in 0..1000_u32 {
        window(&mut before, 0.4 + 0.01 * (0.1 * f64::from(n)).sin(), 0.3 * (1.7 * f64::from(n)).sin());
    }
    let memory = CURVE.memory(&before.state, &before.evidence, 9.0);
    assert!(memory.null_coupling > 0.9, "{memory:?}");
    let known = Known {
        mean_square: CURVE.mean_square(&before.evidence),
        asymmetry: [before.evidence.asymmetry, CURVE.asymmetry_deviation(&before.evidence)],
        null: [before.evidence.null, before.state.offset - before.evidence.null],
        memory,
        ..KNOWN
    };
    let mut l = Learned::default();
    CURVE.start((&mut l.state, &mut l.evidence), &known, [1.0, 9.0]);
    let stated = before.state.variance;
    near("variance", l.state.variance, stated, 1e-9);
    near("its deviation", CURVE.asymmetry_deviation(&l.evidence), known.asymmetry[1], 1e-9);
    // Less noise makes it known better, and never perfectly.
    for n in 0..2000_u32 {
        window(&mut l, 0.4 * (0.1 * f64::from(n)).sin(), 0.0);
        assert!((0.0..1.01 * stated).contains(&l.state.variance), "{n}: {} of {stated}", l.state.variance);
    }
}
