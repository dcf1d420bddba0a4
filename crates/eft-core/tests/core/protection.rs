//! The protection with any inputs, in any order.

use eft_core::{
    Channel, Levels, Parameters, Protection, ProtectionInput, ProtectionParameters, ProtectionState, status,
};
use proptest::prelude::*;

use crate::rig;

const RATE: f64 = 1000.0;
/// Samples of the ramp down.
const RAMP: usize = 10;

/// A sample without alive counter and period.
fn input(command: f64, force: f64, displacement: f64, velocity: f64, spool: f64) -> ProtectionInput<f64> {
    let none = f64::NAN;
    ProtectionInput { command, force, displacement, velocity, spool, alive: none, period: none }
}

fn protection() -> Protection<f64> {
    let parameters = ProtectionParameters {
        force: Levels { warning: 80.0, trip: 100.0 },
        displacement: Levels { warning: 0.5, trip: 1.0 },
        velocity: Levels::NONE,
        spool: Levels { warning: 0.6, trip: 0.8 },
        start_time: 0.004,
        ramp_time: RAMP as f64 / RATE,
        shutdown_time: 0.004,
        lost_samples: 3,
        fault_time: 0.005,
        period_tolerance: 0.1,
        oscillation_limit: f64::MAX,
        plausibility: None,
    };
    Protection::<f64>::new(&parameters, RATE).unwrap()
}

/// The inputs of one call.
#[derive(Debug, Clone, Copy)]
enum Call {
    Step([f64; 5]),
    Watch(u32),
    Preview(f64),
    Trip,
    End,
}

/// Mostly inputs of a working rig, sometimes any numbers.
fn number(scale: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        12 => -scale..scale,
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 2e12, -0.0]),
        1 => any::<f64>(),
    ]
}

fn call() -> impl Strategy<Value = Call> {
    let signals = (number(60.0), number(60.0), number(0.4), number(1.0), number(0.5));
    let flags = prop::sample::select(vec![
        0,
        status::INVALID_MEASUREMENT,
        status::INVALID_COMMAND,
        status::ADAPTATION_FROZEN,
        status::SPOOL_WARNING,
    ]);
    prop_oneof![
        12 => signals.prop_map(|(c, f, x, v, o)| Call::Step([c, f, x, v, o])),
        6 => flags.prop_map(Call::Watch),
        4 => number(60.0).prop_map(Call::Preview),
        1 => Just(Call::Trip),
        1 => Just(Call::End),
    ]
}

proptest! {
    #[test]
    fn nothing_that_is_not_finite_is_ever_permitted(calls in prop::collection::vec(call(), 1..200)) {
        let (p, mut state) = (protection(), ProtectionState::default());
        let mut since_trip = None;
        let mut largest: f64 = 0.0;
        for call in calls {
            match call {
                Call::Step([command, force, displacement, velocity, spool]) => {
                    if command.abs() <= 1e12 {
                        largest = largest.max(command.abs());
                    }
                    let out = p.step(&mut state, &input(command, force, displacement, velocity, spool));
                    prop_assert!(out.command.abs() <= largest, "{}", out.command);
                    prop_assert!((0.0..=1.0).contains(&out.authority), "{}", out.authority);
                    prop_assert_eq!(out.status & status::INVALID_COMMAND == 0, command.abs() <= 1e12);
                    if out.status & status::TRIPPED != 0 {
                        since_trip = Some(since_trip.unwrap_or(0) + 1);
                    }
                    prop_assert_eq!(out.status & status::TRIPPED != 0, since_trip.is_some());
                    // The sum of ten tenths may differ in the last bit.
                    if since_trip > Some(RAMP) {
                        prop_assert_eq!(out.command, 0.0);
                    }
                }
                Call::Watch(flags) => p.watch(&mut state, flags),
                Call::Preview(next) => {
                    let permitted = p.preview(&state, next);
                    prop_assert!(permitted.is_finite(), "{}", permitted);
                }
                Call::Trip => state.trip(),
                Call::End => state.end(),
            }
        }
    }

    #[test]
    fn refused_samples_count_as_lost(
        command in -60.0..60.0f64, flag in prop::sample::select(vec![status::INVALID_MEASUREMENT, status::INVALID_COMMAND]),
        other in any::<u32>(),
    ) {
        let (p, mut state) = (protection(), ProtectionState::default());
        let mut authority_after = |refused: bool| {
            let out = p.step(&mut state, &input(command, 0.0, 0.0, 0.0, 0.0));
            // Without the two flags that have their own counts.
            let other = other & !(status::INVALID_MEASUREMENT | status::INVALID_COMMAND);
            let other = other & !(status::ADAPTATION_FROZEN | status::STUCK_MEASUREMENT);
            p.watch(&mut state, other | if refused { flag } else { 0 });
            (out.authority, out.status & status::SHUT_DOWN != 0)
        };
        // Three refused samples in a row do not shut down, also repeatedly.
        for refused in [true, true, true, false, true, true, true, false, true, true, true, true] {
            prop_assert_eq!(authority_after(refused), (1.0, false));
        }
        for authority in [0.75, 0.5, 0.25, 0.0, 0.0] {
            prop_assert_eq!(authority_after(false), (authority, true));
        }
    }
}

#[test]
fn a_lost_command_is_the_last_valid_one_and_ramped_down_when_it_stays_lost() {
    let (p, mut state) = (protection(), ProtectionState::default());
    let mut step = |command: f64| {
        let foreseen = p.preview(&state, command);
        let out = p.step(&mut state, &input(command, 0.0, 0.0, 0.0, 0.0));
        p.watch(&mut state, 0);
        (foreseen, out)
    };
    for _ in 0..6 {
        step(40.0);
    }
    for command in [f64::NAN, f64::INFINITY, 2e12] {
        let (foreseen, out) = step(command);
        assert_eq!((foreseen, out.command, out.status), (40.0, 40.0, status::INVALID_COMMAND));
    }
    assert_eq!(step(30.0).1.command, 30.0);
    for _ in 0..3 {
        assert_eq!(step(f64::NAN).1.command, 30.0);
    }
    // The loop works: the command ramps to zero with full authority, for any further command.
    for n in 1..=12 {
        let (_, out) = step(if n % 2 == 1 { f64::NAN } else { 20.0 });
        let expected = 30.0 * (1.0 - 0.1 * f64::from(n)).max(0.0);
        assert!((out.command - expected).abs() < 1e-7, "{n}: {}", out.command);
        assert_eq!((out.authority, out.status & status::TRIPPED), (1.0, status::TRIPPED));
    }
}

#[test]
fn a_trip_in_the_soft_start_has_no_step() {
    for by_fault in [false, true] {
        let (p, mut state) = (protection(), ProtectionState::default());
        let step = |state: &mut _| p.step(state, &input(40.0, 0.0, 0.0, 0.0, 0.0)).command;
        assert_eq!([step(&mut state), step(&mut state)], [10.0, 20.0]);
        if by_fault {
            for _ in 0..6 {
                p.watch(&mut state, status::STUCK_MEASUREMENT);
            }
        } else {
            state.trip();
        }
        // A ramp has steps of 2⁻³¹.
        assert!((step(&mut state) - 40.0 * (0.5 - 0.1)).abs() < 1e-7);
    }
}

#[test]
fn the_two_warnings_of_the_spool_have_different_names_in_refusals() {
    let spool = Levels { warning: 0.9, trip: 0.8 };
    let protection = Some(ProtectionParameters { spool, ..ProtectionParameters::DEFAULT });
    for (name, parameters) in [
        ("spool_warning", Parameters { spool_warning: -1.0, ..rig::PARAMETERS }),
        ("protection.spool_warning", Parameters { protection, ..rig::PARAMETERS }),
    ] {
        assert_eq!(rig::refused(Channel::<f32, 21>::new(&parameters)), name);
    }
}
