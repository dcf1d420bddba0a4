#![doc = include_str!("../README.md")]
#![no_std]
#![allow(non_camel_case_types)] // the names are C's
#![allow(clippy::missing_safety_doc)] // one contract for all, above

mod channel;
mod codes;
mod constants;
mod exchange;
mod learner;
mod macros;
mod opaque;
mod parameters;

pub use channel::*;
pub use codes::*;
pub use exchange::*;
pub use learner::*;
pub use parameters::*;

/// Changes with every incompatible change of the header.
pub const EFT_ABI_VERSION: u32 = 6;

/// The version this library was built with: compare it with EFT_ABI_VERSION once at start-up.
#[must_use]
#[unsafe(no_mangle)]
pub extern "C" fn eft_abi_version() -> u32 {
    EFT_ABI_VERSION
}
