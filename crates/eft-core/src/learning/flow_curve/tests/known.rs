//! Standard deviations of asymmetry, null offset and departures.

use super::super::{CurveEvidence, CurveState, Direction};
use super::{CURVE, Learned};
use crate::compensation::NODES;
use crate::learning::curve_nodes::node_variance;

/// Relative difference.
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

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
fn a_departure_errs_by_its_prior_and_by_independent_errors_of_the_windows() {
    let (node, at, noise) = (11, 3.0, 2e-3);
    let (mut l, mut error) = (Learned::default(), node_variance::<f64>(node));
    for _ in 0..400 {
        // The filter counts thirty windows as one.
        let given = [30.0 * noise, 0.0];
        l.state.nodes.correct(&mut l.evidence.departures, node, [at, 0.0], given);
        let share = l.state.nodes.variances[node] / (30.0 * noise);
        error = (1.0 - share) * (1.0 - share) * error + share * share * noise;
    }
    let found = CURVE.departure_variances(&l.state.nodes.variances, &l.evidence.departures);
    near("variance", found[node], error, 1e-9);
    // A node that was never visited has its prior.
    near("prior", found[node + 1], node_variance(node + 1), 1e-12);
    assert!(found[node] < 0.3 * l.state.nodes.variances[node]);
}

#[test]
fn a_departure_errs_within_a_quarter_of_the_second_difference_of_the_nodes_up_to_its_bound() {
    let mut departures = [0.0; NODES];
    departures[10..13].copy_from_slice(&[0.02, 0.05, 0.03]);
    let found = CURVE.departure_variances(&[0.0; NODES], &departures);
    near("bend", found[11], (0.25 * 0.05_f64).powi(2) / 3.0, 1e-12);
    near("straight on one side", found[9], (0.25 * 0.02_f64).powi(2) / 3.0, 1e-12);
    // A departure is at most a fifth of its flow.
    departures[9..12].copy_from_slice(&[-0.9, 0.9, -0.9]);
    let found = CURVE.departure_variances(&[0.0; NODES], &departures);
    near("bound", found[10], 0.4 * 0.4, 1e-12);
    assert_eq!(found[8].to_bits(), 0, "no flow, no departure");
}

#[test]
fn variances_of_the_filters_give_the_stated_ones() {
    let mut departures = [0.0; NODES];
    departures[12] = 0.04;
    let stated = core::array::from_fn(|node| 0.3 * node_variance::<f64>(node));
    let variances = CURVE.filter_variances(&stated, &departures);
    let again = CURVE.departure_variances(&variances, &departures);
    for (found, expected) in again.into_iter().zip(stated) {
        near("stated", found, expected, 1e-9);
    }
    // The bend alone is more than what is stated here.
    let exact = CURVE.filter_variances(&[1e-6; NODES], &departures);
    assert_eq!(exact[12].to_bits(), 0);
    // Nothing is known worse than at the start.
    let unknown = CURVE.filter_variances(&[1.0; NODES], &departures);
    near("prior", unknown[10], node_variance(10), 1e-12);
}
