//! Noise, systematic errors and single updates for errors that are given.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use crate::channel::Channel;
use crate::compensation::{NODES, PIECES};
use crate::learning::curve_nodes::CurveNodes;
use crate::learning::deviation::attenuation;
use crate::learning::least_squares::{Estimate, GainAndDelay};
use crate::learning::{Learner, LearnerState};
use crate::parameters::{Learning, Parameters, Realization};
use crate::signals::Input;
use crate::table::FlowTable;

const RIG: Parameters =
    Parameters { learning: Learning { guard: false, ..Learning::ADAPTIVE }, ..Parameters::ZHAO2005 };
/// Mean-square frequency (1/s²) of the motion.
const SQUARE: f64 = 900.0;

fn learner() -> Learner<f64, 21> {
    Learner::<f64, 21>::new(&RIG).unwrap()
}

/// A learner's state after much motion, with this null offset (1).
fn started(learner: &Learner<f64, 21>, null_offset: f64) -> LearnerState<f64> {
    let mut saved = learner.saved(&learner.at_rest());
    (saved.excitation, saved.null_offset) = (1.0, null_offset);
    let e = &mut saved.evidence;
    (e.time, e.mean_weight, e.mean_square_frequency) = (1.0, 1.0, SQUARE);
    (e.flow, e.rate_flow_rate) = (RIG.flow_gain, RIG.flow_gain * SQUARE);
    learner.start_from(&saved).unwrap()
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

#[test]
fn noise_is_correlated_for_the_time_of_taps_and_two_low_passes() {
    let learner = learner();
    // White noise through the filter: its variance is the sum of the squares of the impulse response.
    let (share, [ends, middle], mut variance) = (learner.filter.low_pass, learner.filter.taps, 0.0);
    let after = |n: i32| {
        if n < 0 { 0.0 } else { f64::from(n + 1) * share * share * libm::pow(1.0 - share, f64::from(n)) }
    };
    for n in 0..2000 {
        let response = ends * (after(n) + after(n - 2)) + middle * after(n - 1);
        variance += response * response;
    }
    near("correlation", learner.deviation.correlation, learner.gate.period / variance, 1e-9);
}

#[test]
fn noise_at_the_motions_frequency_is_attenuated_by_taps_and_two_low_passes() {
    let learner = learner();
    let (pole, [ends, middle]) = (1.0 - learner.filter.low_pass, learner.filter.taps);
    for hertz in [1.0, 3.0, 6.0, 9.0] {
        let angle = core::f64::consts::TAU * hertz * learner.gate.period;
        let low_pass = (1.0 - pole) * (1.0 - pole) / (1.0 - 2.0 * pole * libm::cos(angle) + pole * pole);
        let amplitude = low_pass * (middle + 2.0 * ends * libm::cos(angle));
        let square = (angle / learner.gate.period) * (angle / learner.gate.period);
        near("amplitude", 1.0 / attenuation(square), amplitude, 0.02);
    }
}

#[test]
fn leakage_and_oil_share_their_error_by_their_squares() {
    let mut learner = learner();
    let rest = learner.at_rest();
    (learner.deviation.leakage_corner, learner.deviation.half_sample) = (300.0, 5e-4);
    let late = GainAndDelay { delay: Estimate::at(2e-3), ..rest.flow };
    let systematic =
        learner.deviation.systematic(0.12, SQUARE, &late, &rest.valve.found, learner.flow.priors.period);
    // The leakage has 300/(300 + 900) of the square, and a third of the square of a bound is its variance.
    near("leakage", systematic.flow_gain, SQUARE * 0.01 * 4e-6, 1e-12);
    near("oil", systematic.velocity_delay, 0.03 * 1.5e-3 * 1.5e-3, 1e-12);
}

#[test]
fn a_node_is_a_kalman_filter_whose_variance_grows_with_the_square_of_its_flow() {
    // Three steps from zero: a belief of 5 % is a variance of 0.15².
    let (node, flow) = (PIECES / 2 + 3, 3.0);
    let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
    let (noise, drift, error) = (0.01, 1e-4, 0.1);
    let (mut variance, mut departure) = (0.0225, 0.0);
    for _ in 0..3 {
        let grown = f64::min(variance + 9.0 * drift, 0.0225);
        let share = grown / (grown + noise);
        (variance, departure) = (share * noise, departure + share * error);
        nodes.correct(&mut departures, node, [flow, error], [noise, drift]);
        near("variance", nodes.variances[node], variance, 1e-12);
        near("departure", departures[node], departure, 1e-12);
    }
}

#[test]
fn a_node_stays_three_tenths_of_a_step_from_its_neighbours() {
    // The node at two steps, for a departure (steps): the slopes below and above it.
    let slopes = |departure: f64| {
        let (node, step) = (PIECES / 2 + 2, 0.5);
        let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
        departures[node] = departure;
        nodes.refresh(node, &departures, 0.1, step);
        let [below, above] = [nodes.pieces[node - 1], nodes.pieces[node]];
        // Both pieces meet at the node, and at the neighbours they have the table's flow.
        near("at the node", below.offset + below.slope, above.offset + above.slope, 1e-12);
        near("below", below.offset + 0.5 * below.slope, 0.5, 1e-12);
        near("above", above.offset + 1.5 * above.slope, 1.5, 1e-12);
        [below.slope, above.slope]
    };
    // Without a departure the asymmetry moves the node by a fifth of a step.
    for (departure, [below, above]) in
        [(0.0, [1.2, 0.8]), (0.05, [1.25, 0.75]), (-2.0, [0.3, 1.7]), (2.0, [1.7, 0.3])]
    {
        let found = slopes(departure);
        near("slope below", found[0], below, 1e-12);
        near("slope above", found[1], above, 1e-12);
    }
}

#[test]
fn every_node_is_refreshed_in_thirty_updates() {
    let mut nodes = CurveNodes::<f64>::default();
    for round in 1..=3 {
        let mut departures = [0.1 * f64::from(round); NODES];
        departures[PIECES / 2] = 0.0;
        for _ in 0..2 * (NODES - 2) {
            nodes.refresh_next(&departures, 0.0, 1.0);
        }
        for (node, (piece, departure)) in nodes.pieces.iter().zip(departures).enumerate().skip(1) {
            let at = node as f64 - (PIECES / 2) as f64;
            let found = piece.offset + piece.slope * at;
            let expected = at + departure;
            assert!((found - expected).abs() < 1e-12, "{round}, {node}: {found}, not {expected}");
        }
    }
}

#[test]
fn a_changing_load_changes_no_estimate() {
    let p = Parameters { realization: Realization::Analog, ..RIG };
    let table = FlowTable::<f64, 21>::new(p.openings, p.flows).unwrap();
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let frequency = core::f64::consts::TAU * 4.0;
    // At 4 Hz a force of a third of the greatest one compresses oil with a flow of some tenths of the piston's.
    let (most, load) = (p.piston_area * p.supply_pressure, 0.3 * p.piston_area * p.supply_pressure);
    for tick in 0..30_000_u32 {
        let time = f64::from(tick) / p.sample_rate;
        let late = time - p.response_delay;
        let spool = 0.05 * libm::sin(frequency * late);
        let force = -load * libm::cos(frequency * late);
        let root = libm::sqrt(1.0 - spool.signum() * force / most);
        let compressed = p.compressibility * load / p.piston_area * frequency * libm::sin(frequency * late);
        let flow = table.flow(spool) * root - p.leakage * force / p.piston_area - compressed;
        let valve_command = 0.05 * libm::sin(frequency * time) / p.valve_gain;
        let velocity = flow / p.piston_area;
        let input = Input { command: force, velocity, force, spool, valve_command, ..Input::default() };
        if let Some(window) = channel.step(&mut state, &input).window {
            channel.publish(&mut state, learner.update(&mut memory, &window));
        }
    }
    let share = p.compressibility * load / p.piston_area * frequency / table.flow(0.05);
    assert!(share > 0.05, "the oil does not count: {share}");
    let found = state.calibration();
    assert!((found.flow_gain - 1.0).abs() < 0.01 && memory.evidence.amount > 0.0, "{found:?}");
}

#[test]
fn a_known_null_offset_is_added_unless_the_force_loop_integrates() {
    for (integral_gain, realization, added) in [
        (0.0, Realization::Digital, true),
        (4.0, Realization::Digital, false),
        (4.0, Realization::Analog, true),
    ] {
        let learning = Learning { curve_correction: true, ..RIG.learning };
        let rig = Parameters { integral_gain, realization, learning, ..RIG };
        let learner = Learner::<f64, 21>::new(&rig).unwrap();
        let found = learner.calibration(&started(&learner, 0.01), 0, 0.0);
        // The force loop turns 1 V of compensation into G_p·K_s of opening.
        let expected = if added { 0.01 / (rig.proportional_gain * rig.valve_gain) } else { 0.0 };
        near("null offset", found.null_offset, 0.01, 1e-12);
        assert!((found.null_signal - expected).abs() < 1e-12, "{} V, not {expected}", found.null_signal);
    }
}

/// A saved null offset replaces a known bias, and a learner saves the whole offset.
#[test]
fn a_saved_null_offset_is_from_the_valves_own_null() {
    let learning = Learning { curve_correction: true, ..RIG.learning };
    let rig = Parameters { null_bias: 0.03, learning, ..RIG };
    let learner = Learner::<f64, 21>::new(&rig).unwrap();
    near("at rest", learner.saved(&learner.at_rest()).null_offset, 0.03, 1e-12);
    let state = started(&learner, -0.01);
    let found = learner.calibration(&state, 0, 0.0);
    near("null offset", found.null_offset, -0.01, 1e-12);
    near("null signal", found.null_signal, -0.01 / (rig.proportional_gain * rig.valve_gain), 1e-12);
    near("saved", learner.saved(&state).null_offset, -0.01, 1e-12);
    // Within a twentieth of the stroke about the known bias.
    let mut far = learner.saved(&state);
    for (offset, allowed) in [(-0.0199, true), (-0.0201, false), (0.0799, true), (0.0801, false)] {
        far.null_offset = offset;
        assert_eq!(learner.start_from(&far).is_ok(), allowed, "{offset}");
    }
}
