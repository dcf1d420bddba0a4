#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::cause::Cause;
use crate::parameters::{Levels, Parameters, PlausibilityParameters, ProtectionParameters, VelocitySource};
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, VELOCITY};
use crate::protection::plausibility::opening_offset::OpeningOffset;
use crate::protection::plausibility::{Plausibility, PlausibilityState};

/// The watch of the paper's rig with a derivative of the displacement, with round limits.
fn watch() -> Plausibility<f64, 21> {
    let rig =
        Parameters { velocity_source: VelocitySource::Derivative { corner: 80.0 }, ..Parameters::ZHAO2005 };
    let to = |trip: f64| Levels { warning: trip, trip };
    let protection = ProtectionParameters {
        force: to(20e3),
        displacement: to(0.115),
        velocity: to(1.2),
        spool: to(0.8),
        ..ProtectionParameters::DEFAULT
    };
    let mut place = None;
    Plausibility::<f64, 21>::make_in(&mut place, &rig, &protection, &PlausibilityParameters::DEFAULT)
        .unwrap();
    let reversal = ReversalWatch { slow: 0.05, drift: 0.01, limit: 1e-3 };
    Plausibility { period: 1e-3, reversal, ..place.unwrap() }
}

/// A velocity (m/s) by the displacement, and those by the flows of valve and oil, 0.9 s after the start. The spool
/// follows its command.
fn moving(velocity: f64, valve: f64, oil: f64) -> PlausibilityState<f64> {
    let mut state = PlausibilityState { opening_offset: known_for(0.9), ..PlausibilityState::default() };
    (state.flow_velocity.valve, state.flow_velocity.oil) = (valve, oil);
    state.derivative.first = velocity;
    state.stroke.opening = 0.1;
    state.signals[SPOOL].last = 0.2;
    state
}

/// A null bias of zero that is known from some time (s).
fn known_for(time: f64) -> OpeningOffset<f64> {
    let mut opening_offset = OpeningOffset::default();
    if time > 0.0 {
        opening_offset.add(0.0, 0.0, time);
    }
    opening_offset
}

/// The ticks until the displacement is found to have the wrong sign, at most a thousand.
fn ticks(state: &mut PlausibilityState<f64>, large_error: bool, tripped: bool) -> Option<u32> {
    ticks_of(Cause::DisplacementImplausible, state, large_error, tripped)
}

/// The same of a cause.
fn ticks_of(
    cause: Cause,
    state: &mut PlausibilityState<f64>,
    large_error: bool,
    tripped: bool,
) -> Option<u32> {
    (1..=1000).find(|_| watch().wrong_sign_cause(state, large_error, tripped) == cause)
}

#[test]
fn a_tick_adds_the_path_that_each_wrong_sign_explains_better() {
    // Below 0.05 m/s by the flows the weight is smaller.
    for (velocity, valve, oil, large_error, displacement, force) in [
        (-0.2, 0.3, 0.02, false, 0.2 - (0.6 * 0.2 * 0.02 / 0.28 + 0.01), 0.0),
        (-0.2, 0.3, 0.02, true, 0.2 - (0.25 * 0.2 * 0.02 / 0.28 + 0.0004), 0.0),
        (0.2, -0.3, -0.02, true, 0.2 - (0.25 * 0.2 * 0.02 / 0.28 + 0.0004), 0.0),
        (-0.02, 0.03, 0.01, true, 0.4 * 0.02 - (0.25 * 0.4 * 0.01 + 0.0004), 0.0),
        (0.3, 0.1, 0.2, true, 0.3 - (0.25 * 0.3 * 2.0 + 0.0004), 0.4 - (0.25 * 0.3 * 2.0 + 0.0004)),
        (0.5, 0.1, 0.1, false, 0.0, 0.4 * 2.0 - (0.6 * 0.5 * 2.0 + 0.01)),
    ] {
        let mut state = moving(velocity, valve, oil);
        watch().wrong_sign_cause(&mut state, large_error, false);
        let expected = [displacement, force].map(|gain: f64| 1e-3 * gain.max(0.0));
        let found = [state.reversal.motion, state.reversal.force];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{velocity} {valve} {oil}: {found} {expected}");
        }
    }
}

#[test]
fn a_velocity_against_the_flows_is_of_the_displacement() {
    // 0.2 − 0.01 m/s, and 1 mm.
    assert_eq!(ticks(&mut moving(-0.2, 0.3, 0.0), false, false), Some(6));
    assert_eq!(ticks(&mut moving(0.2, -0.3, 0.0), false, false), Some(6));
    // After a trip half of the path is enough, and less counts against it.
    assert_eq!(ticks(&mut moving(-0.2, 0.3, 0.0), false, true), Some(3));
    // A null bias moves a piston that seems to move slowly against the flow.
    assert_eq!(ticks(&mut moving(-0.025, 0.02, 0.0), false, false), None);
    assert_eq!(ticks(&mut moving(-0.025, 0.02, 0.0), true, false), Some(105));
    assert_eq!(ticks(&mut moving(0.2, 0.3, 0.0), true, true), None);
    // At the start the null bias is not known, and after 0.03 s half of it is.
    for (time, found) in [(0.0, None), (0.03, Some(134)), (0.4, Some(105)), (4.0, Some(105))] {
        let mut state = PlausibilityState { opening_offset: known_for(time), ..moving(-0.025, 0.02, 0.0) };
        assert_eq!(ticks(&mut state, true, false), found, "{time}");
    }
}

#[test]
fn what_a_force_or_a_spool_of_wrong_sign_explains_is_not_of_the_displacement() {
    // With the oil's flow reversed the balance is exact.
    assert_eq!(ticks(&mut moving(0.2, 0.05, 0.15), true, false), None);
    let changes: [fn(&mut PlausibilityState<f64>); 6] = [
        |state| state.signals[SPOOL].last = -0.2,
        |state| state.stroke.opening = -0.1,
        |state| state.signals[SPOOL].repeats = 1000,
        |state| state.distrusted[0] = true,
        |state| state.distrusted[1] = true,
        |state| state.distrusted[3] = true,
    ];
    for change in changes {
        let mut state = moving(-0.2, 0.3, 0.0);
        change(&mut state);
        assert_eq!(ticks(&mut state, true, true), None, "{state:?}");
    }
    // A tenth of the limit of a motion against the command is enough, and such ticks do not count later.
    for (share, sum) in [(0.09, 1.996e-4), (0.11, 0.0)] {
        let mut state = moving(-0.2, 0.3, 0.0);
        state.stroke.against.above = share * watch().stroke.against;
        watch().wrong_sign_cause(&mut state, true, true);
        assert!((state.reversal.motion - sum).abs() < 1e-12, "{share}");
    }
    // Either side of the null.
    for (null_bias, follows) in [(0.05, true), (0.15, false), (0.25, true), (-0.15, true)] {
        let mut state = moving(-0.2, 0.3, 0.0);
        let biased = Plausibility { null_bias, ..watch() };
        assert_eq!(
            (0..1000).any(|_| biased.wrong_sign_cause(&mut state, true, true) != Cause::None),
            follows,
            "{null_bias}"
        );
    }
}

#[test]
fn after_the_displacement_has_failed_a_sensor_of_the_velocity_shows_the_motion() {
    use Cause::{ForceImplausible as Force, VelocityImplausible as Velocity};
    let with_sensor = Plausibility { senses_velocity: true, ..watch() };
    let cause = |distrusted: [bool; 4], frozen: bool, [velocity, valve, oil]: [f64; 3]| {
        let mut state = PlausibilityState { distrusted, ..moving(0.0, valve, oil) };
        (state.filtered_velocity, state.signals[VELOCITY].repeats) =
            ([velocity, 0.0], if frozen { 1000 } else { 0 });
        let found = (1..=1000).map(|tick| (tick, with_sensor.wrong_sign_cause(&mut state, true, false)));
        found.into_iter().find(|(_, cause)| *cause != Cause::None)
    };
    let (only_velocity, of_velocity, of_force) =
        ([false, true, false, false], [-0.2, 0.3, 0.0], [0.2, 0.05, 0.15]);
    assert_eq!(cause(only_velocity, false, of_velocity), Some((6, Velocity)));
    assert_eq!(cause(only_velocity, false, of_force), Some((7, Force)));
    // The oil's flow explains all that a frozen velocity does not show.
    assert_eq!(cause(only_velocity, true, of_force), None);
    assert_eq!(cause(only_velocity, false, [0.2, 0.3, 0.1]), None);
    for distrusted in [[false; 4], [false, false, true, false], [false, true, true, false]] {
        assert_eq!(cause(distrusted, false, of_velocity), None, "{distrusted:?}");
        assert_eq!(cause(distrusted, false, of_force), None, "{distrusted:?}");
    }
}

#[test]
fn a_flow_of_the_oil_against_the_motion_is_of_the_force_unless_the_displacement_is_frozen() {
    for (large_error, tripped, found) in
        [(false, false, Some(29)), (true, false, Some(7)), (true, true, Some(4))]
    {
        for sign in [1.0, -1.0] {
            let mut state = moving(sign * 0.2, sign * 0.05, sign * 0.15);
            (state.signals[SPOOL].last, state.stroke.opening) = (sign * 0.2, sign * 0.1);
            assert_eq!(ticks_of(Cause::ForceImplausible, &mut state, large_error, tripped), found, "{sign}");
        }
    }
    let mut frozen = moving(0.2, 0.05, 0.15);
    frozen.signals[DISPLACEMENT].repeats = 1000;
    assert_eq!(ticks_of(Cause::ForceImplausible, &mut frozen, true, true), None);
}

#[test]
fn the_next_force_is_accepted_after_a_displacement_of_wrong_sign_made_it_jump() {
    for (jumped, accepted) in [(true, (0, false)), (false, (7, true))] {
        let mut state = moving(-0.2, 0.3, 0.0);
        let force = &mut state.signals[FORCE];
        (force.lost, force.jumped, force.has_reading) = (7, jumped, true);
        assert_eq!(ticks(&mut state, false, false), Some(6));
        let force = &state.signals[FORCE];
        assert_eq!((force.lost, force.has_reading), accepted);
    }
}

#[test]
fn a_sum_stays_within_a_thousand_limits() {
    let mut state = moving(0.2, 0.3, 0.0);
    state.reversal.motion = 0.1;
    watch().wrong_sign_cause(&mut state, false, false);
    assert!((state.reversal.motion - (0.1 - 1e-3 * 0.21)).abs() < 1e-15);
    (state.derivative.first, state.reversal.motion) = (-2e3, 0.5);
    watch().wrong_sign_cause(&mut state, false, false);
    assert!((state.reversal.motion - 1.0).abs() < 1e-15);
}
