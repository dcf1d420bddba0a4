//! The C interface of the controller; `include/eft.h` says in C what stands here.
//!
//! Everything is owned by the caller and passed by pointer; there are no globals, so every function is re-entrant.
//! A null pointer gives [`status::NULL_POINTER`] and nothing else happens. Pointers that are not null must point to
//! what their type says, aligned, and a state must not be stepped by two threads at once.
#![no_std]
#![allow(non_camel_case_types)] // the names are C's

mod parameters;
mod precision;
mod shadow;
pub mod status;

pub use parameters::{TABLE_CAPACITY, eft_error, eft_parameters};
pub use precision::{double, single};

/// Changes with every incompatible change of the header.
pub const ABI_VERSION: u32 = 1;

/// The version this library was built with: compare it with `EFT_ABI_VERSION` once at start-up.
#[unsafe(no_mangle)]
pub extern "C" fn eft_abi_version() -> u32 {
    ABI_VERSION
}

// The other half of the header's assertions.
const _: () = {
    use core::mem::{offset_of, size_of};
    assert!(size_of::<eft_parameters>() == 480);
    assert!(offset_of!(eft_parameters, level) == 8);
    assert!(offset_of!(eft_parameters, openings) == 144);
    assert!(offset_of!(eft_parameters, flows) == 312);
    assert!(size_of::<eft_error>() == 56);
    assert!(size_of::<single::Config>() == 400 && size_of::<double::Config>() == 736);
    assert!(size_of::<single::State>() == 20 && size_of::<double::State>() == 40);
    assert!(size_of::<single::Input>() == 20 && size_of::<double::Input>() == 40);
    assert!(size_of::<single::Output>() == 12 && size_of::<double::Output>() == 24);
    assert!(size_of::<single::Shadow>() == 808 && size_of::<double::Shadow>() == 1480);
};
