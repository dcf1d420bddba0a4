//! The learner, which makes a calibration from each window.

use eft_core::{Learner, LearnerState, SavedCalibration};

use crate::channel::{eft_calibration, eft_window};
use crate::codes::{EFT_NOT_FINITE, EFT_NULL_POINTER};
use crate::macros::{data, functions, opaque};
use crate::opaque::{give, given, made, made_mut, make};
use crate::parameters::{EFT_TABLE_CAPACITY, check, configure, eft_error, eft_parameters, refuse};

opaque! {
    /// A learner's configuration. One serves any number of channels of the same parameters.
    eft_learner[176], 0x96, Learner<T, EFT_TABLE_CAPACITY>;
    /// The state of a learner. Each channel has one.
    eft_learner_state[314], 0x69, LearnerState<T>;
}

data! {
    /// The numbers of a calibration.
    eft_learned<T: Copy> {
        flow_gain: T, "1; true flow over the table's";
        valve_gain: T, "1; the spool's gain over the configured one";
        response_delay: T, "s; of the measured spool after its command";
        velocity_delay: T, "s; of the measured velocity after the measured spool";
        null_offset: T, "1; commanded opening at which the valve passes nothing at no load";
        flow_gain_deviation: T, "1; standard deviations, infinite before anything is learned";
        valve_gain_deviation: T, "1";
        response_delay_deviation: T, "s";
        velocity_delay_deviation: T, "s";
        null_offset_deviation: T, "1";
        level: T, "1; the guard's factor on the compensation level";
        test_ratio: T, "1; unexplained over permitted residual of the models: above 1 nothing is learned";
        window: u32, "number of its window; UINT32_MAX from the configuration or what was saved";
        status: u32, "EFT_ADAPTATION_FROZEN, EFT_ESTIMATE_BOUNDED, EFT_LEVEL_REDUCED";
    }
}

/// nodes of the flow curve's correction
pub const EFT_CURVE_NODES: usize = 17;

data! {
    /// A calibration to keep over a restart, from eft_save_calibration for eft_start_from. It is valid for either
    /// precision and any sample rate. Standard deviations depend on both: after eft_start_from, eft_first_calibration and
    /// eft_read_calibration have them.
    eft_saved_calibration {
        version: u32, "version of this struct; any other is refused";
        greatest_flow: f64, "m3/s; of the flow table, to which flow gain and curve refer";
        flow_gain: f64, "1; true flow over the table's";
        valve_gain: f64, "1; the spool's gain over the configured one";
        response_delay: f64, "s; of the measured spool after its command";
        velocity_delay: f64, "s; of the measured velocity after the measured spool";
        null_offset: f64, "1; commanded opening at which the valve passes nothing at no load";
        excitation: f64, "s; integral of the squared opening x, 0 before anything is learned";
        time: f64, "s; remembered time of motion";
        mean_weight: f64, "1; of the remembered motion, 1 if nothing was forgotten";
        mean_square_frequency: f64, "1/s2; mean of x'x' by that of xx, like the next ones; x' is its rate";
        growth: f64, "1/s; mean of xx'";
        flow: f64, "m3/s; mean of xq, with the flow q";
        flow_rate: f64, "m3/s2; mean of xq'";
        rate_flow: f64, "m3/s2; mean of x'q";
        rate_flow_rate: f64, "m3/s3; mean of x'q'";
        compressed_flow: f64, "m3/s; rms flow that leaks and compresses the oil, by the rms opening";
        flow_error: f64, "m3/s; rms flow that the estimates leave unexplained";
        spool_error: f64, "1; rms opening that the estimates leave unexplained";
        flow_gain_distance: f64, "1; results of the least squares minus the estimates in use";
        valve_gain_distance: f64, "1";
        response_delay_distance: f64, "s";
        velocity_delay_distance: f64, "s";
        null_offset_distance: f64, "1";
        asymmetry: f64, "1; table flow per forward flow over the mean of both directions, less 1";
        asymmetry_deviation: f64, "1";
        departures: [f64; EFT_CURVE_NODES], "m3/s; from the direction, at -8/7 to 8/7 of the greatest flow";
        departure_deviations: [f64; EFT_CURVE_NODES], "m3/s";
        curve_error: f64, "m3/s; rms part of a window's flow that the correction leaves unexplained";
        flow_gain_share: f64, "1; share of the flow gain that follows from the departures";
        mean_departure: f64, "1; over the flow, which the flow gain slowly takes over";
        curve_time: f64, "s; remembered time of curve_error and sensor_offset";
        sensor_offset: f64, "1; spool's reading minus the commanded opening times the spool's gain";
        null_time: f64, "s; remembered time of the null offset, at the table's slope at null";
        null_coupling: f64, "1; share of it in which a direction's gain looks like a null offset";
    }
}
// The core's struct has the same fields.
const _: () = assert!(size_of::<eft_saved_calibration>() == size_of::<SavedCalibration>());

functions! {
    /// Like eft_configure, for a learner. The parameters are the channel's.
    fn eft_learner_configure_f32 eft_learner_configure_f64(parameters: *const eft_parameters, learner: *mut eft_learner<T>, why: *mut eft_error) {
        configure(parameters, learner, why)
    }

    /// Like eft_check, for a learner.
    fn eft_learner_check_f32 eft_learner_check_f64(learner: *const eft_learner<T>, parameters: *const eft_parameters) {
        check(learner, parameters)
    }

    /// Like eft_integrity, for a learner.
    fn eft_learner_integrity_f32 eft_learner_integrity_f64(learner: *const eft_learner<T>, word: *mut u32) {
        give(word, made(learner)?.integrity())
    }

    /// Like eft_state_integrity, for a learner's state. Compare the checksum after eft_learn with that before the next
    /// call.
    fn eft_learner_state_integrity_f32 eft_learner_state_integrity_f64(state: *const eft_learner_state<T>, word: *mut u32) {
        give(word, made(state)?.integrity())
    }

    /// Makes the state of a learner that has learned nothing yet.
    fn eft_learner_reset_f32 eft_learner_reset_f64(learner: *const eft_learner<T>, state: *mut eft_learner_state<T>) {
        make(state, made(learner)?.at_rest())
    }

    /// Like eft_learner_reset, but the learner starts from a saved calibration. Then start the channel by
    /// eft_first_calibration and eft_reset_with. Refuses data that the learner cannot have saved. *why (may be null)
    /// then has the reason.
    fn eft_start_from_f32 eft_start_from_f64(learner: *const eft_learner<T>, saved: *const eft_saved_calibration, state: *mut eft_learner_state<T>, why: *mut eft_error) {
        let saved = given(saved.cast::<SavedCalibration>())?;
        match made(learner)?.start_from(saved) {
            Ok(started) => make(state, started),
            Err(error) => Err(refuse(error, why)),
        }
    }

    /// Makes the calibration of the learner's present estimates, for eft_reset_with. Before anything is learned the
    /// channel then starts as after eft_reset.
    fn eft_first_calibration_f32 eft_first_calibration_f64(learner: *const eft_learner<T>, state: *const eft_learner_state<T>, calibration: *mut eft_calibration<T>) {
        let (core, state) = (made(learner)?, made(state)?);
        make(calibration, core.first_calibration(state))
    }

    /// Saves the calibration, after a test.
    fn eft_save_calibration_f32 eft_save_calibration_f64(learner: *const eft_learner<T>, state: *const eft_learner_state<T>, saved: *mut eft_saved_calibration) {
        let (core, state) = (made(learner)?, made(state)?);
        give(saved.cast(), core.saved(state))
    }

    /// Makes the next calibration from a window, for eft_publish. Call it after the step, or in a task of lower priority
    /// than the interrupt.
    fn eft_learn_f32 eft_learn_f64(learner: *const eft_learner<T>, state: *mut eft_learner_state<T>, window: *const eft_window<T>, calibration: *mut eft_calibration<T>) {
        let (core, state, window) = (made(learner)?, made_mut(state)?, made(window)?);
        if calibration.is_null() {
            return Err(EFT_NULL_POINTER);
        }
        make(calibration, core.update(state, window))
    }

    /// Reads the numbers of a calibration.
    fn eft_read_calibration_f32 eft_read_calibration_f64(calibration: *const eft_calibration<T>, learned: *mut eft_learned<T>) {
        let c = made(calibration)?;
        let d = &c.deviations;
        give(learned, eft_learned {
            flow_gain: c.flow_gain,
            valve_gain: c.valve_gain,
            response_delay: c.response_delay,
            velocity_delay: c.velocity_delay,
            null_offset: c.null_offset,
            flow_gain_deviation: d.flow_gain,
            valve_gain_deviation: d.valve_gain,
            response_delay_deviation: d.response_delay,
            velocity_delay_deviation: d.velocity_delay,
            null_offset_deviation: d.null_offset,
            level: c.level,
            test_ratio: c.test_ratio,
            window: c.window,
            status: c.status,
        })
    }

    /// Sets *flow to the learned no-load flow (m3/s) at a spool opening (1), for use after a test. At the openings of the
    /// table these are the rig's new flow curve. Beyond the table it is the flow of its end. Returns EFT_NOT_FINITE and
    /// leaves *flow unchanged if the opening is NaN or infinite.
    fn eft_found_flow_f32 eft_found_flow_f64(learner: *const eft_learner<T>, calibration: *const eft_calibration<T>, opening: T, flow: *mut T) {
        let (core, calibration) = (made(learner)?, made(calibration)?);
        if !opening.is_finite() {
            return Err(EFT_NOT_FINITE);
        }
        give(flow, core.found_flow(calibration, opening))
    }
}
