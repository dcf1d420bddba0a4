//! The sensor that is named, for sums and counts that are set by hand.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::protection::plausibility::tests::watch;

/// A state whose sums have these shares of their limits.
fn sums(shares: &[(usize, f64)]) -> PlausibilityState<f64> {
    let mut state = PlausibilityState::default();
    for (n, share) in shares {
        state.sums[*n].above = share * watch().limit[*n];
    }
    state
}

/// The same where a signal repeats itself.
fn frozen(signal: usize, shares: &[(usize, f64)]) -> PlausibilityState<f64> {
    let mut state = sums(shares);
    state.signals[signal].repeats = watch().repeats;
    state
}

#[test]
fn each_sum_beyond_its_limit_names_its_sensor() {
    let named = |state: &PlausibilityState<f64>| watch().contradiction(state, 1.0);
    let all = [(BALANCE, 0.99), (FAST, 0.99), (TRAVEL, 0.99), (STROKE, 0.99), (TURNED, 0.99), (RATIO, 0.99)];
    assert_eq!(named(&sums(&all)), Cause::None);
    for (shares, cause) in [
        (&[(FAST, 1.01)][..], Cause::ForceImplausible),
        (&[(TURNED, 1.01)], Cause::ForceImplausible),
        (&[(FAST, 1.01), (TRAVEL, 0.29)], Cause::ForceImplausible),
        (&[(FAST, 1.01), (TRAVEL, 0.31)], Cause::DisplacementImplausible),
        (&[(BALANCE, 1.01)], Cause::FlowImplausible),
        (&[(BALANCE, 1.01), (TRAVEL, 0.29)], Cause::FlowImplausible),
        (&[(BALANCE, 1.01), (TRAVEL, 0.31)], Cause::DisplacementImplausible),
        (&[(BALANCE, 1.01), (STROKE, 0.04)], Cause::FlowImplausible),
        (&[(BALANCE, 1.01), (STROKE, 0.06)], Cause::SpoolImplausible),
        (&[(STROKE, 1.01)], Cause::ValveImplausible),
        (&[(STROKE, 1.01), (BALANCE, 0.09)], Cause::ValveImplausible),
        (&[(STROKE, 1.01), (BALANCE, 0.11)], Cause::SpoolImplausible),
        (&[(TRAVEL, 1.01), (FAST, 1.01), (BALANCE, 1.01)], Cause::DisplacementImplausible),
        (&[(RATIO, 1.01), (FAST, 1.01), (BALANCE, 1.01)], Cause::VelocityImplausible),
    ] {
        assert_eq!(named(&sums(shares)), cause, "{shares:?}");
    }
    // A signal that repeats is named before one that only contradicts.
    assert_eq!(named(&frozen(SPOOL, &[(FAST, 1.01)])), Cause::SpoolImplausible);
    assert_eq!(named(&frozen(VELOCITY, &[(FAST, 1.01)])), Cause::VelocityImplausible);
    assert_eq!(named(&frozen(SPOOL, &[(BALANCE, 1.01)])), Cause::SpoolImplausible);
    let mut state = frozen(SPOOL, &[(FAST, 1.01)]);
    state.signals[SPOOL].repeats -= 1;
    assert_eq!(named(&state), Cause::ForceImplausible);
}

#[test]
fn of_velocity_and_displacement_the_one_that_fits_the_flow_worse_is_named() {
    let named = |worse: f64, mut state: PlausibilityState<f64>| {
        (state.worse, state.evidence.worse) = (worse, worse);
        watch().contradiction(&state, 1.0)
    };
    let travelled = [(TRAVEL, 1.01)];
    assert_eq!(named(1e-9, sums(&travelled)), Cause::VelocityImplausible);
    assert_eq!(named(-1e-9, sums(&travelled)), Cause::DisplacementImplausible);
    assert_eq!(named(1e-9, frozen(DISPLACEMENT, &travelled)), Cause::DisplacementImplausible);
    assert_eq!(named(-1e-9, frozen(VELOCITY, &travelled)), Cause::VelocityImplausible);
    // For a ratio the larger one is named, unless the displacement fits worse by a quarter of the square of 0.4 m/s.
    let mut state = sums(&[(RATIO, 1.01)]);
    state.envelopes[4] = 0.4;
    let clearly = 0.25 * 8.212e-3 * 0.16;
    assert_eq!(named(-0.99 * clearly, state), Cause::VelocityImplausible);
    assert_eq!(named(-1.01 * clearly, state), Cause::DisplacementImplausible);
    let ratio = &mut state.sums[RATIO];
    (ratio.above, ratio.below) = (0.0, ratio.above);
    assert_eq!(named(1.0, state), Cause::DisplacementImplausible);
    // A difference that a delay may cause does not count.
    let mut late = sums(&travelled);
    late.began[0].above = 0.02 * watch().limit[TRAVEL] / watch().late;
    assert_eq!(named(1.0, late), Cause::None);
}

#[test]
fn far_from_its_command_half_is_enough_but_not_of_the_slow_sums() {
    for n in [FAST, TURNED, TRAVEL, RATIO] {
        assert_eq!(watch().contradiction(&sums(&[(n, 0.49)]), 0.5), Cause::None, "{n}");
        assert_ne!(watch().contradiction(&sums(&[(n, 0.51)]), 0.5), Cause::None, "{n}");
    }
    for n in [BALANCE, STROKE, AGAINST] {
        assert_eq!(watch().contradiction(&sums(&[(n, 0.99)]), 0.5), Cause::None, "{n}");
    }
}

#[test]
fn a_signal_that_stays_lost_is_named_once() {
    let lost_samples = watch().lost_samples;
    let causes = [
        (FORCE, Cause::ForceLost, Cause::ForceImplausible),
        (VELOCITY, Cause::VelocityLost, Cause::VelocityImplausible),
        (SPOOL, Cause::SpoolLost, Cause::SpoolImplausible),
        (DISPLACEMENT, Cause::DisplacementLost, Cause::DisplacementImplausible),
    ];
    for (signal, lost, implausible) in causes {
        let mut state = PlausibilityState::<f64>::default();
        state.signals[signal].lost = lost_samples;
        assert_eq!(watch().lost(&state), Cause::None);
        state.signals[signal].lost += 1;
        assert_eq!(watch().lost(&state), lost);
        state.signals[signal].jumped = true;
        assert_eq!(watch().lost(&state), implausible);
        let estimated = Plausibility { senses_velocity: false, ..watch() };
        let expected = if signal == VELOCITY { Cause::None } else { implausible };
        assert_eq!(estimated.lost(&state), expected);
        state.distrust(implausible);
        assert_eq!(state.distrusted().iter().filter(|distrusted| **distrusted).count(), 1);
        assert!(state.distrusted()[signal]);
        assert_eq!(watch().lost(&state), Cause::None);
    }
}

#[test]
fn what_repeats_itself_while_it_should_have_moved_is_stuck() {
    // Twelve repetitions; 1180 N of command, 0.635 mm of displacement.
    let stuck = |repeats: u32, command: f64, displacement: f64, velocity: f64, senses_velocity: bool| {
        let watch = Plausibility { senses_velocity, ..watch() };
        let mut state = PlausibilityState::default();
        let at = |displacement: f64| Input { displacement, ..Input::default() };
        assert_eq!(watch.stuck(&mut state, &at(0.03), velocity, 500.0), Cause::None);
        (state.signals[FORCE].repeats, state.signals[VELOCITY].repeats) = (repeats, repeats);
        watch.stuck(&mut state, &at(0.03 + displacement), velocity, 500.0 + command)
    };
    for side in [1.0, -1.0] {
        assert_eq!(stuck(12, side * 1170.0, side * 6.3e-4, 0.0, true), Cause::None);
        assert_eq!(stuck(11, side * 1190.0, side * 6.4e-4, 0.0, true), Cause::None);
        assert_eq!(stuck(12, side * 1190.0, 0.0, 0.0, true), Cause::ForceImplausible);
        assert_eq!(stuck(12, 0.0, side * 6.4e-4, 0.0, true), Cause::VelocityImplausible);
        assert_eq!(stuck(12, 0.0, side * 6.4e-4, 0.0, false), Cause::None);
        // A constant velocity that is correct: 0.59 mm in twelve samples.
        assert_eq!(stuck(12, 0.0, side * 6.4e-4, side * 0.2, true), Cause::None);
        assert_eq!(stuck(12, 0.0, side * -1e-4, side * 0.2, true), Cause::VelocityImplausible);
    }
}
