//! The sums of a learner that starts from a saved calibration, and the limits of what it accepts.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::compensation::{NODES, PIECES};
use crate::error::ConfigError;
use crate::learning::Learner;
use crate::learning::checkpoint::Evidence;
use crate::learning::deviation::Deviation;
use crate::learning::learner::LearnerState;
use crate::learning::least_squares::{Estimate, LeastSquares, Priors, Range};
use crate::learning::saved::{SavedCalibration, SavedDistances, SavedEvidence};
use crate::status;

const RIG: Parameters = Parameters {
    learning: Learning { guard: false, curve_correction: true, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};
/// Nodes with an own departure.
const INNER: [usize; 4] = [1, PIECES / 2 - 1, PIECES / 2 + 1, PIECES - 1];

fn learner() -> Learner<f64, 21> {
    Learner::<f64, 21>::new(&RIG).unwrap()
}

/// A saved calibration with numbers of which none is a configured one.
fn saved() -> SavedCalibration {
    let learner = learner();
    assert!(learner.flow.priors.delay.bounds[0] < 2e-3);
    let mut saved = SavedCalibration {
        flow_gain: 0.9,
        velocity_delay: 2e-3,
        valve_gain: 1.2,
        response_delay: 7e-3,
        null_offset: 0.02,
        excitation: 0.3,
        evidence: SavedEvidence {
            time: 7.0,
            mean_weight: 0.6,
            mean_square_frequency: 900.0,
            growth: 4.0,
            flow: 0.017,
            flow_rate: 0.3,
            rate_flow: 0.2,
            rate_flow_rate: 14.0,
            compressed_flow: 5e-3,
            flow_error: 1e-4,
            spool_error: 4e-3,
            distances: SavedDistances {
                flow_gain: 1e-3,
                valve_gain: -2e-3,
                response_delay: 3e-5,
                velocity_delay: -4e-5,
                null_offset: 5e-4,
            },
        },
        ..learner.saved(&learner.at_rest())
    };
    let curve = &mut saved.curve;
    (curve.asymmetry, curve.asymmetry_deviation, curve.error) = (0.05, 0.01, 1e-5);
    (curve.flow_gain_share, curve.mean_departure, curve.time, curve.sensor_offset) = (-4e-3, 0.03, 2.0, 6e-3);
    (curve.null_time, curve.null_coupling) = (1.5, 0.7);
    for (n, node) in INNER.into_iter().enumerate() {
        curve.departures[node] = 1e-5 * (n as f64 + 1.0);
        curve.departure_deviations[node] = 2e-5 * (n as f64 + 1.0);
    }
    saved
}

/// Every number but the flows of the nodes.
fn numbers(s: &SavedCalibration) -> [f64; 32] {
    let (e, away, c) = (&s.evidence, &s.evidence.distances, &s.curve);
    [
        s.greatest_flow,
        s.flow_gain,
        s.valve_gain,
        s.response_delay,
        s.velocity_delay,
        s.null_offset,
        s.excitation,
        e.time,
        e.mean_weight,
        e.mean_square_frequency,
        e.growth,
        e.flow,
        e.flow_rate,
        e.rate_flow,
        e.rate_flow_rate,
        e.compressed_flow,
        e.flow_error,
        e.spool_error,
        away.flow_gain,
        away.valve_gain,
        away.response_delay,
        away.velocity_delay,
        away.null_offset,
        c.asymmetry,
        c.asymmetry_deviation,
        c.error,
        c.flow_gain_share,
        c.mean_departure,
        c.time,
        c.sensor_offset,
        c.null_time,
        c.null_coupling,
    ]
}

fn started(saved: &SavedCalibration) -> LearnerState<f64> {
    learner().start_from(saved).unwrap()
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// Gain and delay (s) that explain the sums, without a limited rate.
fn solution(priors: Priors<f64>, sums: &LeastSquares<f64>) -> [f64; 2] {
    let wide = Range { bounds: [-10.0, 10.0], change: 10.0 };
    let free = Priors { gain: wide, delay: wide, ..priors };
    let mut found = free.at_rest();
    free.solve(&mut found, sums);
    [found.gain.value, found.delay.value]
}

#[test]
fn a_started_learner_saves_what_it_started_from() {
    for sample_rate in [1024.0, 4096.0, 10_000.0] {
        let other = Learner::<f64, 21>::new(&Parameters { sample_rate, ..RIG }).unwrap();
        let again = other.saved(&other.start_from(&saved()).unwrap());
        for (n, (found, expected)) in numbers(&again).into_iter().zip(numbers(&saved())).enumerate() {
            assert!((found / expected - 1.0).abs() < 1e-9, "{sample_rate}, {n}: {found:e}, not {expected:e}");
        }
    }
}

#[test]
fn the_sums_give_the_saved_estimates_also_where_the_priors_count() {
    for excitation in [1e-6, 0.3] {
        let state = started(&SavedCalibration { excitation, ..saved() });
        let [gain, delay] = solution(learner().flow.priors, &state.evidence.flow);
        near("flow gain", gain, 0.9 + 1e-3, 1e-9);
        near("velocity delay", delay, 2e-3 - 4e-5, 1e-9);
        let [gain, delay] = solution(learner().valve.priors, &state.evidence.valve);
        near("valve gain", gain, 1.2 - 2e-3, 1e-9);
        near("response delay", delay, 7e-3 + 3e-5, 1e-9);
        for Estimate { beyond, .. } in [state.flow.gain, state.flow.delay, state.valve.found.gain] {
            assert_eq!(beyond.to_bits(), 0, "not beyond its bounds");
        }
    }
}

/// The estimate of a rig whose true gain is beyond the bound stays at the bound, and says so.
#[test]
fn a_result_beyond_the_bounds_stays_beyond_them() {
    let mut given = saved();
    (given.flow_gain, given.evidence.distances.flow_gain) = (1.35, 0.2);
    let state = started(&given);
    near("beyond", state.flow.gain.beyond, 0.2, 1e-9);
    assert_ne!(learner().first_calibration(&state).status & status::ESTIMATE_BOUNDED, 0);
    assert!(state.deviations.flow_gain > 0.2);
}

#[test]
fn the_sums_are_those_of_the_motion() {
    let Evidence { flow, valve, newer_openings, amount, time, flow_errors, spool_errors, compressed, .. } =
        started(&saved()).evidence;
    let period = learner().valve.priors.period;
    near("amount", amount, 0.3, 1e-12);
    near("openings", valve.matrix[0][0], 0.3, 1e-12);
    near("newer openings", newer_openings, 0.6 * 0.3, 1e-12);
    near("changes", valve.matrix[1][1], 900.0 * 0.3 * period * period, 1e-12);
    // A regressor of a delay is the decrease over a window.
    for mixed in [valve.matrix[0][1], valve.matrix[1][0]] {
        near("openings and changes", mixed, -4.0 * 0.3 * period, 1e-12);
    }
    near("flows", flow.matrix[0][0], 0.3 * 0.017, 1e-12);
    near("opening and flow's change", flow.matrix[0][1], -0.3 * 0.3 * period, 1e-12);
    near("opening's change and flow", flow.matrix[1][0], -0.3 * 0.2 * period, 1e-12);
    near("flow's changes", flow.matrix[1][1], 0.3 * 14.0 * period * period, 1e-12);
    near("time", time, 7.0, 1e-12);
    near("flow errors", flow_errors, 7.0 * 1e-8, 1e-12);
    near("spool errors", spool_errors, 7.0 * 16e-6, 1e-12);
    near("compressed", compressed, 0.3 * 25e-6, 1e-12);
}

#[test]
fn deviations_and_disturbance_are_those_of_the_sums() {
    let (learner, state) = (learner(), started(&saved()));
    let square = learner.valve.mean_square_frequency(&state.evidence.valve);
    let increase = learner.valve.gain_increase(&state.valve.found, square);
    assert_eq!(state.deviations, learner.deviations(&state, square, increase));
    // The distance of the result of the table itself is a part.
    assert!(state.deviations.flow_gain > 1e-3 + 4e-3 * 0.9, "{state:?}");
    let disturbance = Deviation::disturbance(&state.evidence, increase);
    assert_eq!(state.curve.disturbance.to_bits(), disturbance.to_bits());
    // Half of the motion is half of the evidence: more noise, and the same bounds.
    let half = started(&SavedCalibration { excitation: 0.15, ..saved() });
    assert!(half.deviations.valve_gain > state.deviations.valve_gain, "{half:?}");
}

#[test]
fn departures_and_their_deviations_are_saved_in_units_of_flow() {
    let given = saved();
    let state = started(&given);
    let again = learner().saved(&state);
    let step = 536.2 * 1.6387064e-5 / 7.0;
    for node in 0..NODES {
        let [departure, deviation] =
            [given.curve.departures, given.curve.departure_deviations].map(|of_node| of_node[node]);
        near("departure", state.evidence.curve.departures[node], departure / step, 1e-9);
        let inner = INNER.contains(&node);
        assert_eq!(again.curve.departures[node] > 0.0, inner, "{node}");
        if inner {
            near("departure", again.curve.departures[node], departure, 1e-9);
            near("deviation", again.curve.departure_deviations[node], deviation, 1e-9);
        }
    }
    near("greatest flow", again.greatest_flow, 7.0 * step, 1e-9);
}

#[test]
fn the_ends_have_no_departure() {
    let mut given = saved();
    for node in [0, PIECES] {
        (given.curve.departures[node], given.curve.departure_deviations[node]) = (1e-5, 2e-5);
    }
    let again = learner().saved(&started(&given));
    for node in [0, PIECES / 2, PIECES] {
        assert_eq!(again.curve.departures[node].to_bits(), 0, "{node}");
        assert_eq!(again.curve.departure_deviations[node].to_bits(), 0, "{node}");
    }
}

#[test]
fn the_correction_acts_from_the_first_calibration_on() {
    let given = saved();
    let (learner, state) = (learner(), started(&given));
    let step = 536.2 * 1.6387064e-5 / 7.0;
    let calibration = learner.calibration(&state, 0, 0.0);
    for node in 1..PIECES {
        let demand = (node as f64 - 8.0) * step;
        let table = demand + 0.05 * demand.abs() + given.curve.departures[node];
        let found = learner.curve.grid.apply(&calibration.curve, demand);
        assert!((found - table).abs() < 1e-9 * step, "{node}: {found}, not {table}");
    }
}

#[test]
fn an_estimate_may_exceed_its_range_by_rounding_only() {
    let given = saved();
    let accepted = |change: &dyn Fn(&mut SavedCalibration)| {
        let mut changed = given;
        change(&mut changed);
        learner().start_from(&changed).is_ok()
    };
    // A millionth of the sum of the bounds.
    for (flow_gain, expected) in
        [(1.350_002, true), (1.350_003, false), (0.699_998_1, true), (0.699_997, false)]
    {
        assert_eq!(accepted(&|saved| saved.flow_gain = flow_gain), expected, "{flow_gain}");
    }
    for (share, expected) in [(1.9e-6, true), (-1.9e-6, true), (2.1e-6, false), (-2.1e-6, false)] {
        assert_eq!(accepted(&|saved| saved.greatest_flow *= 1.0 + share), expected, "{share}");
    }
}

#[test]
fn a_departure_and_its_deviation_reach_a_fifth_of_their_flow() {
    let given = saved();
    let step = 536.2 * 1.6387064e-5 / 7.0;
    for node in [0, 1, 5, 7, 9, 12, 15, 16] {
        let reach = 0.2 * (node as f64 - 8.0).abs() * step;
        for (share, expected) in [(0.999, true), (1.001, false)] {
            let (mut departs, mut deviates) = (given, given);
            departs.curve.departures[node] = share * reach;
            deviates.curve.departure_deviations[node] = share * reach;
            for changed in [departs, deviates] {
                assert_eq!(learner().start_from(&changed).is_ok(), expected, "{node}: {share}");
            }
        }
    }
}

/// No sum of products exceeds the root of its two sums of squares. The largest flow is four times the table's, times
/// the highest flow gain where it is measured. The low-passes of 13 Hz limit its rate.
#[test]
fn no_mean_exceeds_what_the_largest_signals_give() {
    let corner = core::f64::consts::TAU * 13.0;
    let predicted = 4.0 * 536.2 * 1.6387064e-5;
    let measured = 1.35 * predicted;
    // Over the root mean square of the opening.
    let (most, frequency) = ((7.0_f64 / 0.3).sqrt(), 30.0);
    let refused = |name: &str, bound: f64, change: &dyn Fn(&mut SavedCalibration, f64)| {
        for (share, expected) in [(0.999, true), (1.003, false)] {
            let mut changed = saved();
            change(&mut changed, share * bound);
            let started = learner().start_from(&changed);
            let found = match started {
                Ok(_) => true,
                Err(ConfigError::OutOfRange { parameter, .. }) => {
                    assert_eq!(parameter, name);
                    false
                }
                Err(other) => panic!("{name}: {other:?}"),
            };
            assert_eq!(found, expected, "{name}: {share}");
        }
    };
    refused("calibration.excitation", 4.0 * 0.25 + 1.5e-3 + 5e-5, &|s, value| s.excitation = value);
    refused("calibration.evidence.mean_square_frequency", 1e6, &|s, value| {
        s.evidence.mean_square_frequency = value;
    });
    refused("calibration.evidence.growth", frequency, &|s, value| s.evidence.growth = value);
    refused("calibration.evidence.flow", most * predicted, &|s, value| s.evidence.flow = value);
    refused("calibration.evidence.rate_flow", frequency * most * predicted, &|s, value| {
        s.evidence.rate_flow = -value;
    });
    refused("calibration.evidence.flow_rate", corner * most * measured, &|s, value| {
        s.evidence.flow_rate = -value;
    });
    refused("calibration.evidence.rate_flow_rate", frequency * corner * most * measured, &|s, value| {
        s.evidence.rate_flow_rate = value;
    });
    refused("calibration.evidence.compressed_flow", most * measured, &|s, value| {
        s.evidence.compressed_flow = value;
    });
    refused("calibration.evidence.flow_error", predicted + measured, &|s, value| {
        s.evidence.flow_error = value;
    });
    refused("calibration.evidence.spool_error", 2.0 * 2.25, &|s, value| s.evidence.spool_error = value);
    refused("calibration.evidence.distances.flow_gain", 10.0 * 2.05, &|s, value| {
        s.evidence.distances.flow_gain = value;
    });
    refused("calibration.evidence.distances.velocity_delay", 10.0 * 15e-3, &|s, value| {
        s.evidence.distances.velocity_delay = value;
    });
    refused("calibration.evidence.distances.null_offset", 10.0 * 0.1, &|s, value| {
        s.evidence.distances.null_offset = value;
    });
    refused("calibration.curve.error", predicted + measured, &|s, value| s.curve.error = value);
    refused("calibration.curve.sensor_offset", 2.0 * 2.25, &|s, value| s.curve.sensor_offset = -value);
    refused("calibration.curve.mean_departure", 0.2, &|s, value| s.curve.mean_departure = value);
}

/// An opening that grows as `exp(30·t)` has the rate `x' = 30·x`. The mean of `x·x'` is then the largest that the mean
/// squares allow, and may exceed it by the rounding of its sum.
#[test]
fn the_mean_products_of_a_growing_opening_may_exceed_their_bound_by_rounding() {
    for (share, expected) in [(1.0, true), (1.0005, true), (-1.0005, true), (1.0015, false), (-1.0015, false)]
    {
        let mut given = saved();
        given.evidence.growth = share * 30.0;
        assert_eq!(learner().start_from(&given).is_ok(), expected, "{share}");
    }
}

#[test]
fn nothing_starts_without_evidence_or_without_estimates() {
    let mut given = saved();
    let fixed = Parameters { learning: Learning { guard: true, ..Learning::OFF }, ..RIG };
    let fixed = Learner::<f64, 21>::new(&fixed).unwrap();
    assert_eq!(fixed.start_from(&given), Ok(fixed.at_rest()));
    given.excitation = 0.0;
    assert_eq!(started(&given), learner().at_rest());
    // Without evidence nothing else is read.
    given.flow_gain = f64::NAN;
    assert_eq!(started(&given), learner().at_rest());
}
