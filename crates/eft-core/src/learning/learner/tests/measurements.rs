//! What an update makes of a window's sums.

use super::*;
use crate::learning::guard::GuardState;

/// A load of three quarters of the supply pressure, which halves the flow forwards.
const LOADED: Means =
    Means { velocity: 3.0, force: 0.75 * MOST_FORCE, spool: 0.25, valve_command: 1.0, command: 512.0 };

#[test]
fn means_and_changes_are_those_of_the_ticks() {
    let learner = learner(false);
    let mut given = window(0, LOADED);
    (given.start.force, given.end.force) = (100.0, 164.0);
    (given.start.command, given.end.command) = (10.0, 42.0);
    let means = learner.means(&given, 1.0);
    near("velocity", means.velocity, 3.0);
    near("force", means.force, 1536.0);
    near("spool", means.spool, 0.25);
    near("valve command", means.valve_command, 1.0);
    near("command", means.command, 512.0);
    near("change of the command", means.command_change, 32.0);
    near("flow by the force", means.compressed, LEAK * 1536.0 + VOLUME * 64.0);
}

/// A number of a window.
type Signal = fn(&mut Window<f64>) -> &mut f64;

/// What a learner makes of a second window with changed sums.
fn second(change: impl Fn(&mut Window<f64>)) -> LearnerState<f64> {
    let (learner, mut state) = (learner(false), after(&learner(false), &[LOADED]));
    let mut given = window(1, LOADED);
    change(&mut given);
    learner.update(&mut state, &given);
    state
}

#[test]
fn a_window_with_a_sample_that_no_rig_can_reach_is_lost() {
    let lost = second(|w| w.lost = 1);
    assert!(!lost.filtered && second(|_| ()).filtered);
    // The distance of each sum from the largest one, with those of the other signals of its kind.
    let flow = 8.0 * (GREATEST + LEAK * MOST_FORCE) - 2.0 * LOADED.velocity - LEAK * LOADED.force;
    let force = 8.0 * MOST_FORCE - LOADED.force - LOADED.command;
    let opening = 8.0 - LOADED.spool - 0.5 * LOADED.valve_command;
    let changes: [(&str, f64, Signal); 7] = [
        ("velocity", TICKS * flow / 2.0, |w| &mut w.sums.velocity),
        ("change of the force", flow / VOLUME, |w| &mut w.end.force),
        ("force", TICKS * force, |w| &mut w.sums.force),
        ("command", TICKS * force, |w| &mut w.sums.command),
        ("change of the command", force, |w| &mut w.end.command),
        ("spool", TICKS * opening, |w| &mut w.sums.spool),
        ("valve command", TICKS * opening / 0.5, |w| &mut w.sums.valve_command),
    ];
    for (what, distance, signal) in changes {
        assert!(second(|w| *signal(w) += (1.0 - 1e-12) * distance).filtered, "{what}");
        for wrong in [(1.0 + 1e-12) * distance, -1e12, f64::INFINITY, f64::NAN] {
            assert_eq!(second(|w| *signal(w) += wrong), lost, "{what} {wrong}");
        }
    }
}

#[test]
fn a_lost_valve_command_is_the_one_for_the_measured_opening() {
    let learner = learner(false);
    let mut given = window(0, LOADED);
    // Half of the ticks without a command, at an opening of 0.25 by a valve of 0.5 per volt and a gain of 1.25.
    (given.sums.valve_command, given.sums.spool_without_command) = (8.0 * 0.4, 8.0 * 0.25);
    near("valve command", learner.means(&given, 1.25).valve_command, 0.4);
}

#[test]
fn the_filters_pass_openings_and_flows() {
    let (learner, mut state) = (learner(false), learner(false).at_rest());
    let mut given = window(0, LOADED);
    (given.start.force, given.end.force) = (1536.0, 1568.0);
    learner.update(&mut state, &given);
    near("commanded opening", state.filters.asked.input(), 0.5);
    near("measured opening", state.filters.spool.input(), 0.25);
    // Half of the table's flow by the load, Eq. (6).
    near("table's flow", state.filters.predicted.input(), 0.5 * 0.25 * GREATEST);
    // The actuator's flow, Eq. (7).
    near("actuator's flow", state.filters.flow.input(), 2.0 * 3.0 + LEAK * 1536.0 + VOLUME * 32.0);
}

#[test]
fn the_load_counts_in_the_direction_of_the_commanded_opening() {
    for (valve_command, radicand) in [(1.0, 0.25), (-1.0, 1.75), (0.0, 1.0)] {
        let state = after(&learner(false), &[Means { valve_command, ..LOADED }]);
        near("table's flow", state.filters.predicted.input(), libm::sqrt(radicand) * 0.25 * GREATEST);
    }
}

/// After one update of a learner that knows a null offset (1), the offset of the spool's sensor (1), and the spool's gain.
fn knowing([null, sensor, gain]: [f64; 3], means: Means) -> LearnerState<f64> {
    let (learner, mut state) = (learner(true), learner(true).at_rest());
    (state.evidence.curve.null, state.evidence.curve.sensor) = (null, sensor);
    state.valve.found.gain.value = gain;
    learner.update(&mut state, &window(0, means));
    state
}

#[test]
fn openings_are_relative_to_the_valves_null_and_without_the_sensors_offset() {
    let state = knowing([0.0625, 0.03125, 1.25], LOADED);
    let measured = 0.25 - 0.03125 - 1.25 * 0.0625;
    // A new null offset does not change the flow: the configured flow gain gives back what the offsets take.
    let constant = GREATEST * (0.25 - measured);
    near("table's flow", state.filters.predicted.input(), 0.5 * GREATEST * measured + constant);
    near("table's flow at no load", state.flows[1], GREATEST * measured);
    near("actuator's flow at no load", state.flows[0], (2.0 * 3.0 + LEAK * 1536.0) / 0.5);
}

#[test]
fn a_command_below_the_null_offset_opens_backwards() {
    let load = Means { valve_command: 0.0625, ..LOADED };
    let state = knowing([0.0625, 0.0, 1.0], load);
    let root = libm::sqrt(1.75);
    let measured = 0.25 - 0.0625;
    near("table's flow", state.filters.predicted.input(), root * GREATEST * measured + GREATEST * 0.0625);
}

#[test]
fn the_correction_acts_on_the_flow_at_no_load_over_the_flow_gain() {
    let (learner, mut state) = (learner(true), learner(true).at_rest());
    // An asymmetry of 5 %, and a departure of a tenth of a step at the third node. A step is 8/7 m³/s.
    let step = GREATEST / 7.0;
    (state.evidence.curve.asymmetry, state.evidence.curve.departures[11]) = (0.05, 0.1);
    state.flow.gain.value = 1.25;
    let at_no_load = 3.0 * step;
    let velocity = (at_no_load * 1.25 * 0.5 - LEAK * 1536.0) / 2.0;
    learner.update(&mut state, &window(0, Means { velocity, ..LOADED }));
    let corrected = at_no_load * 1.05 + 0.1 * step;
    let found = state.filters.flow.input();
    assert!((found - corrected * 1.25 * 0.5).abs() < 1e-9, "{found}");
}

#[test]
fn the_sensors_offset_is_what_the_gain_does_not_explain() {
    let state = knowing([0.0625, 0.03125, 1.25], LOADED);
    near("offset", state.evidence.curve.sensor, 0.25 - 1.25 * 0.5);
}

#[test]
fn the_correction_learns_from_flows_at_no_load() {
    let (learner, mut state) = (learner(true), learner(true).at_rest());
    let curve = &mut state.evidence.curve;
    (curve.null, curve.sensor, curve.asymmetry) = (0.0625, 0.03125, 0.05);
    (state.valve.found.gain.value, state.flow.gain.value) = (1.25, 1.5);
    let (mut nodes, mut evidence) = (state.curve, state.evidence.curve);
    learner.update(&mut state, &window(0, LOADED));

    let measured = 0.25 - 0.03125 - 0.078125;
    let measured_flow = (2.0 * 3.0 + LEAK * 1536.0) / 0.5 / 1.5;
    // The instrument is the table's flow at the commanded opening, behind the spool's gain and the null offset.
    let ahead = 1.25 * (0.5 - 0.0625) - measured;
    let passed = [GREATEST * measured, 1.25 * GREATEST];
    let sample = learner.curve.sample(&evidence, measured_flow, passed, [ahead, 0.25 - 1.25 * 0.5]);
    learner.curve.learn(&mut nodes, &mut evidence, &sample, 1.5, 1.0);
    learner.curve.refresh(&mut nodes, &evidence);
    assert_eq!((state.curve, state.evidence.curve), (nodes, evidence));
}

/// A guard with a share of one half in each of its averages.
fn guarded(feedforward: bool) -> Learner<f64, 3> {
    let learning = Learning { guard: true, ..Learning::OFF };
    let mut learner = Learner::<f64, 3>::new(&Parameters { feedforward, learning, ..RIG }).unwrap();
    let guard = &mut learner.guard;
    (guard.low_pass, guard.average, guard.slow_average, guard.force_per_flow) = (0.5, 0.5, 0.5, 4.0);
    learner
}

#[test]
fn the_guard_sees_the_force_error_and_the_flow_that_was_not_demanded() {
    for (feedforward, fed) in [(false, 0.0), (true, 1.0)] {
        let (learner, mut state) = (guarded(feedforward), guarded(feedforward).at_rest());
        let mut given = window(0, Means::default());
        // The first window is a restart, which the guard does not see.
        learner.update(&mut state, &given);
        assert_eq!(state.guard, GuardState::default());
        given = window(1, LOADED);
        (given.start.force, given.end.force) = (1536.0, 1568.0);
        (given.start.command, given.end.command) = (512.0, 520.0);
        learner.update(&mut state, &given);
        let mut expected = GuardState::default();
        let compressed = LEAK * 1536.0 + VOLUME * 32.0;
        let demanded = LEAK * 512.0 + VOLUME * 8.0;
        learner.guard.observe(&mut expected, 1536.0 - 512.0, compressed - fed * demanded, 3.0);
        learner.guard.act(&mut expected);
        // The second window is half of the mean.
        learner.guard.follow_offset(&mut expected, 0.5);
        assert_eq!(state.guard, expected);
    }
}

#[test]
fn without_a_guard_the_level_is_full_and_nothing_is_observed() {
    let state = after(&learner(false), &[Means::default(), LOADED, LOADED]);
    assert_eq!(state.guard, GuardState::default());
}
