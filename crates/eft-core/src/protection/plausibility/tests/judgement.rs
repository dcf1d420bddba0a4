//! What one tick of the watch concludes from sums, lost readings and the load pressure.

use super::*;
use crate::protection::gate::{DISPLACEMENT, FORCE, VELOCITY};
use crate::protection::plausibility::load_pressure::LoadPressureWatch;

const REST: Input<f64> = Input {
    command: 0.0,
    velocity: 0.0,
    force: 0.0,
    spool: 0.0,
    displacement: 0.0,
    acceleration: 0.0,
    supply_pressure: 0.0,
    next_command: 0.0,
    valve_command: 0.0,
    alive: 0.0,
    period: 0.0,
    load_pressure: 0.0,
};

/// A state with this share of a sum's limit.
fn with(of: usize, share: f64) -> PlausibilityState<f64> {
    let mut state = PlausibilityState::default();
    sums(&mut state)[of].above = share * *limits(&mut watch())[of];
    state
}

/// The cause after a tick of a rig at rest, but for command and force (N).
fn judged(state: &mut PlausibilityState<f64>, command: f64, force: f64) -> Cause {
    let control =
        Control { command, valve_command: 0.0, flow_gain: 1.0, valve_gain: 1.0, supply: 1.0, tripped: false };
    watch().judge(state, &Input { force, ..REST }, 0.0, &control)
}

#[test]
fn a_force_that_jumps_may_be_right_and_one_that_is_lost_not() {
    for (signal, jumped, cause, balance_blame) in [
        (FORCE, true, Cause::ForceImplausible, true),
        (FORCE, false, Cause::ForceLost, false),
        (VELOCITY, true, Cause::VelocityImplausible, false),
    ] {
        let mut state = PlausibilityState::default();
        (state.signals[signal].lost, state.signals[signal].jumped) = (watch().lost_samples + 1, jumped);
        assert_eq!((judged(&mut state, 0.0, 0.0), state.balance_blame), (cause, balance_blame), "{cause:?}");
    }
}

#[test]
fn a_doubted_velocity_is_followed_without_delay_in_the_direction_of_the_displacement() {
    let watch = watch();
    let moves = |velocity: f64, sensed: f64| {
        let mut state = PlausibilityState::default();
        (state.velocity, state.filtered_velocity) = (velocity, [0.0, 0.9 * sensed]);
        watch.agreed(&state, sensed)
    };
    // The low-passes lag behind by a tenth. A correct sensor's reading is followed, and minus that of a wrong sign.
    for (velocity, sensed, followed) in [
        (0.45, 0.5, 0.5),
        (-0.45, -0.5, -0.5),
        (0.45, -0.5, 0.5),
        (-0.45, 0.5, -0.5),
        (0.45, 0.0, 0.45),
        (0.0, 0.5, 0.0),
        (0.45, f64::NAN, 0.45),
    ] {
        let found = moves(velocity, sensed);
        assert!((found - followed).abs() < 1e-9, "{velocity} {sensed}: {found}");
    }
    // A sensor that is known to be wrong is not used.
    let mut state =
        PlausibilityState { velocity: 0.45, filtered_velocity: [0.45; 2], ..PlausibilityState::default() };
    state.distrust(Cause::VelocityImplausible);
    assert!((watch.agreed(&state, 0.5) - 0.45).abs() < 1e-12);
}

#[test]
fn a_force_that_contradicts_the_flow_may_be_right_and_a_contradicted_motion_says_nothing_of_it() {
    for (of, cause) in [(FAST, Cause::ForceImplausible), (TRAVEL, Cause::DisplacementImplausible)] {
        let mut state = with(of, 1.2);
        assert_eq!((judged(&mut state, 0.0, 0.0), state.balance_blame), (cause, of == FAST));
    }
}

#[test]
fn far_from_its_command_is_further_than_ten_deviations_and_a_part_of_the_trip_level() {
    // 10·78 N + 0.15·20 kN; half of a limit is enough then.
    for (command, force, large_error) in [
        (3781.0, 0.0, true),
        (-3781.0, 0.0, true),
        (3779.0, 0.0, false),
        (3000.0, 3000.0, false),
        (3000.0, -800.0, true),
    ] {
        let cause = if large_error { Cause::DisplacementImplausible } else { Cause::None };
        assert_eq!(judged(&mut with(TRAVEL, 0.6), command, force), cause, "{command} {force}");
    }
}

#[test]
fn only_after_a_sample_without_a_lost_or_distrusted_reading_the_motion_continues() {
    for (force, distrusted, continues) in [(0.0, false, true), (f64::NAN, false, false), (0.0, true, false)] {
        for (before, missed) in [(0, 0), (1, 2), (2, 3), (1 << 20, 1 << 20)] {
            let mut state = PlausibilityState::default();
            state.motion.ticks = before;
            state.distrusted[VELOCITY] = distrusted;
            assert_eq!(judged(&mut state, 0.0, force), Cause::None);
            assert_eq!(state.motion.ticks, if continues { 1 } else { missed }, "{force} {distrusted}");
        }
    }
}

#[test]
fn the_flows_are_compared_without_a_displacement_that_is_known_to_have_failed() {
    for (displacement, failed, compared, ticks) in
        [(0.0, false, true, 1), (f64::NAN, false, false, 2), (0.0, true, true, 1), (f64::NAN, true, true, 2)]
    {
        let mut state = PlausibilityState::default();
        (state.motion.ticks, state.distrusted[DISPLACEMENT]) = (1, failed);
        let (velocity, control) = (0.1, Control { valve_command: 0.0, ..CONTROL });
        watch().judge(&mut state, &Input { displacement, velocity, ..REST }, velocity, &control);
        let balance = &state.balance;
        assert_eq!(
            (balance.load_flow > 0.0, state.motion.ticks),
            (compared, ticks),
            "{displacement} {failed}"
        );
    }
}

#[test]
fn a_force_jumps_while_it_is_lost_to_the_gate() {
    for (lost, jumped, jumps) in [(0, true, false), (1, false, false), (1, true, true)] {
        let mut state = PlausibilityState::<f64>::default();
        (state.signals[FORCE].lost, state.signals[FORCE].jumped) = (lost, jumped);
        assert_eq!(state.force_jumped(), jumps, "{lost} {jumped}");
    }
}

/// Whether a reading this far from its prediction passes the gate of a watch, after lost samples and with a fading step
/// of the velocity (m/s). The velocity may have a sensor, and may be distrusted.
fn passes([senses, distrusts]: [bool; 2], lost: u32, step: f64, of: usize, beyond: f64) -> bool {
    let mut watch = Plausibility { senses_velocity: senses, force_jump: 10.0, ..watch() };
    (watch.gate.tolerance[FORCE], watch.gate.tolerance[DISPLACEMENT]) = (100.0, 5e-3);
    (watch.gate.displacement_tolerance, watch.gate.tolerance_growth, watch.gate.reversal_velocity) =
        (1e-3, 2e-4, 0.0);
    let distrusted = [false, false, distrusts, false];
    let mut state = PlausibilityState { distrusted, ..PlausibilityState::default() };
    state.followed.step = step;
    for signal in &mut state.signals {
        (signal.has_reading, signal.lost) = (true, lost);
    }
    let mut input = Input { force: 0.0, displacement: 0.0, velocity: 0.0, spool: 0.0, ..Input::default() };
    *(if of == FORCE { &mut input.force } else { &mut input.displacement }) = beyond;
    let out = watch.gate(&mut state, &input);
    if of == FORCE { out.force.is_finite() } else { out.displacement.is_finite() }
}

#[test]
fn the_gate_widens_with_lost_samples_and_while_the_valve_follows_another_velocity() {
    let estimated = [false, false];
    for lost in [0, 1, 2] {
        let most = 1e-3 + f64::from(lost) * 2e-4;
        for (velocity, most) in [(estimated, most), ([true, true], most), ([true, false], 5e-3)] {
            assert!(passes(velocity, lost, 0.0, DISPLACEMENT, 0.999 * most), "{velocity:?} {lost}");
            assert!(!passes(velocity, lost, 0.0, DISPLACEMENT, 1.001 * most), "{velocity:?} {lost}");
        }
    }
    for step in [0.0, 0.5, -0.5] {
        let most = 100.0 + 10.0 * f64::abs(step);
        for (beyond, pass) in [(0.999 * most, true), (1.001 * most, false)] {
            assert_eq!(passes(estimated, 0, step, FORCE, beyond), pass, "{step} {beyond}");
        }
    }
}

#[test]
fn a_load_pressure_contradicts_a_trusted_force_unless_something_else_is_wrong() {
    let pressure =
        LoadPressureWatch { area: 1.0, jump: 1e9, still: 0.0, tolerance: 10.0, latency: 0.0, limit: 1e-3 };
    let watch = Plausibility { load_pressure: Some(pressure), ..watch() };
    let compared = |force: f64, before: Cause, distrusted: bool, failed: bool| {
        let mut state = PlausibilityState::default();
        (state.distrusted[FORCE], state.load_pressure.failed) = (distrusted, failed);
        let found = (0..5_u8).map(|n| {
            let input = Input { force, load_pressure: f64::from(n), ..REST };
            watch.compare_pressure(&mut state, &input, before)
        });
        found.last().unwrap()
    };
    for (force, before, distrusted, failed, cause) in [
        (100.0, Cause::None, false, false, Cause::ForceImplausible),
        (100.0, Cause::VelocityLost, false, false, Cause::VelocityLost),
        (5.0, Cause::None, false, false, Cause::None),
        (100.0, Cause::None, true, false, Cause::None),
        (100.0, Cause::None, false, true, Cause::None),
    ] {
        let flag = if failed { status::STUCK_MEASUREMENT } else { 0 };
        assert_eq!(compared(force, before, distrusted, failed), (cause, flag), "{force} {before:?}");
    }
}
