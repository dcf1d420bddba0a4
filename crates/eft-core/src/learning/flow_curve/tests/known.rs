//! Standard deviations of asymmetry and null offset, and the sums that give known ones.

use super::super::{CurveEvidence, CurveSample, CurveState, Direction, FlowCurve};
use super::{CURVE, Learned};

/// Relative difference.
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// What gives this mean square (squared steps), an asymmetry and its deviation, a null offset and its variance, and the
/// deviation of the spool's gain. The flow gain is 1.1, and the table's slope 9 m³/s.
fn knowing(square: f64, asymmetry: [f64; 2], null: [f64; 3]) -> Learned {
    let mut l = Learned::default();
    CURVE.know((&mut l.state, &mut l.evidence), square, asymmetry, null, [1.1, 9.0]);
    l
}

const ASYMMETRY: [f64; 2] = [0.05, 0.012];
const NULL: [f64; 3] = [0.008, 1.6e-5, 0.02];

#[test]
fn an_asymmetry_is_half_of_the_difference_of_two_independent_gains() {
    let of = |flows: f64| Direction { flows, ..Direction::default() };
    let evidence = CurveEvidence {
        directions: [of(200.0), of(900.0)],
        squares: 0.1,
        windows: 5.0,
        ..CurveEvidence::default()
    };
    let variance = 30.0 * (0.1 + 4e-3) / 15.0;
    // The information on a gain, with the prior of 3 %.
    let [back, forth] = [200.0_f64, 900.0].map(|flows| flows / variance + 1.0 / 9e-4);
    let expected = 0.5 * (1.0 / back + 1.0 / forth).sqrt();
    near("deviation", CURVE.asymmetry_deviation(&evidence), expected, 1e-12);
}

#[test]
fn a_null_offset_errs_by_noise_distance_and_a_late_gain() {
    let of = |slopes: f64| Direction { slopes, ..Direction::default() };
    let evidence = CurveEvidence { directions: [of(3e5), of(5e5)], null: 0.01, ..CurveEvidence::default() };
    let state = CurveState { offset: 0.014, ..CurveState::default() };
    // A slope of 9 m³/s is 63/8 steps. The sensor's offset is a mean over a thousand windows.
    let slope = 9.0 * 7.0 / 8.0;
    let [variance, per_gain] = CURVE.null_errors(&state, &evidence, 9.0);
    near("variance", variance, 1e-4 + 4e-3 * 4e-3, 1e-12);
    near("per gain", per_gain, 0.01 * slope * slope / (1e-3 * 8e5), 1e-12);
    // In a shorter memory than the sensor's the offset follows the whole change.
    let short = CurveEvidence { directions: [of(2e4), of(3e4)], ..evidence };
    let [_, per_gain] = CURVE.null_errors(&state, &short, 9.0);
    near("per gain", per_gain, 0.01, 1e-12);
}

#[test]
fn a_known_residual_is_at_least_that_of_the_first_windows() {
    // Ten windows of 0.02 steps among a thousand without an error.
    let least = 10.0 * 4e-4 / 1010.0;
    for (square, expected) in [(2e-3, 2e-3), (1.01 * least, 1.01 * least), (0.5 * least, least), (0.0, least)]
    {
        let l = knowing(square, ASYMMETRY, NULL);
        near("mean square", CURVE.mean_square(&l.evidence), expected, 1e-12);
        assert!(l.evidence.squares >= 0.0);
    }
}

#[test]
fn a_known_deviation_is_at_most_that_of_the_prior() {
    let prior = 0.03 * 0.5_f64.sqrt();
    for (deviation, expected) in [(0.012, 0.012), (0.99 * prior, 0.99 * prior), (0.1, prior)] {
        let l = knowing(2e-3, [0.05, deviation], NULL);
        near("deviation", CURVE.asymmetry_deviation(&l.evidence), expected, 1e-12);
    }
    // A null offset that is hardly known leaves no sums of slopes.
    let [null, _, of_gain] = NULL;
    let l = knowing(2e-3, ASYMMETRY, [null, 4e-4, of_gain]);
    for direction in l.evidence.directions {
        assert_eq!(direction.slopes.to_bits(), 0);
    }
}

#[test]
fn the_variance_of_a_known_null_offset_is_noise_and_the_late_gain() {
    for of_gain in [0.0, 0.02, 0.1] {
        let (null, all) = (0.008, 1.6e-5);
        let mut l = knowing(2e-3, ASYMMETRY, [null, all, of_gain]);
        for _ in 0..2 {
            let [noise, per_gain] = CURVE.null_errors(&l.state, &l.evidence, 9.0);
            near("variance", noise + (per_gain * of_gain) * (per_gain * of_gain), all, 1e-6);
            CURVE.update(&mut l.state, &mut l.evidence);
        }
        assert!(of_gain > 0.0 || (l.state.variance / all - 1.0).abs() < 1e-6, "only noise");
    }
}

#[test]
fn a_window_that_agrees_with_what_is_known_changes_nothing() {
    let mut l = knowing(2e-3, ASYMMETRY, NULL);
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
        FlowCurve::gather(&mut l.evidence, &sample, 1.1, 1.0);
    }
    CURVE.update(&mut l.state, &mut l.evidence);
    near("asymmetry", l.evidence.asymmetry, 0.05, 1e-6);
}
