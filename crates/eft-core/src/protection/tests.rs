//! Tests of the ramps, levels and counts.
#![allow(clippy::float_cmp, reason = "shares of a power of two are exact")]

mod opened;

use super::protection::*;
use super::state::ProtectionState;
use crate::cause::Cause;
use crate::parameters::{Levels, PlausibilityParameters, ProtectionParameters};
use crate::status;

/// A sample without alive counter and period.
fn input(command: f64, force: f64, displacement: f64, velocity: f64, spool: f64) -> ProtectionInput<f64> {
    let none = f64::NAN;
    ProtectionInput { command, force, displacement, velocity, spool, alive: none, period: none }
}

fn protection() -> Protection<f64> {
    let parameters = ProtectionParameters {
        force: Levels { warning: 80.0, trip: 100.0 },
        displacement: Levels { warning: 0.5, trip: 1.0 },
        ramp_time: 0.01,
        shutdown_time: 0.004,
        lost_samples: 3,
        fault_time: 0.005,
        ..ProtectionParameters::DEFAULT
    };
    Protection::<f64>::new(&parameters, 1000.0).unwrap()
}

/// A protection with a watch: one second of following the specimen, and a tenth of a second of closing.
fn settling() -> Protection<f64> {
    let watch = PlausibilityParameters { settle_time: 1.0, ..PlausibilityParameters::DEFAULT };
    let parameters = ProtectionParameters {
        shutdown_time: 0.1,
        plausibility: Some(watch),
        ..ProtectionParameters::DEFAULT
    };
    Protection::<f64>::new(&parameters, 1000.0).unwrap()
}

#[test]
fn within_the_limits_nothing_changes() {
    let (p, mut state) = (protection(), ProtectionState::default());
    for command in [0.0, 40.0, -79.0] {
        let out = p.step(&mut state, &input(command, command, 0.1, 9.0, 1.0));
        assert_eq!((out.command, out.authority, out.status), (command, 1.0, 0));
    }
    assert_eq!(p.step(&mut state, &input(1.0, -81.0, 0.1, 0.0, 0.0)).status, status::PROTECTION_WARNING);
}

#[test]
fn a_trip_takes_the_frozen_command_to_zero_and_stays() {
    let (p, mut state) = (protection(), ProtectionState::default());
    p.step(&mut state, &input(90.0, 90.0, 0.0, 0.0, 0.0));
    for n in 1..=20 {
        // The force follows, and the command continues.
        let out =
            p.step(&mut state, &input(90.0 + f64::from(n), if n == 1 { 101.0 } else { 0.0 }, 0.0, 0.0, 0.0));
        let expected = 91.0 * (1.0 - 0.1 * f64::from(n)).max(0.0);
        assert!((out.command - expected).abs() < 1e-7, "sample {n}: {}", out.command);
        assert_eq!((out.authority, out.status & status::TRIPPED), (1.0, status::TRIPPED));
        assert_eq!(out.status & status::SHUT_DOWN, 0);
    }
}

// SR-06
#[test]
fn the_brake_takes_the_commands_place_after_every_trip() {
    for cause in [Cause::VelocityLost, Cause::Request, Cause::ForceLevel] {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        assert_eq!(state.braking(), None);
        state.trip_by(cause);
        for n in 1..=12 {
            let out = p.step(&mut state, &input(60.0, 0.0, 0.0, 0.0, 0.0));
            let expected = (2.0 * (1.0 - out.command / 60.0)).min(1.0);
            let share = state.braking().unwrap();
            assert!((share - expected).abs() < 1e-6, "{cause:?} {n}: {share} {expected}");
        }
    }
}

// SR-05
#[test]
fn a_wrong_sensor_ramps_the_force_in_a_fifth_of_the_time() {
    for (cause, samples) in [
        (Cause::ForceLost, 2),
        (Cause::VelocityImplausible, 2),
        (Cause::ValveImplausible, 2),
        (Cause::MeasurementLost, 10),
        (Cause::Request, 10),
        (Cause::StateCorrupt, 10),
    ] {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        state.trip_by(cause);
        for n in 1..=samples {
            let expected = 60.0 * (1.0 - f64::from(n) / f64::from(samples));
            let out = p.step(&mut state, &input(60.0, 0.0, 0.0, 0.0, 0.0));
            assert!((out.command - expected).abs() < 1e-6, "{cause:?} {n}: {}", out.command);
        }
    }
}

/// Samples of a millisecond from a trip to the end of the ramp.
fn samples_of_a_ramp(ramp_time: f64, plausibility: Option<PlausibilityParameters>, cause: Cause) -> u32 {
    let parameters = ProtectionParameters { ramp_time, plausibility, ..ProtectionParameters::DEFAULT };
    let p = Protection::<f64>::new(&parameters, 1000.0).unwrap();
    let mut state = ProtectionState::default();
    p.step(&mut state, &input(60.0, 0.0, 0.0, 0.0, 0.0));
    state.trip_by(cause);
    let down = |_: &u32| {
        p.step(&mut state, &input(60.0, 0.0, 0.0, 0.0, 0.0));
        state.is_down()
    };
    (1..100_000).find(down).unwrap()
}

// SR-05
#[test]
fn a_long_ramp_after_a_wrong_sensor_takes_a_tenth_of_a_second() {
    for (ramp_time, samples) in [(0.25, 50), (0.5, 100), (2.5, 100), (60.0, 100)] {
        assert_eq!(samples_of_a_ramp(ramp_time, None, Cause::SpoolLost), samples, "{ramp_time}");
    }
}

// SR-05
#[test]
fn a_watched_ramp_after_a_force_level_takes_at_most_a_tenth_of_a_second() {
    let watched = Some(PlausibilityParameters::DEFAULT);
    for (ramp_time, samples) in [(0.05, 50), (0.1, 100), (0.25, 100), (60.0, 100)] {
        assert_eq!(samples_of_a_ramp(ramp_time, watched, Cause::ForceLevel), samples, "{ramp_time}");
    }
    for (watch, cause) in
        [(None, Cause::ForceLevel), (watched, Cause::DisplacementLevel), (watched, Cause::Request)]
    {
        assert_eq!(samples_of_a_ramp(0.25, watch, cause), 250, "{cause:?}");
    }
}

#[test]
fn far_beyond_the_trip_the_valve_is_shut() {
    let (p, mut state) = (protection(), ProtectionState::default());
    let shares = [0.75, 0.5, 0.25, 0.0, 0.0];
    for share in shares {
        let out = p.step(&mut state, &input(50.0, -126.0, 0.0, 0.0, 0.0));
        assert_eq!(out.authority, share);
        assert_ne!(out.status & status::SHUT_DOWN, 0);
    }
}

#[test]
fn a_force_that_stays_after_the_ramp_shuts_down() {
    let (p, mut state) = (protection(), ProtectionState::default());
    let shut =
        |state: &mut _| p.step(state, &input(50.0, 101.0, 0.0, 0.0, 0.0)).status & status::SHUT_DOWN != 0;
    let first = (0..30).position(|_| shut(&mut state));
    // The first step rises to the whole command and trips at once, so the ramp starts from 0.
    assert!(first.is_some_and(|n| n <= 11), "{first:?}");
}

#[test]
fn a_fault_that_persists_trips_and_the_ramp_follows() {
    let (p, mut state) = (protection(), ProtectionState::default());
    let mut command_with = |fault: bool| {
        let out = p.step(&mut state, &input(60.0, 0.0, 0.1, 0.0, 0.0));
        let flags = if fault { status::ADAPTATION_FROZEN } else { status::SPOOL_WARNING };
        p.watch(&mut state, flags);
        (out.command, out.status)
    };
    for fault in [true, true, true, true, true, false, true, true, true, true, true, true] {
        assert_eq!(command_with(fault), (60.0, 0));
    }
    for n in 1..=12 {
        let expected = 60.0 * (1.0 - 0.1 * f64::from(n)).max(0.0);
        let (command, status) = command_with(false);
        assert!((command - expected).abs() < 1e-7, "sample {n}: {command}");
        let expected = if n > 10 { status::TRIPPED | status::SHUT_DOWN } else { status::TRIPPED };
        assert_eq!(status & !status::CAUSE, expected, "sample {n}");
        assert_eq!(status::cause(status), Cause::ModelContradicted);
    }
}

// SR-01
#[test]
fn persisting_lost_samples_shut_down() {
    let (p, mut state) = (protection(), ProtectionState::default());
    let mut status_of = |force: f64| p.step(&mut state, &input(50.0, force, 0.0, 0.0, 0.0)).status;
    for force in [1.0, f64::NAN, f64::INFINITY, f64::NAN, 1.0, f64::NAN, f64::NAN, f64::NAN] {
        assert_eq!(status_of(force), 0);
    }
    for force in [f64::NAN, 1.0] {
        let status = status_of(force);
        assert_eq!(status & !status::CAUSE, status::TRIPPED | status::SHUT_DOWN);
        assert_eq!(status::cause(status), Cause::MeasurementLost);
    }
}

#[test]
fn start_and_end_are_soft_and_foreseen() {
    let soft = ProtectionParameters { start_time: 0.004, ramp_time: 0.004, ..ProtectionParameters::DEFAULT };
    let p = Protection::<f64>::new(&soft, 1000.0).unwrap();
    let mut state = ProtectionState::default();
    let step = |state: &mut ProtectionState<f64>| {
        let foreseen = p.preview(state, 8.0);
        let out = p.step(state, &input(8.0, 0.0, 0.0, 0.0, 0.0));
        assert_eq!(out.command, foreseen);
        assert_eq!(out.status, 0);
        out.command
    };
    assert_eq!([0; 5].map(|_| step(&mut state)), [2.0, 4.0, 6.0, 8.0, 8.0]);
    state.end();
    assert_eq!([0; 5].map(|_| step(&mut state)), [6.0, 4.0, 2.0, 0.0, 0.0]);
    assert!(state.is_down());
}

#[test]
fn after_a_trip_the_frozen_command_is_foreseen() {
    let (p, mut state) = (protection(), ProtectionState::default());
    p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
    state.trip();
    for _ in 0..12 {
        let foreseen = p.preview(&state, -500.0);
        assert_eq!(p.step(&mut state, &input(-500.0, 0.0, 0.0, 0.0, 0.0)).command, foreseen);
    }
}

#[test]
fn bad_parameters_are_named() {
    let made = |p: ProtectionParameters| Protection::<f32>::new(&p, 1000.0);
    let with = |force| made(ProtectionParameters { force, ..ProtectionParameters::DEFAULT });
    assert!(with(Levels::NONE).is_ok());
    assert!(with(Levels { warning: 2.0, trip: 1.0 }).is_err());
    assert!(with(Levels { warning: f64::INFINITY, trip: 1.0 }).is_err());
    // No warning beside a trip level.
    assert_eq!(with(Levels { warning: f64::MAX, trip: 1.0 }), with(Levels { warning: 1.0, trip: 1.0 }));
    assert!(with(Levels { warning: f64::NAN, trip: 1.0 }).is_err());
    let waiting = |lost_samples| made(ProtectionParameters { lost_samples, ..ProtectionParameters::DEFAULT });
    assert!(waiting(100_000).is_ok() && waiting(100_001).is_err());
    let faulty_samples =
        |fault_time| made(ProtectionParameters { fault_time, ..ProtectionParameters::DEFAULT });
    assert!(faulty_samples(4e6).is_ok() && faulty_samples(5e6).is_err() && faulty_samples(f64::NAN).is_err());
}

// SR-09
#[test]
fn a_flipped_bit_of_either_latch_shuts_down() {
    for of_trip in [true, false] {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        state.flip(of_trip);
        let out = p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        assert_eq!(out.status & (status::TRIPPED | status::SHUT_DOWN), status::TRIPPED | status::SHUT_DOWN);
    }
}

#[test]
fn an_oscillating_force_shuts_down_at_the_next_sample() {
    let rate = 4096.0;
    let parameters = ProtectionParameters { oscillation_limit: 200.0, ..ProtectionParameters::DEFAULT };
    let p = Protection::<f64>::new(&parameters, rate).unwrap();
    for (amplitude, trips) in [(200.0, false), (1000.0, true)] {
        let mut state = ProtectionState::default();
        let mut step = |n: u32| {
            let force = amplitude * libm::sin(core::f64::consts::TAU * 65.0 * f64::from(n) / rate);
            let out = p.step(&mut state, &input(0.0, force, 0.0, 0.0, 0.0));
            (state.cause() == Cause::ForceOscillation, out.status & status::SHUT_DOWN != 0)
        };
        let tripped = (0..4096).find(|n| step(*n).0);
        // After the fifteenth window of a sixtieth of a second, which is the first one that persists.
        assert_eq!(tripped.is_some_and(|n| (1000..1200).contains(&n)), trips, "{amplitude}: {tripped:?}");
        if let Some(n) = tripped {
            assert_eq!(step(n + 1), (true, true));
        }
    }
}

// SR-15
#[test]
fn old_samples_close_the_valve_at_once_and_skipped_ones_ramp_the_command() {
    for (counts, old) in [(0.0, true), (3.0, false)] {
        let (p, mut state) = (settling(), ProtectionState::default());
        for n in 0..30_u32 {
            let alive = 1.0 + counts * f64::from(n);
            let out = p.step(&mut state, &ProtectionInput { alive, ..input(60.0, 60.0, 0.0, 0.0, 0.0) });
            // Ten bad samples do not trip yet.
            let tripped = n > 10;
            assert_eq!(out.status & status::TRIPPED != 0, tripped, "{counts} {n}");
            assert_eq!(out.status & status::SHUT_DOWN != 0, tripped && old, "{counts} {n}");
            assert_eq!(out.authority < 1.0, tripped && old, "{counts} {n}");
        }
        assert_eq!(state.cause(), Cause::SamplesOld);
    }
}

#[test]
fn a_level_is_the_cause_also_if_command_measurements_or_time_are_lost() {
    let p = protection();
    let sound = input(60.0, 60.0, 0.0, 0.0, 0.0);
    for (bad, cause) in [
        (ProtectionInput { command: f64::NAN, ..sound }, Cause::CommandLost),
        (ProtectionInput { displacement: f64::NAN, ..sound }, Cause::MeasurementLost),
        (ProtectionInput { alive: 7.0, ..sound }, Cause::SamplesOld),
    ] {
        for (force, expected) in [(60.0, cause), (101.0, Cause::ForceLevel)] {
            let mut state = ProtectionState::default();
            // Three bad samples in a row do not trip. The first alive counter is not bad.
            for _ in 0..3 + u32::from(!bad.alive.is_nan()) {
                p.step(&mut state, &bad);
                assert!(!state.is_tripped(), "{cause:?}");
            }
            p.step(&mut state, &ProtectionInput { force, ..bad });
            assert_eq!(state.cause(), expected);
        }
    }
}

#[test]
fn a_measurement_is_lost_beyond_single_precision_only() {
    let largest = f64::from(f32::MAX);
    for (displacement, cause) in [(largest, Cause::DisplacementLevel), (1.001 * largest, Cause::None)] {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, &input(60.0, 60.0, displacement, 0.0, 0.0));
        assert_eq!(state.cause(), cause, "{displacement}");
    }
}

#[test]
fn the_largest_command_is_foreseen_and_a_larger_one_is_not() {
    let (p, mut state) = (protection(), ProtectionState::default());
    p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
    for (command, foreseen) in [(crate::LARGEST, crate::LARGEST), (1.001 * crate::LARGEST, 60.0)] {
        assert_eq!(p.preview(&state, command), foreseen);
    }
}

#[test]
fn the_largest_command_is_permitted_and_a_larger_one_is_invalid() {
    let largest = crate::LARGEST;
    for (command, permitted, flags) in
        [(largest, largest, 0), (1.001 * largest, 60.0, status::INVALID_COMMAND)]
    {
        let (p, mut state) = (protection(), ProtectionState::default());
        p.step(&mut state, &input(60.0, 60.0, 0.0, 0.0, 0.0));
        let out = p.step(&mut state, &input(command, 60.0, 0.0, 0.0, 0.0));
        assert_eq!((out.command, out.status), (permitted, flags));
    }
}
