//! What a call returns.

use eft_core::ConfigError;

/// Done.
pub const OK: u8 = 0;
/// A pointer was null; nothing was done.
pub const NULL_POINTER: u8 = 1;
/// A parameter is NaN or infinite.
pub const NOT_FINITE: u8 = 2;
/// A parameter is zero or negative.
pub const NOT_POSITIVE: u8 = 3;
/// A parameter is outside its range.
pub const OUT_OF_RANGE: u8 = 4;
/// A table does not increase strictly.
pub const NOT_INCREASING: u8 = 5;
/// A table's length is not allowed.
pub const LENGTH: u8 = 6;
/// A table rises too steeply.
pub const TOO_STEEP: u8 = 7;
/// Another configuration is still waiting to be taken over.
pub const BUSY: u8 = 8;
/// The configuration was refused for a reason this version of the interface has no name for.
pub const REFUSED: u8 = 9;

pub(crate) fn of(error: &ConfigError) -> u8 {
    match error {
        ConfigError::NotFinite { .. } => NOT_FINITE,
        ConfigError::NotPositive { .. } => NOT_POSITIVE,
        ConfigError::OutOfRange { .. } => OUT_OF_RANGE,
        ConfigError::NotIncreasing { .. } => NOT_INCREASING,
        ConfigError::Length { .. } => LENGTH,
        ConfigError::TooSteep { .. } => TOO_STEEP,
        _ => REFUSED,
    }
}
