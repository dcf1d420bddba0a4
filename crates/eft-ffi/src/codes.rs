//! What a call returns, and the bits of an output's status.

use eft_core::ConfigError;

use crate::tables::{causes, constants, flags};

constants! { u8:
    EFT_OK = 0, "done";
    EFT_NULL_POINTER = 1, "a pointer is null";
    EFT_NOT_FINITE = 2, "a parameter is NaN or infinite";
    EFT_NOT_POSITIVE = 3, "a parameter is zero or negative";
    EFT_OUT_OF_RANGE = 4, "a parameter is outside its range";
    EFT_NOT_INCREASING = 5, "a table does not increase strictly";
    EFT_LENGTH = 6, "a table's length is not allowed";
    EFT_TOO_STEEP = 7, "a table rises too steeply";
    EFT_BUSY = 8, "what was offered before has not been taken yet";
    EFT_REFUSED = 9, "a parameter was refused for a reason that has no code";
    EFT_CORRUPT = 10, "the configuration is not what its parameters make";
    EFT_NOT_MADE = 11, "an opaque struct was never made: not configured, not reset, not filled";
}

flags! {
    EFT_SPOOL_WARNING = 0, SPOOL_WARNING, "measured or required spool opening beyond its warning level";
    EFT_DEMAND_SATURATED = 1, DEMAND_SATURATED, "demanded flow beyond the flow table, or opening beyond the stroke";
    EFT_LOAD_PRESSURE_FLOORED = 2, LOAD_PRESSURE_FLOORED, "the load-pressure correction is at its limit";
    EFT_COMMAND_LIMITED = 3, COMMAND_LIMITED, "the valve command was cut to its limit";
    EFT_RATE_LIMITED = 4, RATE_LIMITED, "the valve command's rate was cut to its limit";
    EFT_INVALID_MEASUREMENT = 5, INVALID_MEASUREMENT, "not finite or out of range; the last output is held";
    EFT_INVALID_COMMAND = 6, INVALID_COMMAND, "not finite; the last output is held, or the last valid command followed";
    EFT_HELD = 7, HELD, "the output was held on request";
    EFT_MISSED_TICK = 11, MISSED_TICK, "a tick was missed, or its sample is old or at the wrong time";
    EFT_ADAPTATION_FROZEN = 12, ADAPTATION_FROZEN, "nothing is learned: bad samples, or the models do not explain them";
    EFT_ESTIMATE_BOUNDED = 13, ESTIMATE_BOUNDED, "an estimate stands at one of its bounds";
    EFT_LEVEL_REDUCED = 14, LEVEL_REDUCED, "the guard has taken the compensation level back";
    EFT_PROTECTION_WARNING = 15, PROTECTION_WARNING, "a measurement is beyond its warning level";
    EFT_TRIPPED = 16, TRIPPED, "the force command is frozen and taken to zero";
    EFT_SHUT_DOWN = 17, SHUT_DOWN, "the whole valve command is taken to zero";
    EFT_STUCK_MEASUREMENT = 18, STUCK_MEASUREMENT, "a measurement repeats itself to the last bit";
    EFT_CALIBRATION_LATE = 19, CALIBRATION_LATE, "the learner's last calibration came late, or is missing";
    EFT_FORCE_LOOP_OPEN = 20, FORCE_LOOP_OPEN, "the force loop is open; an analog controller has to open its own";
    EFT_FORCE_DISTRUSTED = 21, FORCE_DISTRUSTED, "the force is not believed";
    EFT_DISPLACEMENT_DISTRUSTED = 22, DISPLACEMENT_DISTRUSTED, "the displacement is not believed";
    EFT_VELOCITY_DISTRUSTED = 23, VELOCITY_DISTRUSTED, "the velocity is not believed";
    EFT_SPOOL_DISTRUSTED = 24, SPOOL_DISTRUSTED, "the spool opening is not believed";
    EFT_CALIBRATION_EXPIRED = 25, CALIBRATION_EXPIRED, "the calibration is older than its age limit";
}

/// bits of a status that hold the first cause of a trip
pub const EFT_CAUSE: u32 = 0x1fu32 << 26u32;
/// where they begin: (status & EFT_CAUSE) >> EFT_CAUSE_SHIFT is one of EFT_CAUSE_...
pub const EFT_CAUSE_SHIFT: u32 = 26;
const _: () =
    assert!(EFT_CAUSE == eft_core::status::CAUSE && EFT_CAUSE_SHIFT == eft_core::status::CAUSE_SHIFT);

causes! {
    EFT_CAUSE_NONE = 0, None, "trip: none";
    EFT_CAUSE_REQUEST = 1, Request, "trip: a request from outside";
    EFT_CAUSE_FORCE_LEVEL = 2, ForceLevel, "trip: the force is beyond its trip level";
    EFT_CAUSE_DISPLACEMENT_LEVEL = 3, DisplacementLevel, "trip: the displacement is beyond its trip level";
    EFT_CAUSE_VELOCITY_LEVEL = 4, VelocityLevel, "trip: the velocity is beyond its trip level";
    EFT_CAUSE_SPOOL_LEVEL = 5, SpoolLevel, "trip: the spool opening is beyond its trip level";
    EFT_CAUSE_COMMAND_LOST = 6, CommandLost, "trip: the force command stayed lost";
    EFT_CAUSE_MEASUREMENT_LOST = 7, MeasurementLost, "trip: measurements stayed lost";
    EFT_CAUSE_REFUSED = 8, Refused, "trip: the controller kept refusing its samples";
    EFT_CAUSE_MODEL_CONTRADICTED = 9, ModelContradicted, "trip: the measurements kept contradicting the learner's models";
    EFT_CAUSE_FORCE_LOST = 10, ForceLost, "trip: the force stayed lost";
    EFT_CAUSE_DISPLACEMENT_LOST = 11, DisplacementLost, "trip: the displacement stayed lost";
    EFT_CAUSE_VELOCITY_LOST = 12, VelocityLost, "trip: the velocity stayed lost";
    EFT_CAUSE_SPOOL_LOST = 13, SpoolLost, "trip: the spool opening stayed lost";
    EFT_CAUSE_FORCE_IMPLAUSIBLE = 14, ForceImplausible, "trip: the force contradicts the other measurements";
    EFT_CAUSE_DISPLACEMENT_IMPLAUSIBLE = 15, DisplacementImplausible, "trip: the displacement contradicts the others";
    EFT_CAUSE_VELOCITY_IMPLAUSIBLE = 16, VelocityImplausible, "trip: the velocity contradicts the others";
    EFT_CAUSE_SPOOL_IMPLAUSIBLE = 17, SpoolImplausible, "trip: the spool opening contradicts the others";
    EFT_CAUSE_FLOW_IMPLAUSIBLE = 18, FlowImplausible, "trip: the valve's flow is not the piston's; check supply, valve and flow curve";
    EFT_CAUSE_VALVE_IMPLAUSIBLE = 19, ValveImplausible, "trip: the spool does not follow its command";
    EFT_CAUSE_STATE_CORRUPT = 20, StateCorrupt, "trip: a latch in memory was changed from outside";
    EFT_CAUSE_SAMPLES_OLD = 21, SamplesOld, "trip: the alive counter stood still or skipped";
    EFT_CAUSE_SAMPLE_PERIOD = 22, SamplePeriod, "trip: the measured sample period is off";
    EFT_CAUSE_CALIBRATION_EXPIRED = 23, CalibrationExpired, "trip: the learner published nothing for too long";
    EFT_CAUSE_FORCE_OSCILLATION = 24, ForceOscillation, "trip: the force loop shakes the oil column";
}

/// the step was refused, and its code says why; the output is 0 V
pub const EFT_NO_STEP: u32 = 1u32 << 31;

/// What a call returns.
#[inline(always)]
pub(crate) fn returned(call: impl FnOnce() -> Result<(), u8>) -> u8 {
    match call() {
        Ok(()) => EFT_OK,
        Err(code) => code,
    }
}

/// The code of a refused parameter.
pub(crate) fn of(error: &ConfigError) -> u8 {
    match error {
        ConfigError::NotFinite { .. } => EFT_NOT_FINITE,
        ConfigError::NotPositive { .. } => EFT_NOT_POSITIVE,
        ConfigError::OutOfRange { .. } => EFT_OUT_OF_RANGE,
        ConfigError::NotIncreasing { .. } => EFT_NOT_INCREASING,
        ConfigError::TooSteep { .. } => EFT_TOO_STEEP,
        ConfigError::Length { .. } => EFT_LENGTH,
        _ => EFT_REFUSED,
    }
}
