//! What a call returns, and the bits of an output's status.

use eft_core::{ConfigError, status};

/// Done.
pub const EFT_OK: u8 = 0;
/// A pointer was null; nothing was done.
pub const EFT_NULL_POINTER: u8 = 1;
/// A parameter is NaN or infinite.
pub const EFT_NOT_FINITE: u8 = 2;
/// A parameter is zero or negative.
pub const EFT_NOT_POSITIVE: u8 = 3;
/// A parameter is outside its range.
pub const EFT_OUT_OF_RANGE: u8 = 4;
/// A table does not increase strictly.
pub const EFT_NOT_INCREASING: u8 = 5;
/// A table's length is not allowed.
pub const EFT_LENGTH: u8 = 6;
/// A table rises too steeply.
pub const EFT_TOO_STEEP: u8 = 7;
/// Another configuration is still waiting to be taken over.
pub const EFT_BUSY: u8 = 8;
/// The configuration was refused for a reason this version of the interface has no name for.
pub const EFT_REFUSED: u8 = 9;
/// The configuration is not what its parameters make.
pub const EFT_CORRUPT: u8 = 10;
/// A parameter is no whole number.
pub const EFT_NOT_WHOLE: u8 = 11;

/// Measured or required spool opening beyond the warning level.
pub const EFT_SPOOL_WARNING: u32 = 1 << 0;
/// The demanded flow lies beyond the flow table, or the required opening beyond the spool's stroke.
pub const EFT_DEMAND_SATURATED: u32 = 1 << 1;
/// The load-pressure correction is at its limit.
pub const EFT_LOAD_PRESSURE_FLOORED: u32 = 1 << 2;
/// The valve command was cut to its limit.
pub const EFT_COMMAND_LIMITED: u32 = 1 << 3;
/// The valve command's rate was cut to its limit.
pub const EFT_RATE_LIMITED: u32 = 1 << 4;
/// A measurement was not finite or out of its range; the last output is held.
pub const EFT_INVALID_MEASUREMENT: u32 = 1 << 5;
/// The force command was not finite; the last output is held, or a protection follows the last valid command.
pub const EFT_INVALID_COMMAND: u32 = 1 << 6;
/// The output was held on request.
pub const EFT_HELD: u32 = 1 << 7;
/// The tick was missed; the last output is held.
pub const EFT_MISSED_TICK: u32 = 1 << 11;
/// eft_output.status, adaptive: the estimators stand still, after a bad measurement or where their models do not
/// explain what is measured.
pub const EFT_ADAPTATION_FROZEN: u32 = 1 << 12;
/// eft_output.status, adaptive: an estimate stands at one of its bounds.
pub const EFT_ESTIMATE_BOUNDED: u32 = 1 << 13;
/// eft_output.status, adaptive: the overcompensation guard has taken the compensation level back.
pub const EFT_LEVEL_REDUCED: u32 = 1 << 14;
/// A measurement is beyond its warning level of the protection.
pub const EFT_PROTECTION_WARNING: u32 = 1 << 15;
/// The protection has tripped: the force command is frozen and taken to zero.
pub const EFT_TRIPPED: u32 = 1 << 16;
/// The protection takes the whole valve command to zero.
pub const EFT_SHUT_DOWN: u32 = 1 << 17;
/// A measurement repeats itself to the last bit: its sensor or converter is frozen.
pub const EFT_STUCK_MEASUREMENT: u32 = 1 << 18;

// Spelt out above, because the header takes them literally.
const _: () = {
    assert!(EFT_SPOOL_WARNING == status::SPOOL_WARNING);
    assert!(EFT_DEMAND_SATURATED == status::DEMAND_SATURATED);
    assert!(EFT_LOAD_PRESSURE_FLOORED == status::LOAD_PRESSURE_FLOORED);
    assert!(EFT_COMMAND_LIMITED == status::COMMAND_LIMITED);
    assert!(EFT_RATE_LIMITED == status::RATE_LIMITED);
    assert!(EFT_INVALID_MEASUREMENT == status::INVALID_MEASUREMENT);
    assert!(EFT_INVALID_COMMAND == status::INVALID_COMMAND);
    assert!(EFT_HELD == status::HELD);
    assert!(EFT_MISSED_TICK == status::MISSED_TICK);
    assert!(EFT_ADAPTATION_FROZEN == status::ADAPTATION_FROZEN);
    assert!(EFT_ESTIMATE_BOUNDED == status::ESTIMATE_BOUNDED);
    assert!(EFT_LEVEL_REDUCED == status::LEVEL_REDUCED);
    assert!(EFT_PROTECTION_WARNING == status::PROTECTION_WARNING);
    assert!(EFT_TRIPPED == status::TRIPPED);
    assert!(EFT_SHUT_DOWN == status::SHUT_DOWN);
    assert!(EFT_STUCK_MEASUREMENT == status::STUCK_MEASUREMENT);
};

pub(crate) fn of(error: &ConfigError) -> u8 {
    match error {
        ConfigError::NotFinite { .. } => EFT_NOT_FINITE,
        ConfigError::NotPositive { .. } => EFT_NOT_POSITIVE,
        ConfigError::OutOfRange { .. } => EFT_OUT_OF_RANGE,
        ConfigError::NotWhole { .. } => EFT_NOT_WHOLE,
        ConfigError::NotIncreasing { .. } => EFT_NOT_INCREASING,
        ConfigError::Length { .. } => EFT_LENGTH,
        ConfigError::TooSteep { .. } => EFT_TOO_STEEP,
        _ => EFT_REFUSED,
    }
}
