//! Refusals: null pointers, structs that were never made, and parameters, which are named.

use std::ptr::{null, null_mut};

use eft_core::{LARGEST, Parameters};
use eft_ffi::*;

use crate::rig::{GUARDED, LEARNING, at_rest, for_c, nothing_learned, zeroed};

/// Calls functions with null pointers.
macro_rules! with_nulls {
    ($($name:ident($($null:expr),*))*) => {
        // Safety: null is allowed.
        unsafe { [$((stringify!($name), $name($($null),*))),*] }
    };
}

#[test]
fn null_pointers_are_refused_by_every_function() {
    let codes = with_nulls!(
        eft_configure_f32(null(), null_mut(), null_mut()) eft_check_f32(null(), null())
        eft_integrity_f32(null(), null_mut()) eft_state_integrity_f32(null(), null_mut()) eft_reset_f32(null(), null_mut())
        eft_reset_with_f32(null(), null(), null_mut()) eft_first_calibration_f32(null(), null(), null_mut())
        eft_input_init_f32(null_mut()) eft_prime_f32(null(), null_mut(), null()) eft_step_f32(null(), null_mut(), null(), null_mut())
        eft_hold_f32(null(), null(), null_mut()) eft_missed_f32(null(), null(), null_mut()) eft_publish_f32(null(), null_mut(), null())
        eft_calibration_in_use_f32(null(), null_mut()) eft_take_over_f32(null(), null_mut()) eft_request_trip_f32(null_mut())
        eft_request_end_f32(null_mut()) eft_is_down_f32(null(), null_mut())
        eft_learner_configure_f32(null(), null_mut(), null_mut()) eft_learner_check_f32(null(), null())
        eft_learner_integrity_f32(null(), null_mut()) eft_learner_state_integrity_f32(null(), null_mut())
        eft_start_from_f32(null(), null(), null_mut(), null_mut()) eft_save_calibration_f32(null(), null(), null_mut())
        eft_learner_reset_f32(null(), null_mut()) eft_learn_f32(null(), null_mut(), null(), null_mut()) eft_read_calibration_f32(null(), null_mut())
        eft_found_flow_f32(null(), null(), 0.0, null_mut())
        eft_offer_channel_f32(null_mut(), null()) eft_offer_window_f32(null_mut(), null()) eft_offer_calibration_f32(null_mut(), null())
        eft_configure_f64(null(), null_mut(), null_mut()) eft_check_f64(null(), null())
        eft_integrity_f64(null(), null_mut()) eft_state_integrity_f64(null(), null_mut()) eft_reset_f64(null(), null_mut())
        eft_reset_with_f64(null(), null(), null_mut()) eft_first_calibration_f64(null(), null(), null_mut())
        eft_input_init_f64(null_mut()) eft_prime_f64(null(), null_mut(), null()) eft_step_f64(null(), null_mut(), null(), null_mut())
        eft_hold_f64(null(), null(), null_mut()) eft_missed_f64(null(), null(), null_mut()) eft_publish_f64(null(), null_mut(), null())
        eft_calibration_in_use_f64(null(), null_mut()) eft_take_over_f64(null(), null_mut()) eft_request_trip_f64(null_mut())
        eft_request_end_f64(null_mut()) eft_is_down_f64(null(), null_mut())
        eft_learner_configure_f64(null(), null_mut(), null_mut()) eft_learner_check_f64(null(), null())
        eft_learner_integrity_f64(null(), null_mut()) eft_learner_state_integrity_f64(null(), null_mut())
        eft_start_from_f64(null(), null(), null_mut(), null_mut()) eft_save_calibration_f64(null(), null(), null_mut())
        eft_learner_reset_f64(null(), null_mut()) eft_learn_f64(null(), null_mut(), null(), null_mut()) eft_read_calibration_f64(null(), null_mut())
        eft_found_flow_f64(null(), null(), 0.0, null_mut())
        eft_offer_channel_f64(null_mut(), null()) eft_offer_window_f64(null_mut(), null()) eft_offer_calibration_f64(null_mut(), null())
    );
    for (name, code) in codes {
        assert_eq!(code, EFT_NULL_POINTER, "{name}");
    }
    // Safety: null is allowed.
    unsafe {
        assert!(eft_take_channel_f32(null_mut()).is_null() && eft_take_channel_f64(null_mut()).is_null());
        assert!(eft_take_window_f32(null_mut()).is_null() && eft_take_window_f64(null_mut()).is_null());
        assert!(eft_take_calibration_f32(null_mut()).is_null());
        assert!(eft_take_calibration_f64(null_mut()).is_null());
    }
}

/// An output that shows whether a step has written it.
fn poisoned() -> eft_output<f32> {
    eft_output { voltage: 9.0, window_closed: 1, ..*zeroed() }
}

#[test]
fn a_refused_step_gives_0_volt_and_changes_nothing() {
    let (channel, mut state) = at_rest(&for_c(&LEARNING));
    let (no_channel, mut no_state, input) = (zeroed(), zeroed(), zeroed());
    let (channel, input, s): (*const _, *const _, *mut _) = (&*channel, &*input, &raw mut *state);
    for (channel, state, input, expected) in [
        (&raw const *no_channel, s, input, EFT_NOT_MADE),
        (channel, &raw mut *no_state, input, EFT_NOT_MADE),
        (null(), s, input, EFT_NULL_POINTER),
        (channel, null_mut(), input, EFT_NULL_POINTER),
        (channel, s, null(), EFT_NULL_POINTER),
    ] {
        let mut outputs = [poisoned(); 3];
        let [step, hold, missed] = &mut outputs;
        // Safety: null or valid.
        unsafe {
            assert_eq!(eft_step_f32(channel, state, input, step), expected);
            if !input.is_null() {
                assert_eq!(eft_hold_f32(channel, state, hold), expected);
                assert_eq!(eft_missed_f32(channel, state, missed), expected);
            } else {
                (*hold, *missed) = (*step, *step);
            }
        }
        for output in outputs {
            assert_eq!((output.voltage, output.authority, output.window_closed), (0.0, 0.0, 0));
            assert_eq!(output.status, EFT_NO_STEP);
        }
    }
    // Safety: null or valid.
    unsafe {
        assert_eq!(eft_step_f32(channel, s, input, null_mut()), EFT_NULL_POINTER);
        let mut output = poisoned();
        assert_eq!(eft_step_f32(channel, s, input, &mut output), EFT_OK);
        assert_eq!((output.voltage, output.status), (0.0, 0));
    }
}

#[test]
fn structs_that_were_never_made_are_refused_by_every_function() {
    let parameters = for_c(&LEARNING);
    let (channel, mut state) = at_rest(&parameters);
    let (learner, mut learned) = nothing_learned(&parameters);
    let (no_channel, no_learner, window): (Box<_>, Box<_>, Box<_>) = (zeroed(), zeroed(), zeroed());
    let (mut no_state, mut no_learned, mut calibration) = (zeroed(), zeroed(), zeroed());
    let (mut said, mut saved, mut flow, mut down) = (zeroed(), zeroed(), 7.0, 7);
    let input: Box<eft_input<f32>> = zeroed();
    let (mut channels, mut windows, mut calibrations) = (zeroed(), zeroed(), zeroed());
    // Safety: every pointer is valid.
    let codes = unsafe {
        [
            eft_check_f32(&*no_channel, &parameters),
            eft_learner_check_f32(&*no_learner, &parameters),
            eft_reset_f32(&*no_channel, &raw mut *no_state),
            eft_reset_with_f32(&*no_channel, &*calibration, &raw mut *no_state),
            eft_reset_with_f32(&*channel, &*calibration, &raw mut *no_state),
            eft_first_calibration_f32(&*no_learner, &*learned, &mut *calibration),
            eft_first_calibration_f32(&*learner, &*no_learned, &mut *calibration),
            eft_learner_reset_f32(&*no_learner, &mut *no_learned),
            eft_start_from_f32(&*no_learner, &*saved, &mut *no_learned, null_mut()),
            eft_save_calibration_f32(&*no_learner, &*learned, &mut *saved),
            eft_save_calibration_f32(&*learner, &*no_learned, &mut *saved),
            eft_prime_f32(&*no_channel, &raw mut *state, &*input),
            eft_prime_f32(&*channel, &raw mut *no_state, &*input),
            eft_publish_f32(&*channel, &raw mut *state, &*calibration),
            eft_publish_f32(&*channel, &raw mut *no_state, &*calibration),
            eft_calibration_in_use_f32(&raw mut *no_state, &mut *calibration),
            eft_take_over_f32(&*channel, &raw mut *no_state),
            eft_request_trip_f32(&raw mut *no_state),
            eft_request_end_f32(&raw mut *no_state),
            eft_is_down_f32(&raw mut *no_state, &mut down),
            eft_learn_f32(&*no_learner, &mut *learned, &*window, &mut *calibration),
            eft_learn_f32(&*learner, &mut *no_learned, &*window, &mut *calibration),
            eft_learn_f32(&*learner, &mut *learned, &*window, &mut *calibration),
            eft_read_calibration_f32(&*calibration, &mut *said),
            eft_found_flow_f32(&*learner, &*calibration, 0.1, &mut flow),
            eft_offer_channel_f32(&mut *channels, &*no_channel),
            eft_offer_window_f32(&mut *windows, &*window),
            eft_offer_calibration_f32(&mut *calibrations, &*calibration),
            // A struct that was made as another type.
            eft_check_f32((&raw const *learner).cast(), &parameters),
            eft_step_f32(&*channel, (&raw mut *learned).cast(), &*input, &mut poisoned()),
        ]
    };
    assert_eq!(codes, [EFT_NOT_MADE; 30]);
    assert_eq!((flow, down), (7.0, 7));
    // Safety: every pointer is valid.
    unsafe {
        assert!(eft_take_channel_f32(&mut *channels).is_null());
        // A null calibration does not change the learner.
        assert_eq!(eft_calibration_in_use_f32(&raw mut *state, &mut *calibration), EFT_OK);
        for opening in [f32::NAN, f32::INFINITY] {
            assert_eq!(eft_found_flow_f32(&*learner, &*calibration, opening, &mut flow), EFT_NOT_FINITE);
        }
        assert_eq!(flow, 7.0);
    }
}

#[test]
fn parameters_are_refused_by_name_in_either_precision() {
    type Change = fn(&mut eft_parameters);
    let cases: [(Change, u8, &str); 21] = [
        (|p| p.realization = 2, EFT_OUT_OF_RANGE, "realization"),
        (|p| p.mode = 3, EFT_OUT_OF_RANGE, "mode"),
        (|p| p.sign_from = 2, EFT_OUT_OF_RANGE, "sign_from"),
        (|p| p.velocity_source = 4, EFT_OUT_OF_RANGE, "velocity_source"),
        (|p| p.supply_correction = 2, EFT_OUT_OF_RANGE, "supply_correction"),
        (|p| p.feedforward = 255, EFT_OUT_OF_RANGE, "feedforward"),
        (|p| p.look_ahead = 2, EFT_OUT_OF_RANGE, "look_ahead"),
        (|p| p.learning.adaptive = 2, EFT_OUT_OF_RANGE, "adaptive"),
        (|p| p.learning.curve_correction = 2, EFT_OUT_OF_RANGE, "curve_correction"),
        (|p| p.learning.guard = 2, EFT_OUT_OF_RANGE, "guard"),
        (|p| p.protection.enabled = 2, EFT_OUT_OF_RANGE, "protection"),
        (|p| p.table_length = 22, EFT_LENGTH, "table_length"),
        (|p| p.table_length = 1, EFT_LENGTH, "openings"),
        (|p| p.flows[3] = p.flows[2], EFT_NOT_INCREASING, "flows"),
        (|p| p.sample_rate = f64::NAN, EFT_NOT_FINITE, "sample_rate"),
        (|p| p.piston_area = 0.0, EFT_NOT_POSITIVE, "piston_area"),
        (|p| p.level = -1.0, EFT_OUT_OF_RANGE, "level"),
        (|p| p.mass = -1.0, EFT_NOT_POSITIVE, "mass"),
        (|p| p.protection.force_warning = 2.0e4, EFT_OUT_OF_RANGE, "force_warning"),
        (|p| p.protection.lost_samples = u32::MAX, EFT_OUT_OF_RANGE, "lost_samples"),
        (|p| p.stuck_samples = u32::MAX, EFT_OUT_OF_RANGE, "stuck_samples"),
    ];
    for (change, expected, name) in cases {
        let mut p = for_c(&GUARDED);
        change(&mut p);
        let (mut single, mut double, mut whys) = (zeroed(), zeroed(), [*zeroed::<eft_error>(); 2]);
        // Safety: every pointer is valid.
        let codes = unsafe {
            [
                eft_configure_f32(&p, &mut *single, &mut whys[0]),
                eft_configure_f64(&p, &mut *double, &mut whys[1]),
            ]
        };
        assert_eq!(codes, [expected; 2], "{name}");
        for why in whys {
            let said = why.parameter.map(|c| c as u8);
            assert_eq!(said.split(|c| *c == 0).next().unwrap(), name.as_bytes());
        }
        // Safety: every pointer is valid or null.
        unsafe {
            assert_eq!(eft_configure_f32(&p, &mut *single, null_mut()), expected);
            // What was refused is not there, where a configuration was before neither.
            assert_eq!(eft_configure_f32(&for_c(&GUARDED), &mut *single, null_mut()), EFT_OK);
            assert_eq!(eft_check_f32(&*single, &for_c(&GUARDED)), EFT_OK);
            assert_eq!(eft_configure_f32(&p, &mut *single, null_mut()), expected);
            assert_eq!(eft_check_f32(&*single, &for_c(&GUARDED)), EFT_NOT_MADE);
        }
    }
}

#[test]
fn a_refusal_says_which_value_entry_and_range() {
    let (mut channel, mut why) = (zeroed(), zeroed::<eft_error>());
    let mut refused = |p: &Parameters, change: fn(&mut eft_parameters)| {
        let mut p = for_c(p);
        change(&mut p);
        // Safety: every pointer is valid.
        unsafe {
            _ = eft_configure_f32(&p, &mut *channel, &mut *why);
        }
        (why.value, why.lowest, why.highest, why.index)
    };
    assert_eq!(refused(&GUARDED, |p| p.level = 11.0), (11.0, 0.0, 10.0, 0));
    assert_eq!(refused(&GUARDED, |p| p.sign_from = 9), (9.0, 0.0, 1.0, 0));
    assert_eq!(refused(&GUARDED, |p| p.flows[4] = -1.0), (0.0, 0.0, 0.0, 4));
    assert_eq!(refused(&GUARDED, |p| p.flows[5] = 2e12), (2e12, -LARGEST, LARGEST, 5));
    assert_eq!(refused(&GUARDED, |p| p.openings[3] = f64::INFINITY), (f64::INFINITY, -LARGEST, LARGEST, 3));
    assert_eq!(refused(&GUARDED, |p| p.table_length = 22), (22.0, 2.0, 21.0, 0));
    assert_eq!(refused(&LEARNING, |p| p.sample_rate = 100.0), (100.0, 200.0, LARGEST, 0));
}

#[test]
fn a_calibration_is_refused_by_the_whole_name() {
    type Change = fn(&mut eft_saved_calibration);
    let cases: [(Change, &str); 4] = [
        (|saved| saved.version = 0, "calibration.version"),
        (|saved| saved.asymmetry_deviation = 0.0, "calibration.curve.asymmetry_deviation"),
        (|saved| saved.mean_square_frequency = -1.0, "calibration.evidence.mean_square_frequency"),
        (|saved| saved.response_delay_distance = 2e6, "calibration.evidence.distances.response_delay"),
    ];
    let (learner, mut learned) = nothing_learned(&for_c(&LEARNING));
    let (mut saved, mut why) = (zeroed::<eft_saved_calibration>(), zeroed::<eft_error>());
    for (change, name) in cases {
        // Safety: every pointer is valid.
        let code = unsafe {
            assert_eq!(eft_save_calibration_f32(&*learner, &*learned, &mut *saved), EFT_OK);
            (saved.excitation, saved.time) = (0.3, 7.0);
            assert_eq!(eft_start_from_f32(&*learner, &*saved, &mut *learned, &mut *why), EFT_OK);
            change(&mut saved);
            eft_start_from_f32(&*learner, &*saved, &mut *learned, &mut *why)
        };
        let said = why.parameter.map(|c| c as u8);
        assert_eq!(said.split(|c| *c == 0).next().unwrap(), name.as_bytes());
        assert_eq!(code, EFT_OUT_OF_RANGE, "{name}");
    }
}

#[test]
fn a_configuration_is_checked_against_its_parameters() {
    let p = for_c(&GUARDED);
    let (mut channel, _) = at_rest(&p);
    let (mut learner, _) = nothing_learned(&p);
    // Safety: every pointer is valid; a number's bit makes another number.
    unsafe {
        let other = eft_parameters { level: 0.9, lead_alpha: 0.2, ..p };
        assert_eq!(eft_check_f32(&*channel, &other), EFT_CORRUPT);
        assert_eq!(eft_learner_check_f32(&*learner, &other), EFT_CORRUPT);
        assert_eq!(eft_check_f32(&*channel, &eft_parameters { level: -1.0, ..p }), EFT_OUT_OF_RANGE);
        *(&raw mut *channel).cast::<u32>().add(7) ^= 1 << 12;
        *(&raw mut *learner).cast::<u32>().add(90) ^= 1 << 12;
        assert_eq!(eft_check_f32(&*channel, &p), EFT_CORRUPT);
        assert_eq!(eft_learner_check_f32(&*learner, &p), EFT_CORRUPT);
    }
}

#[test]
fn a_learner_without_room_for_its_calibration_learns_nothing() {
    let p = for_c(&LEARNING);
    let (channel, mut state) = at_rest(&p);
    let (learner, mut learned) = nothing_learned(&p);
    let (input, mut output, mut calibration) = (zeroed(), poisoned(), zeroed());
    let (mut said, mut windows): (Box<eft_learned<f32>>, u32) = (zeroed(), 0);
    // Safety: every pointer is null or valid.
    unsafe {
        while windows < 12 {
            assert_eq!(eft_step_f32(&*channel, &raw mut *state, &*input, &mut output), EFT_OK);
            if output.window_closed == 0 {
                continue;
            }
            if windows == 10 {
                let code = eft_learn_f32(&*learner, &mut *learned, &output.window, null_mut());
                assert_eq!(code, EFT_NULL_POINTER);
            }
            let code = eft_learn_f32(&*learner, &mut *learned, &output.window, &mut *calibration);
            assert_eq!((code, eft_read_calibration_f32(&*calibration, &mut *said)), (EFT_OK, EFT_OK));
            // A window that came twice would be one with lost samples before it.
            assert_eq!((said.window, said.status), (windows, 0));
            windows += 1;
        }
    }
}
