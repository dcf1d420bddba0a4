//! The learner beside the tick: from a window to the next calibration.

use eft_core::{Learner, LearnerState};

use crate::channel::{eft_calibration_f32, eft_calibration_f64, eft_window_f32, eft_window_f64};
use crate::codes::{EFT_NOT_FINITE, EFT_NULL_POINTER};
use crate::parameters::{EFT_TABLE_CAPACITY, check, configure, eft_error, eft_parameters};
use crate::place::{give, made, made_mut, make};
use crate::tables::{data, functions, opaque};

macro_rules! precision {
    (
        $module:ident, $t:ty, words: $learner:literal $state:literal, $Window:ident $Calibration:ident
        $Learner:ident $State:ident $Learned:ident
        $configure:ident $check:ident $integrity:ident $state_integrity:ident $reset:ident $learn:ident $read:ident $flow:ident
    ) => {
        mod $module {
            use super::*;

            opaque! {
                /// A learner's configuration. One serves any number of channels of the same parameters.
                $Learner, $learner, 0x96, Learner<$t, EFT_TABLE_CAPACITY>;
                /// What a learner remembers: one for each channel.
                $State, $state, 0x69, LearnerState<$t>;
            }

            data! {
                /// What a calibration says.
                $Learned {
                    flow_gain: $t, "1; true flow over the table's";
                    valve_gain: $t, "1; the spool's gain over the configured one";
                    response_delay: $t, "s; of the spool, by its sensor";
                    velocity_delay: $t, "s; of the velocity behind the spool, by their sensors";
                    flow_gain_deviation: $t, "1; standard deviations by sensor noise, infinite where nothing was learned";
                    valve_gain_deviation: $t, "1";
                    response_delay_deviation: $t, "s";
                    velocity_delay_deviation: $t, "s";
                    level: $t, "1; the guard's factor on the compensation level";
                    test_ratio: $t, "1; what the models miss over what they may: above 1 nothing is learned";
                    window: u32, "its window's number; UINT32_MAX where it was made of the configuration";
                    status: u32, "EFT_ADAPTATION_FROZEN, EFT_ESTIMATE_BOUNDED, EFT_LEVEL_REDUCED";
                }
            }

            functions! {
                /// As eft_configure, for a learner; the parameters are the channel's.
                fn $configure(parameters: *const eft_parameters, learner: *mut $Learner, why: *mut eft_error) {
                    configure(|p, take| Learner::<$t, EFT_TABLE_CAPACITY>::new(p).map(|made| take(&made)), parameters, learner, why)
                }

                /// As eft_check, for a learner.
                fn $check(learner: *const $Learner, parameters: *const eft_parameters) {
                    check(|p, take| Learner::<$t, EFT_TABLE_CAPACITY>::new(p).map(|made| take(&made)), learner, parameters)
                }

                /// As eft_integrity, for a learner.
                fn $integrity(learner: *const $Learner, word: *mut u32) {
                    give(word, made(learner)?.integrity())
                }

                /// The same of a learner's state, to compare behind one eft_learn and before the next.
                fn $state_integrity(state: *const $State, word: *mut u32) {
                    give(word, made(state)?.integrity())
                }

                /// Nothing learned yet.
                fn $reset(learner: *const $Learner, state: *mut $State) {
                    make(state, made(learner)?.at_rest())
                }

                /// Takes in a window and makes the next calibration, for eft_publish. Behind the step, or in a task below the
                /// interrupt.
                fn $learn(
                    learner: *const $Learner,
                    state: *mut $State,
                    window: *const $Window,
                    calibration: *mut $Calibration
                ) {
                    let (core, state, window) = (made(learner)?, made_mut(state)?, made(window)?);
                    if calibration.is_null() {
                        return Err(EFT_NULL_POINTER);
                    }
                    make(calibration, core.update(state, window))
                }

                /// Reads a calibration.
                fn $read(calibration: *const $Calibration, learned: *mut $Learned) {
                    let c = made(calibration)?;
                    let d = &c.deviations;
                    let says = $Learned {
                        flow_gain: c.flow_gain,
                        valve_gain: c.valve_gain,
                        response_delay: c.response_delay,
                        velocity_delay: c.velocity_delay,
                        flow_gain_deviation: d.flow_gain,
                        valve_gain_deviation: d.valve_gain,
                        response_delay_deviation: d.response_delay,
                        velocity_delay_deviation: d.velocity_delay,
                        level: c.level,
                        test_ratio: c.test_ratio,
                        window: c.window,
                        status: c.status,
                    };
                    give(learned, says)
                }

                /// No-load flow, m3/s, that the valve was found to pass at a spool opening, 1: at the openings of the table it
                /// is the rig's new flow curve, beyond its ends that of the end. EFT_NOT_FINITE for an opening that is NaN or
                /// infinite, and *flow stays. For after a test.
                fn $flow(learner: *const $Learner, calibration: *const $Calibration, opening: $t, flow: *mut $t) {
                    let (core, calibration) = (made(learner)?, made(calibration)?);
                    if !opening.is_finite() {
                        return Err(EFT_NOT_FINITE);
                    }
                    give(flow, core.found_flow(calibration, opening))
                }
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32, words: 80 152, eft_window_f32 eft_calibration_f32
    eft_learner_f32 eft_learner_state_f32 eft_learned_f32
    eft_learner_configure_f32 eft_learner_check_f32 eft_learner_integrity_f32 eft_learner_state_integrity_f32 eft_learner_reset_f32
    eft_learn_f32 eft_read_calibration_f32 eft_found_flow_f32
);
precision!(
    double, f64, words: 152 304, eft_window_f64 eft_calibration_f64
    eft_learner_f64 eft_learner_state_f64 eft_learned_f64
    eft_learner_configure_f64 eft_learner_check_f64 eft_learner_integrity_f64 eft_learner_state_integrity_f64 eft_learner_reset_f64
    eft_learn_f64 eft_read_calibration_f64 eft_found_flow_f64
);
