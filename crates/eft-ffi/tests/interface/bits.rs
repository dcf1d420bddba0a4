//! The C interface gives the core's bits: tick, learner and what is read from them, in either precision.

use std::ptr::null_mut;

use eft_core::{Channel, Input, Learner, Parameters, SavedCalibration, status};
use eft_ffi::*;

use crate::rig::{GUARDED, LEARNING, RIGS, TABLE, for_c, sample, zeroed};

/// Long enough to learn from; shorter in an interpreter.
const TICKS: u32 = if cfg!(miri) { 100 } else { 20_000 };

macro_rules! precision {
    (
        $module:ident, $t:ident,
        $configure:ident $check:ident $reset:ident $input_init:ident $prime:ident $step:ident $hold:ident $missed:ident
        $publish:ident $in_use:ident $take_over:ident $trip:ident $end:ident $is_down:ident
        $learner_configure:ident $learner_check:ident $learner_reset:ident $start:ident $save:ident $first:ident $reset_with:ident
        $learn:ident $read:ident $flow:ident $integrity:ident
    ) => {
        mod $module {
            use super::*;

            /// The same bits, or NaN in both.
            fn same(a: $t, b: $t) -> bool {
                a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
            }

            fn input(tick: u32) -> Input<$t> {
                let [command, velocity, force, spool, displacement, acceleration, supply, next, valve] =
                    sample(tick).map(|value| value as $t);
                let (supply_pressure, next_command, valve_command) = (supply, next, valve);
                Input {
                    command,
                    velocity,
                    force,
                    spool,
                    displacement,
                    acceleration,
                    supply_pressure,
                    next_command,
                    valve_command,
                    alive: tick as $t,
                    period: 1.0 / 4096.0,
                    load_pressure: force / 8e-3,
                }
            }

            fn assert_same(expected: &eft_core::Output<$t>, output: &eft_output<$t>, tick: u32) {
                for (expected, got) in [
                    (expected.voltage, output.voltage),
                    (expected.compensation, output.compensation),
                    (expected.velocity, output.velocity),
                    (expected.permitted_command, output.permitted_command),
                    (expected.authority, output.authority),
                ] {
                    assert!(same(expected, got), "tick {tick}: {expected} in Rust, {got} in C");
                }
                assert_eq!(
                    (expected.status, u32::from(expected.window.is_some())),
                    (output.status, output.window_closed)
                );
            }

            #[test]
            fn every_rig_steps_learns_and_ends_as_in_the_core() {
                // In an interpreter the rig with the fewest parts and the one with most: the interface's own code is
                // the same for all, and the core, where they differ, has no unsafe code.
                let followed = |n| !cfg!(miri) || n == 0 || n == 4;
                RIGS.iter().enumerate().filter(|(n, _)| followed(*n)).for_each(|(_, rig)| follow(rig));
            }

            fn follow(p: &Parameters) {
                let core = Channel::<$t, EFT_TABLE_CAPACITY>::new(p).unwrap();
                let mut expected = core.at_rest();
                let core_learner = Learner::<$t, EFT_TABLE_CAPACITY>::new(p).unwrap();
                let mut expected_learned = core_learner.at_rest();
                let parameters = for_c(p);
                let (mut channel, mut state, mut output) = (zeroed(), zeroed(), zeroed::<eft_output<$t>>());
                let (mut learner, mut learned) = (zeroed(), zeroed());
                let (mut calibration, mut down) = (zeroed(), 7);
                // Safety: every pointer is valid, or null where null is allowed.
                unsafe {
                    assert_eq!($configure(&parameters, &mut *channel, null_mut()), EFT_OK);
                    assert_eq!($check(&*channel, &parameters), EFT_OK);
                    assert_eq!($reset(&*channel, &raw mut *state), EFT_OK);
                    assert_eq!($learner_configure(&parameters, &mut *learner, null_mut()), EFT_OK);
                    assert_eq!($learner_check(&*learner, &parameters), EFT_OK);
                    assert_eq!($learner_reset(&*learner, &mut *learned), EFT_OK);
                    // With the first calibration of a learner without evidence the channel starts as without it.
                    let (mut with, [mut word, mut same_word]) = (zeroed(), [0; 2]);
                    assert_eq!($first(&*learner, &*learned, &mut *calibration), EFT_OK);
                    assert_eq!($reset_with(&*channel, &*calibration, &raw mut *with), EFT_OK);
                    assert_eq!($integrity(&raw const *state, &mut word), EFT_OK);
                    assert_eq!($integrity(&raw const *with, &mut same_word), EFT_OK);
                    assert_eq!(word, same_word);
                    for tick in 0..TICKS {
                        let input = input(tick);
                        if tick == 50 {
                            core.prime(&mut expected, &input);
                            assert_eq!($prime(&*channel, &raw mut *state, &input), EFT_OK);
                        }
                        if tick == TICKS - 40 {
                            let tripped = output.status & status::TRIPPED != 0;
                            assert!(!tripped || p.protection.unwrap().fault_time < 1.0);
                            expected.trip();
                            assert_eq!($trip(&raw mut *state), EFT_OK);
                        }
                        if tick == TICKS / 2 {
                            expected.end();
                            assert_eq!($end(&raw mut *state), EFT_OK);
                        }
                        let out = core.step(&mut expected, &input);
                        assert_eq!($step(&*channel, &raw mut *state, &input, &mut *output), EFT_OK);
                        assert_same(&out, &output, tick);
                        if let Some(window) = out.window {
                            let found = core_learner.update(&mut expected_learned, &window);
                            core.publish(&mut expected, found);
                            let code = $learn(&*learner, &mut *learned, &output.window, &mut *calibration);
                            assert_eq!(code, EFT_OK);
                            assert_eq!($publish(&*channel, &raw mut *state, &*calibration), EFT_OK);
                        }
                        assert_eq!($is_down(&raw mut *state, &mut down), EFT_OK);
                        assert_eq!(down, u8::from(expected.is_down()));
                    }
                    let held = core.hold(&expected);
                    assert_eq!($hold(&*channel, &raw mut *state, &mut *output), EFT_OK);
                    assert_same(&held, &output, TICKS);
                    assert_eq!($missed(&*channel, &raw mut *state, &mut *output), EFT_OK);
                    let missed = eft_core::Output { status: held.status | status::MISSED_TICK, ..held };
                    assert_same(&missed, &output, TICKS);

                    let mut said: Box<eft_learned<$t>> = zeroed();
                    assert_eq!($in_use(&raw mut *state, &mut *calibration), EFT_OK);
                    assert_eq!($read(&*calibration, &mut *said), EFT_OK);
                    let used = expected.calibration();
                    for (expected, got) in [
                        (used.flow_gain, said.flow_gain),
                        (used.valve_gain, said.valve_gain),
                        (used.response_delay, said.response_delay),
                        (used.level, said.level),
                        (used.test_ratio, said.test_ratio),
                    ] {
                        assert!(same(expected, got), "{expected} in Rust, {got} in C");
                    }
                    assert_eq!((said.window, said.status), (used.window, used.status));
                    // Without a learner the calibration comes from the configuration.
                    assert_eq!(said.window == u32::MAX, !p.learning.is_on());
                    // The saved calibration, and a learner that starts from it.
                    let (mut saved, mut why): (Box<eft_saved_calibration>, Box<eft_error>) =
                        (zeroed(), zeroed());
                    let of_core =
                        |saved: &eft_saved_calibration| (&raw const *saved).cast::<SavedCalibration>().read();
                    assert_eq!($save(&*learner, &*learned, &mut *saved), EFT_OK);
                    let kept = core_learner.saved(&expected_learned);
                    assert_eq!(of_core(&saved), kept);
                    assert_eq!((saved.flow_gain, saved.curve_error), (kept.flow_gain, kept.curve.error));
                    assert_eq!($start(&*learner, &*saved, &mut *learned, null_mut()), EFT_OK);
                    assert_eq!($save(&*learner, &*learned, &mut *saved), EFT_OK);
                    let started = core_learner.start_from(&kept).unwrap();
                    assert_eq!(of_core(&saved), core_learner.saved(&started));
                    // The channel's first tick has the same calibration.
                    let mut first = zeroed();
                    assert_eq!($first(&*learner, &*learned, &mut *first), EFT_OK);
                    assert_eq!($reset_with(&*channel, &*first, &raw mut *state), EFT_OK);
                    let mut restarted = core.at_rest_with(&core_learner.first_calibration(&started));
                    for tick in 0..20 {
                        let out = core.step(&mut restarted, &input(tick));
                        assert_eq!($step(&*channel, &raw mut *state, &input(tick), &mut *output), EFT_OK);
                        assert_same(&out, &output, tick);
                    }
                    saved.version += 1;
                    let refused = $start(&*learner, &*saved, &mut *learned, &mut *why);
                    assert_eq!((refused, why.value, why.highest), (EFT_OUT_OF_RANGE, 5.0, 4.0));
                    for opening in [-2.0, -0.3, 0.0, 0.1] {
                        let mut flow = 0.0;
                        assert_eq!($flow(&*learner, &*calibration, opening, &mut flow), EFT_OK);
                        assert!(same(flow, core_learner.found_flow(used, opening)));
                        if p == &RIGS[1] && opening == 0.1 && !cfg!(miri) {
                            let ratio = f64::from(flow) / TABLE.flow(0.1);
                            assert!((ratio - 1.05).abs() < 0.02, "{ratio} {said:?}");
                        }
                    }
                }
            }

            #[test]
            fn a_state_continues_under_another_configuration() {
                let other = Parameters { response_delay: 3.0e-3, ..Parameters::ZHAO2005 };
                let [first, second] = [Parameters::ZHAO2005, other]
                    .map(|p| Channel::<$t, EFT_TABLE_CAPACITY>::new(&p).unwrap());
                let (mut channels, mut state, mut output) = ([zeroed(), zeroed()], zeroed(), zeroed());
                let mut expected = first.at_rest();
                // Safety: every pointer is valid.
                unsafe {
                    for (p, channel) in [Parameters::ZHAO2005, other].iter().zip(&mut channels) {
                        assert_eq!($configure(&for_c(p), &mut **channel, null_mut()), EFT_OK);
                    }
                    assert_eq!($reset(&*channels[0], &raw mut *state), EFT_OK);
                    for tick in 0..200 {
                        let input = input(tick);
                        if tick == 100 {
                            second.take_over(&mut expected);
                            assert_eq!($take_over(&*channels[1], &raw mut *state), EFT_OK);
                        }
                        let n = usize::from(tick >= 100);
                        let out = [&first, &second][n].step(&mut expected, &input);
                        assert_eq!($step(&*channels[n], &raw mut *state, &input, &mut *output), EFT_OK);
                        assert_same(&out, &output, tick);
                    }
                }
            }

            #[test]
            fn a_missing_signal_is_flagged_if_it_is_needed() {
                let mut none: Box<eft_input<$t>> = zeroed();
                let bits = |p: &Parameters, with: fn(&mut eft_input<$t>)| {
                    let (mut channel, mut state, mut output) =
                        (zeroed(), zeroed(), zeroed::<eft_output<$t>>());
                    let mut input: Box<eft_input<$t>> = zeroed();
                    // Safety: every pointer is valid.
                    unsafe {
                        assert_eq!($configure(&for_c(p), &mut *channel, null_mut()), EFT_OK);
                        assert_eq!($reset(&*channel, &raw mut *state), EFT_OK);
                        assert_eq!($input_init(&mut *input), EFT_OK);
                        (input.command, input.velocity, input.force, input.spool) = (0.0, 0.0, 0.0, 0.0);
                        with(&mut input);
                        assert_eq!($step(&*channel, &raw mut *state, &*input, &mut *output), EFT_OK);
                    }
                    output.status
                };
                assert_eq!(bits(&LEARNING, |_| {}), 0);
                assert_eq!(bits(&LEARNING, |i| i.force = <$t>::NAN), status::INVALID_MEASUREMENT);
                assert_eq!(bits(&LEARNING, |i| i.command = <$t>::INFINITY), status::INVALID_COMMAND);
                assert_eq!(bits(&GUARDED, |i| i.supply_pressure = 1.9e7), status::INVALID_MEASUREMENT);
                assert_eq!(bits(&GUARDED, |i| i.displacement = 0.0), status::STUCK_MEASUREMENT);
                assert_eq!(bits(&GUARDED, |i| (i.displacement, i.supply_pressure) = (0.0, 1.9e7)), 0);
                // Safety: valid.
                assert_eq!(unsafe { $input_init(&mut *none) }, EFT_OK);
                assert!(none.command.is_nan() && none.displacement.is_nan() && none.valve_command.is_nan());
            }
        }
    };
}
precision!(
    single, f32,
    eft_configure_f32 eft_check_f32 eft_reset_f32 eft_input_init_f32 eft_prime_f32 eft_step_f32 eft_hold_f32
    eft_missed_f32 eft_publish_f32 eft_calibration_in_use_f32 eft_take_over_f32 eft_request_trip_f32
    eft_request_end_f32 eft_is_down_f32 eft_learner_configure_f32 eft_learner_check_f32 eft_learner_reset_f32
    eft_start_from_f32 eft_save_calibration_f32 eft_first_calibration_f32 eft_reset_with_f32
    eft_learn_f32 eft_read_calibration_f32 eft_found_flow_f32
    eft_state_integrity_f32
);
precision!(
    double, f64,
    eft_configure_f64 eft_check_f64 eft_reset_f64 eft_input_init_f64 eft_prime_f64 eft_step_f64 eft_hold_f64
    eft_missed_f64 eft_publish_f64 eft_calibration_in_use_f64 eft_take_over_f64 eft_request_trip_f64
    eft_request_end_f64 eft_is_down_f64 eft_learner_configure_f64 eft_learner_check_f64 eft_learner_reset_f64
    eft_start_from_f64 eft_save_calibration_f64 eft_first_calibration_f64 eft_reset_with_f64
    eft_learn_f64 eft_read_calibration_f64 eft_found_flow_f64
    eft_state_integrity_f64
);
