//! The sums of a learner that starts from a saved calibration, and the limits of what it accepts.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::compensation::{NODES, PIECES};
use crate::learning::Learner;
use crate::learning::learner::LearnerState;
use crate::learning::least_squares::{LeastSquares, Priors, Range};
use crate::learning::saved::SavedCalibration;

const RIG: Parameters = Parameters {
    learning: Learning { guard: false, curve_correction: true, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};
/// Nodes with an own departure.
const INNER: [usize; 4] = [1, PIECES / 2 - 1, PIECES / 2 + 1, PIECES - 1];

fn learner() -> Learner<f64, 21> {
    Learner::<f64, 21>::new(&RIG).unwrap()
}

/// What a motion was learned from.
#[derive(Clone, Copy)]
struct Motion {
    /// Mean-square frequency (1/s²).
    square: f64,
    /// Evidence (s).
    excitation: f64,
    /// Square of the share of leakage and oil in the flow (1).
    share_square: f64,
    /// Noise of flow and spool (1).
    noise: [f64; 2],
}

const MOTION: Motion = Motion { square: 900.0, excitation: 0.3, share_square: 0.1, noise: [5e-3, 4e-3] };

/// A saved calibration with the deviations of this motion, and numbers of which none is a configured one.
fn saved(motion: Motion) -> SavedCalibration {
    let learner = learner();
    let mut saved = learner.saved(&learner.at_rest());
    (saved.flow_gain, saved.velocity_delay) = (0.9, 2e-3);
    (saved.valve_gain, saved.response_delay) = (1.2, 7e-3);
    saved.excitation = motion.excitation;
    let flow = learner.flow.priors;
    let mut found = learner.at_rest();
    (found.flow.gain.value, found.flow.delay.value) = (saved.flow_gain, saved.velocity_delay);
    (found.valve.found.gain.value, found.valve.found.delay.value) = (saved.valve_gain, saved.response_delay);
    let systematic = learner.deviation.systematic(
        motion.share_square,
        motion.square,
        &found.flow,
        &found.valve.found,
        flow.period,
    );
    let root = |noise: f64, systematic: f64| libm::sqrt(noise * noise + systematic);
    let [of_flow, of_spool] = motion.noise;
    let frequency = libm::sqrt(motion.square);
    let d = &mut saved.deviations;
    d.flow_gain = root(of_flow, systematic.flow_gain);
    d.valve_gain = of_spool;
    d.response_delay = root(of_spool / frequency, systematic.response_delay);
    d.velocity_delay = root(of_flow / frequency, systematic.velocity_delay);
    d.null_offset = 5e-3;
    assert!(flow.delay.bounds[0] < 2e-3);
    saved.null_offset = 0.02;
    let curve = &mut saved.curve;
    (curve.asymmetry, curve.asymmetry_deviation, curve.error) = (0.05, 0.01, 1e-5);
    for (n, node) in INNER.into_iter().enumerate() {
        curve.departures[node] = 1e-5 * (n as f64 + 1.0);
        curve.departure_deviations[node] = 2e-5 * (n as f64 + 1.0);
    }
    saved
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
fn the_sums_give_the_saved_estimates_also_where_the_priors_count() {
    for excitation in [1e-6, 0.3] {
        let state = started(&saved(Motion { excitation, ..MOTION }));
        let [gain, delay] = solution(learner().flow.priors, &state.evidence.flow);
        near("flow gain", gain, 0.9, 1e-9);
        near("velocity delay", delay, 2e-3, 1e-9);
        let [gain, delay] = solution(learner().valve.priors, &state.evidence.valve);
        near("valve gain", gain, 1.2, 1e-9);
        near("response delay", delay, 7e-3, 1e-9);
    }
}

#[test]
fn gains_have_the_saved_deviations_also_where_the_priors_count() {
    for excitation in [1e-6, 0.3] {
        let given = saved(Motion { excitation, share_square: 0.0, noise: [5e-3, 0.2], ..MOTION });
        let found = started(&given).deviations;
        near("flow gain", found.flow_gain, given.deviations.flow_gain, 1e-9);
        // The priors reduce the motion's frequency, on which the spool's small systematic part depends.
        near("valve gain", found.valve_gain, given.deviations.valve_gain, 0.02);
    }
}

#[test]
fn sums_of_openings_changes_and_flows_are_those_of_the_motion() {
    for square in [0.25, 900.0] {
        let state = started(&saved(Motion { square, ..MOTION }));
        let evidence = &state.evidence;
        near("openings", evidence.valve.matrix[0][0], 0.3, 1e-12);
        near("newer openings", evidence.newer_openings, 0.3, 1e-12);
        near("amount", evidence.amount, 0.3, 1e-12);
        let period = learner().valve.priors.period;
        near("changes", evidence.valve.matrix[1][1], square * 0.3 * period * period, 1e-3);
        // The instruments are openings, and the regressors flows.
        near("flows", evidence.flow.matrix[0][0], 0.3 * RIG.flow_gain, 1e-12);
    }
}

#[test]
fn the_oils_flow_gives_the_systematic_part_of_the_velocitys_delay() {
    let state = started(&saved(MOTION));
    let share = state.evidence.compressed / (RIG.flow_gain * RIG.flow_gain) / 0.3;
    near("systematic part", share, 0.1, 1e-6);
}

#[test]
fn a_flow_gain_that_is_known_too_well_bounds_the_systematic_part() {
    let mut given = saved(Motion { noise: [0.0, 4e-3], ..MOTION });
    given.deviations.flow_gain *= 0.5;
    let state = started(&given);
    let share = state.evidence.compressed / (RIG.flow_gain * RIG.flow_gain) / 0.3;
    // 98 % of the variance of the gain.
    near("systematic part", share, 0.98 * 0.25 * 0.1, 1e-6);
    near("flow gain", state.deviations.flow_gain, given.deviations.flow_gain, 1e-3);
}

#[test]
fn the_departures_part_of_the_flow_gain_is_saved_and_is_no_noise() {
    let (plain, mut given) = (saved(MOTION), saved(MOTION));
    let of_share = 0.9 * 4e-3;
    given.curve.flow_gain_share = -4e-3;
    let d = &mut given.deviations.flow_gain;
    *d = libm::sqrt(*d * *d + of_share * of_share);
    let (alone, state) = (started(&plain), started(&given));
    near("noise", state.evidence.flow_errors, alone.evidence.flow_errors, 1e-9);
    near("delay's evidence", state.evidence.flow.matrix[1][1], alone.evidence.flow.matrix[1][1], 1e-9);
    near("deviation", state.deviations.flow_gain, given.deviations.flow_gain, 1e-6);
    near("share", learner().saved(&state).curve.flow_gain_share, -4e-3, 1e-9);
    // A larger share than the deviation leaves a fiftieth of the variance as noise.
    given.curve.flow_gain_share = 0.1;
    let state = started(&given);
    near("deviation", state.deviations.flow_gain, given.deviations.flow_gain, 1e-3);
    let most = 0.98_f64.sqrt() * given.deviations.flow_gain / 0.9;
    near("share", learner().saved(&state).curve.flow_gain_share, most, 1e-9);
}

#[test]
fn departures_and_their_deviations_are_saved_in_units_of_flow() {
    let given = saved(MOTION);
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
    let mut given = saved(MOTION);
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
    let given = saved(MOTION);
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
fn the_null_offset_has_its_saved_deviation_at_any_gain_of_the_spool() {
    // A gain that is hardly known, which the offset of the sensor follows late.
    let given = saved(Motion { excitation: 1e-3, noise: [5e-3, 0.1], ..MOTION });
    near("deviation", started(&given).deviations.null_offset, 5e-3, 1e-3);
}

#[test]
fn an_estimate_may_exceed_its_range_by_rounding_only() {
    let given = saved(MOTION);
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
    let given = saved(MOTION);
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

#[test]
fn nothing_starts_without_evidence_or_without_estimates() {
    let mut given = saved(MOTION);
    let fixed = Parameters { learning: Learning { guard: true, ..Learning::OFF }, ..RIG };
    let fixed = Learner::<f64, 21>::new(&fixed).unwrap();
    assert_eq!(fixed.start_from(&given), Ok(fixed.at_rest()));
    given.excitation = 0.0;
    assert_eq!(started(&given), learner().at_rest());
    // Without evidence nothing else is read.
    given.flow_gain = f64::NAN;
    assert_eq!(started(&given), learner().at_rest());
}
