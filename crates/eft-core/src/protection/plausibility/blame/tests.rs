//! Which sensor the watch blames for which sums, repetitions and lost readings.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use super::*;
use crate::protection::plausibility::reversal::SignSums;
use crate::protection::plausibility::sums::{Cusum, CusumStart};
use crate::protection::plausibility::tests::{
    self, AGAINST, BALANCE, FAST, RATIO, STROKE, TRAVEL, TURNED, limits, sums,
};

/// Twelve repetitions are stuck, and more than three lost readings are lost. Each limit is 1.
fn watch() -> Plausibility<f64, 21> {
    let mut watch = Plausibility {
        repeats: 12,
        lost_samples: 3,
        period: 1e-3,
        area: 2.0,
        changes: [100.0, 0.01],
        ..tests::watch()
    };
    limits(&mut watch).into_iter().for_each(|limit| *limit = 1.0);
    watch
}

/// A state with these sums, in the order of the residuals, and these sensors frozen.
fn with(sizes: &[(usize, f64)], frozen: &[usize]) -> PlausibilityState<f64> {
    let mut state = PlausibilityState::default();
    for (of, size) in sizes {
        sums(&mut state)[*of].above = *size;
    }
    for sensor in frozen {
        state.signals[*sensor].repeats = 12;
    }
    state
}

/// Sums, frozen sensors, and the cause.
type Case<'a> = (&'a [(usize, f64)], &'a [usize], Cause);

#[test]
fn the_sums_name_the_sensor() {
    use Cause::{
        DisplacementImplausible as Displacement, FlowImplausible as Flow, ForceImplausible as Force,
        SpoolImplausible as Spool, ValveImplausible as Valve, VelocityImplausible as Velocity,
    };
    let cases: [Case; 31] = [
        (&[], &[], Cause::None),
        (&[(BALANCE, 1.0), (FAST, 1.0), (TRAVEL, 1.0)], &[], Cause::None),
        (&[(STROKE, 1.0), (TURNED, 1.0), (RATIO, 1.0)], &[], Cause::None),
        // Velocity and displacement, with the flow in favour of neither.
        (&[(TRAVEL, 1.01)], &[], Displacement),
        (&[(TRAVEL, 1.01)], &[VELOCITY], Velocity),
        (&[(TRAVEL, 1.01)], &[DISPLACEMENT], Displacement),
        (&[(TRAVEL, 1.01)], &[VELOCITY, DISPLACEMENT], Velocity),
        (&[(RATIO, 1.01)], &[], Velocity),
        // Above the motion's frequencies.
        (&[(TURNED, 1.01)], &[], Force),
        (&[(FAST, 1.01)], &[], Force),
        (&[(FAST, 1.01)], &[SPOOL], Spool),
        (&[(TURNED, 1.01)], &[SPOOL], Spool),
        (&[(AGAINST, 1.01), (TURNED, 1.01), (FAST, 1.01)], &[], Spool),
        (&[(RATIO, 1.01), (AGAINST, 1.01)], &[], Velocity),
        (&[(FAST, 1.01), (TRAVEL, 0.3)], &[], Force),
        // A displacement that moves changes no flow.
        (&[(FAST, 1.01), (TRAVEL, 0.31)], &[], Force),
        (&[(TURNED, 1.01), (TRAVEL, 0.31)], &[], Force),
        (&[(FAST, 1.01), (TRAVEL, 0.31)], &[DISPLACEMENT], Displacement),
        (&[(FAST, 1.01)], &[VELOCITY], Velocity),
        // Below them.
        (&[(BALANCE, 1.01)], &[], Flow),
        (&[(BALANCE, 1.01), (TRAVEL, 0.3)], &[], Flow),
        (&[(BALANCE, 1.01), (TRAVEL, 0.31)], &[], Displacement),
        (&[(BALANCE, 1.01), (STROKE, 0.05)], &[], Flow),
        (&[(BALANCE, 1.01), (STROKE, 0.06)], &[], Spool),
        (&[(BALANCE, 1.01)], &[SPOOL], Spool),
        (&[(STROKE, 1.01)], &[], Valve),
        (&[(STROKE, 1.01), (BALANCE, 0.1)], &[], Valve),
        (&[(STROKE, 1.01), (BALANCE, 0.11)], &[], Spool),
        // In this order.
        (&[(TRAVEL, 1.01), (RATIO, 1.01), (FAST, 1.01)], &[VELOCITY], Velocity),
        (&[(RATIO, 1.01), (TURNED, 1.01), (BALANCE, 1.01)], &[], Velocity),
        (&[(FAST, 1.01), (BALANCE, 1.01), (STROKE, 1.01)], &[], Force),
    ];
    for (sums, frozen, cause) in cases {
        assert_eq!(watch().contradiction(&with(sums, frozen), 1.0), cause, "{sums:?} {frozen:?}");
    }
    // An estimated velocity contains the displacement.
    let estimates = Plausibility { senses_velocity: false, ..watch() };
    let state = with(&[(FAST, 1.01), (TRAVEL, 0.31)], &[]);
    assert_eq!(estimates.contradiction(&state, 1.0), Cause::DisplacementImplausible);
    // Eleven repetitions are not stuck.
    let mut state = with(&[(FAST, 1.01)], &[SPOOL]);
    state.signals[SPOOL].repeats = 11;
    assert_eq!(watch().contradiction(&state, 1.0), Cause::ForceImplausible);
}

#[test]
fn without_a_displacement_the_fast_flows_name_velocity_or_force() {
    use Cause::{ForceImplausible as Force, VelocityImplausible as Velocity};
    let name = |of: usize, size: f64, share: f64, [motion, force]: [f64; 2], opening: f64| {
        let mut state = with(&[(of, size)], &[]);
        state.distrust(Cause::DisplacementLost);
        (state.stroke.opening, state.signals[SPOOL].last) = (0.1, opening);
        state.reversal = SignSums { motion, force };
        watch().contradiction_by_flow(&state, share)
    };
    for (sums, cause) in [([2.0, 1.0], Velocity), ([1.0, 2.0], Force), ([1.0, 1.0], Cause::None)] {
        for of in [FAST, TURNED] {
            assert_eq!(name(of, 1.01, 1.0, sums, 0.2), cause, "{sums:?}");
            assert_eq!(name(of, 0.51, 0.5, sums, 0.2), cause, "{sums:?}");
            assert_eq!(name(of, 0.99, 1.0, sums, 0.2), Cause::None);
            // The spool is not where its command is.
            assert_eq!(name(of, 1.01, 1.0, sums, -0.2), Cause::None);
        }
        for of in [BALANCE, TRAVEL, RATIO, STROKE] {
            assert_eq!(name(of, 1.01, 1.0, sums, 0.2), Cause::None, "{of}");
        }
        for (against, cause) in [(0.99, Cause::None), (1.01, Cause::SpoolImplausible)] {
            assert_eq!(name(AGAINST, against, 1.0, sums, 0.2), cause);
        }
    }
}

#[test]
fn a_sensor_that_is_too_still_for_its_noise_is_blamed_before_its_repetitions_are_enough() {
    let watch = watch();
    // A working sensor without noise has 1, one before its first reading 0.
    for (likelihood, cause) in [
        (0.0, Cause::ForceImplausible),
        (1.0, Cause::ForceImplausible),
        (0.011, Cause::ForceImplausible),
        (0.009, Cause::SpoolImplausible),
    ] {
        for sum in [FAST, TURNED] {
            let mut state = with(&[(sum, 1.01)], &[]);
            state.signals[SPOOL].likelihood = likelihood;
            assert_eq!(watch.contradiction(&state, 1.0), cause, "{likelihood}");
        }
    }
}

#[test]
fn a_share_of_the_limits_is_enough_except_for_balance_and_stroke() {
    for (of, cause) in [
        (TRAVEL, Cause::DisplacementImplausible),
        (RATIO, Cause::VelocityImplausible),
        (TURNED, Cause::ForceImplausible),
        (FAST, Cause::ForceImplausible),
    ] {
        assert_eq!(watch().contradiction(&with(&[(of, 0.51)], &[]), 0.5), cause, "{of}");
        assert_eq!(watch().contradiction(&with(&[(of, 0.49)], &[]), 0.5), Cause::None, "{of}");
    }
    for of in [BALANCE, STROKE, AGAINST] {
        assert_eq!(watch().contradiction(&with(&[(of, 0.99)], &[]), 0.5), Cause::None, "{of}");
    }
}

#[test]
fn the_flow_decides_between_velocity_and_displacement() {
    for (misfit, cause) in [
        (-0.1, Cause::DisplacementImplausible),
        (0.0, Cause::DisplacementImplausible),
        (0.1, Cause::VelocityImplausible),
    ] {
        let mut state = with(&[(TRAVEL, 1.01)], &[]);
        state.motion.evidence.misfit = misfit;
        assert_eq!(watch().contradiction(&state, 1.0), cause, "{misfit}");
    }
    // A displacement that does not move is wrong even if the flow tells otherwise.
    let mut state = with(&[(TRAVEL, 1.01)], &[DISPLACEMENT]);
    state.motion.evidence.misfit = 0.1;
    assert_eq!(watch().contradiction(&state, 1.0), Cause::DisplacementImplausible);
}

#[test]
fn a_delay_widens_the_limits_of_motion_and_ratio_only() {
    // 0.02 s times changes of the velocity of 30 and 10 m/s, and of its size of 7 m/s. A share is that of the limit.
    for (of, share, limits) in [
        (TRAVEL, 1.0, [1.6, 1.2]),
        (TRAVEL, 0.5, [1.1, 0.7]),
        (RATIO, 1.0, [1.14, 1.1]),
        (RATIO, 0.5, [0.64, 0.6]),
        (FAST, 1.0, [1.0, 1.0]),
    ] {
        for (step, beyond) in [(-0.01, false), (0.01, true)] {
            let mut state = PlausibilityState::default();
            (state.motion.velocity, state.motion.ratio_velocity) = (-5.0, -6.0);
            state.motion.travel_start = CusumStart { above: 25.0, below: 5.0 };
            state.motion.ratio_start = CusumStart { above: 13.0, below: 1.0 };
            let mut watch = watch();
            watch.motion.latency = 0.02;
            let contradicts = |state: &_| watch.contradiction(state, share) != Cause::None;
            sums(&mut state)[of].above = limits[0] + step;
            assert_eq!(contradicts(&state), beyond, "above: {of} {share} {step}");
            *sums(&mut state)[of] = Cusum { above: 0.0, below: limits[1] + step };
            assert_eq!(contradicts(&state), beyond, "below: {of} {share} {step}");
        }
    }
    // Either side of a sum counts.
    let mut state = PlausibilityState::default();
    state.balance.fast.below = 1.01;
    assert_eq!([1.0, 1.1].map(|share| watch().contradiction(&state, share) != Cause::None), [true, false]);
}

#[test]
fn of_a_ratio_the_larger_signal_is_blamed_unless_the_flow_clearly_tells() {
    // A quarter of the area times the mean square of the speed of 4 m²/s² is 2 m⁴/s².
    for (above, below, misfit, displacement) in [
        (1.1, 0.0, 0.0, false),
        (0.0, 1.1, 0.0, true),
        (1.1, 0.0, -1.9, false),
        (1.1, 0.0, -2.1, true),
        (1.1, 0.0, 2.1, false),
        (1.1, 1.1, 0.0, false),
    ] {
        let mut state = PlausibilityState::default();
        state.motion.ratio = Cusum { above, below };
        (state.motion.misfit, state.motion.mean_square_speed, state.motion.speed_envelope) =
            (misfit, 4.0, 9.0);
        let cause = if displacement { Cause::DisplacementImplausible } else { Cause::VelocityImplausible };
        assert_eq!(watch().contradiction(&state, 1.0), cause, "{above} {below} {misfit}");
    }
}

#[test]
fn a_signal_is_lost_after_its_samples_and_only_once() {
    for (sensor, lost, jumped) in [
        (FORCE, Cause::ForceLost, Cause::ForceImplausible),
        (DISPLACEMENT, Cause::DisplacementLost, Cause::DisplacementImplausible),
        (VELOCITY, Cause::VelocityLost, Cause::VelocityImplausible),
        (SPOOL, Cause::SpoolLost, Cause::SpoolImplausible),
    ] {
        let mut state = PlausibilityState::<f64>::default();
        state.signals[sensor].lost = 3;
        assert_eq!(watch().lost_sensor(&state), Cause::None, "{sensor}");
        state.signals[sensor].lost = 4;
        assert_eq!(watch().lost_sensor(&state), lost, "{sensor}");
        state.signals[sensor].jumped = true;
        assert_eq!(watch().lost_sensor(&state), jumped, "{sensor}");
        let blind = Plausibility { senses_velocity: false, ..watch() };
        assert_eq!(blind.lost_sensor(&state), if sensor == VELOCITY { Cause::None } else { jumped });
        state.distrust(jumped);
        assert_eq!(state.distrusted, [FORCE, DISPLACEMENT, VELOCITY, SPOOL].map(|of| of == sensor));
        assert_eq!(watch().lost_sensor(&state), Cause::None, "{sensor}");
    }
}

#[test]
fn a_force_that_repeats_while_its_command_moves_is_stuck() {
    for (repeats, command, stuck) in
        [(12, 100.1, true), (12, -100.1, true), (11, 500.0, false), (12, 99.9, false), (13, 100.1, true)]
    {
        let mut state = with(&[], &[]);
        state.last_changes = [0.0; 2];
        state.signals[FORCE].repeats = repeats;
        let cause = watch().stuck_sensor(&mut state, &Input::default(), 0.0, command);
        assert_eq!(cause == Cause::ForceImplausible, stuck, "{repeats} {command}");
        assert_eq!(state.last_changes[0].to_bits(), 0);
    }
    // The command counts from the last change of the force.
    let mut state = with(&[], &[]);
    assert_eq!(watch().stuck_sensor(&mut state, &Input::default(), 0.0, 700.0), Cause::None);
    assert_eq!(state.last_changes[0].to_bits(), 700.0_f64.to_bits());
}

#[test]
fn a_velocity_that_repeats_while_the_piston_moves_differently_is_stuck() {
    // Twelve samples of 1 ms at 0.5 m/s are 6 mm.
    for (repeats, displacement, senses, stuck) in [
        (12, 0.0161, true, true),
        (12, 0.0159, true, false),
        (12, -0.0041, true, true),
        (12, -0.0039, true, false),
        (11, 0.9, true, false),
        (12, 0.0161, false, false),
    ] {
        let mut state = with(&[], &[]);
        state.signals[VELOCITY].repeats = repeats;
        let watch = Plausibility { senses_velocity: senses, ..watch() };
        let cause = watch.stuck_sensor(&mut state, &Input { displacement, ..Input::default() }, 0.5, 0.0);
        assert_eq!(cause == Cause::VelocityImplausible, stuck, "{repeats} {displacement}");
        assert_eq!(state.last_changes[1].to_bits(), 0);
    }
    // The displacement counts from the last change of the velocity.
    let mut state = with(&[], &[]);
    watch().stuck_sensor(&mut state, &Input { displacement: 0.02, ..Input::default() }, 0.5, 0.0);
    assert_eq!(state.last_changes[1].to_bits(), 0.02_f64.to_bits());
}

/// Numbers within ±1 without a pattern.
fn noise(n: u32) -> f64 {
    (f64::from(n) * f64::from(n)).sin()
}

#[test]
fn a_signal_whose_noise_has_stopped_is_stuck() {
    for (sensor, cause) in [
        (FORCE, Cause::ForceImplausible),
        (VELOCITY, Cause::VelocityImplausible),
        (SPOOL, Cause::SpoolImplausible),
        (DISPLACEMENT, Cause::DisplacementImplausible),
    ] {
        let (watch, mut state) = (watch(), with(&[], &[]));
        let mut hear = |reading: f64| {
            watch.gate.accept(&mut state.signals[sensor], f64::INFINITY, 0.1, reading);
            watch.stuck_sensor(&mut state, &Input::default(), 0.0, 0.0)
        };
        // Noise of one, then a slow line: it never repeats itself.
        for n in 0..5000_u32 {
            assert_eq!(hear(noise(n)), Cause::None, "{sensor}, {n}");
        }
        let found = (0..200_u32).find(|n| hear(1e-3 * f64::from(*n)) == cause);
        assert!(found.is_some_and(|n| (5..100).contains(&n)), "{sensor}: {found:?}");
    }
    let blind = Plausibility { senses_velocity: false, ..watch() };
    let mut state = with(&[], &[]);
    for n in 0..5200_u32 {
        let reading = if n < 5000 { noise(n) } else { 1e-3 * f64::from(n) };
        blind.gate.accept(&mut state.signals[VELOCITY], f64::INFINITY, 0.1, reading);
        assert_eq!(blind.stuck_sensor(&mut state, &Input::default(), 0.0, 0.0), Cause::None, "{n}");
    }
}
