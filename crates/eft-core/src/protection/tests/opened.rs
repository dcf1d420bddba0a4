//! After the force loop has opened: following the specimen, and closing the valve.

use super::*;

#[test]
fn after_the_force_loop_opens_the_compensation_fades_in_the_last_two_thirds_of_the_time() {
    let watch = PlausibilityParameters { settle_time: 0.03, ..PlausibilityParameters::DEFAULT };
    let parameters = ProtectionParameters { plausibility: Some(watch), ..ProtectionParameters::DEFAULT };
    let (p, mut state) = (Protection::<f64>::new(&parameters, 1000.0).unwrap(), ProtectionState::default());
    state.shut_down_by(Cause::ForceLost);
    for n in 1..=30 {
        let out = p.step(&mut state, &input(50.0, 0.0, 0.0, 0.0, 0.0));
        let expected = 0.93 * (1.5 * (1.0 - f64::from(n) / 30.0)).min(1.0);
        assert!((out.level - expected).abs() < 1e-6, "sample {n}: {}, not {expected}", out.level);
    }
}

#[test]
fn the_valve_closes_after_the_time_of_following_the_specimen() {
    let (p, mut state) = (settling(), ProtectionState::default());
    p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
    state.shut_down_by(Cause::ForceOscillation);
    for n in 1..=1200_u32 {
        let out = p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        let closed = (1e-2 * (f64::from(n) - 999.0)).clamp(0.0, 1.0);
        assert!((out.authority - (1.0 - closed)).abs() < 1e-6, "{n}: {}", out.authority);
        assert!(out.open);
    }
}

#[test]
fn without_a_velocity_the_valve_closes_at_once() {
    let (p, mut state) = (settling(), ProtectionState::default());
    state.shut_down_by(Cause::VelocityLost);
    state.motion_unknown = true;
    for n in 1..=150_u32 {
        let out = p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        let left = (1.0 - 1e-2 * f64::from(n)).max(0.0);
        assert!((out.authority - left).abs() < 1e-6, "{n}: {}", out.authority);
        assert!((p.authority(&state) - left).abs() < 1e-6);
    }
}

#[test]
fn a_trip_under_a_watch_reduces_the_velocitys_compensation() {
    let (p, mut state) = (settling(), ProtectionState::default());
    assert_eq!(p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0)).level, 1.0);
    state.trip_by(Cause::Request);
    let out = p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
    assert_eq!((out.level, out.authority, out.open), (0.95, 1.0, false));
    // Without a watch nothing is reduced.
    let (p, mut state) = (protection(), ProtectionState::default());
    state.trip_by(Cause::Request);
    assert_eq!(p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0)).level, 1.0);
}

#[test]
fn a_force_beyond_its_level_opens_the_loop_only_if_it_left_its_command() {
    let watch = PlausibilityParameters { settle_time: 1.0, ..PlausibilityParameters::DEFAULT };
    let parameters = ProtectionParameters {
        force: Levels { warning: 80.0, trip: 100.0 },
        start_time: 0.01,
        plausibility: Some(watch),
        ..ProtectionParameters::DEFAULT
    };
    let p = Protection::<f64>::new(&parameters, 1000.0).unwrap();
    // A quarter of the trip level. The start of ten samples has followed six tenths of the command before the trip.
    for (samples, command, force, opens) in [
        (30, 77.0, 101.0, false),
        (30, 75.0, 101.0, true),
        (30, -75.0, -101.0, true),
        (30, 120.0, 101.0, false),
        (6, 128.0, 101.0, false),
        (6, 125.0, 101.0, true),
        (6, 77.0, 101.0, true),
    ] {
        let mut state = ProtectionState::default();
        for _ in 0..samples {
            p.step(&mut state, &input(command, 0.0, 0.0, 0.0, 0.0));
        }
        let out = p.step(&mut state, &input(command, force, 0.0, 0.0, 0.0));
        assert_eq!(out.open, opens, "{samples} {command} {force}");
        assert_eq!((state.is_tripped(), state.cause()), (true, Cause::ForceLevel));
    }
}
