//! The return codes, and the one flag of a status that the core does not have.

use crate::constants::constants;

constants! { u8:
    EFT_OK = 0, "Done.";
    EFT_NULL_POINTER = 1, "A pointer is null.";
    EFT_NOT_FINITE = 2, "A parameter is NaN or infinite.";
    EFT_NOT_POSITIVE = 3, "A parameter is zero or negative.";
    EFT_OUT_OF_RANGE = 4, "A parameter is outside its range.";
    EFT_NOT_INCREASING = 5, "A table does not increase strictly.";
    EFT_LENGTH = 6, "A table's length is not allowed.";
    EFT_TOO_STEEP = 7, "A table rises too steeply.";
    EFT_BUSY = 8, "The last offer has not been taken yet.";
    EFT_REFUSED = 9, "A parameter was refused for a reason that has no code.";
    EFT_CORRUPT = 10, "The configuration differs from one that is made from its parameters.";
    EFT_NOT_MADE = 11, "An opaque struct was never configured, reset or filled.";
}

/// The step was refused; its return code has the reason, and the output is 0 V.
pub const EFT_NO_STEP: u32 = 1u32 << 31;

/// The return code of a result.
#[inline(always)]
pub(crate) fn code(result: Result<(), u8>) -> u8 {
    match result {
        Ok(()) => EFT_OK,
        Err(code) => code,
    }
}
