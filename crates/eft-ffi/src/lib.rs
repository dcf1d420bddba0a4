//! The C interface of the controller; `include/eft.h` says in C what stands here.
//!
//! Everything is owned by the caller and passed by pointer; there are no globals, so every function is re-entrant.
//! A null pointer gives [`EFT_NULL_POINTER`] and nothing else happens. Pointers that are not null must point to what
//! their type says, aligned, and a state must not be stepped by two threads at once.
//!
//! The header is made from these sources, comments included: `tests/header.rs` holds the committed one against them.
#![no_std]
#![allow(non_camel_case_types)] // the names are C's
#![allow(clippy::missing_safety_doc)] // one contract for all, above

mod adaptive;
mod block;
mod parameters;
mod precision;
mod protection;
mod shadow;
mod status;
mod stuck;
mod velocity;

pub use adaptive::*;
pub use parameters::*;
pub use precision::*;
pub use protection::*;
pub use shadow::eft_turn;
pub use status::*;
pub use stuck::*;
pub use velocity::*;

/// Changes with every incompatible change of the header.
pub const EFT_ABI_VERSION: u32 = 5;

/// The version this library was built with: compare it with EFT_ABI_VERSION once at start-up.
#[unsafe(no_mangle)]
pub extern "C" fn eft_abi_version() -> u32 {
    EFT_ABI_VERSION
}

// The other half of the header's assertions.
const _: () = {
    use core::mem::{offset_of, size_of};
    assert!(size_of::<eft_parameters>() == 480);
    assert!(offset_of!(eft_parameters, level) == 8);
    assert!(offset_of!(eft_parameters, openings) == 144);
    assert!(offset_of!(eft_parameters, flows) == 312);
    assert!(size_of::<eft_error>() == 56 && offset_of!(eft_error, parameter) == 28);
    assert!(size_of::<eft_controller_f32>() == 400 && size_of::<eft_controller_f64>() == 736);
    assert!(size_of::<eft_state_f32>() == 20 && size_of::<eft_state_f64>() == 40);
    assert!(size_of::<eft_input_f32>() == 20 && size_of::<eft_input_f64>() == 40);
    assert!(offset_of!(eft_input_f32, further_flow) == 16 && offset_of!(eft_output_f32, status) == 8);
    assert!(size_of::<eft_output_f32>() == 12 && size_of::<eft_output_f64>() == 24);
    assert!(size_of::<eft_adaptive_parameters>() == 512 && offset_of!(eft_adaptive_parameters, parts) == 508);
    assert!(size_of::<eft_adaptive_f32>() == 1152 && size_of::<eft_adaptive_f64>() == 2304);
    assert!(size_of::<eft_adaptive_state_f32>() == 1088 && size_of::<eft_adaptive_state_f64>() == 2176);
    assert!(size_of::<eft_adaptive_input_f32>() == 24 && size_of::<eft_adaptive_input_f64>() == 48);
    assert!(size_of::<eft_learned_f32>() == 16 && size_of::<eft_learned_f64>() == 32);
    assert!(size_of::<eft_derivative_parameters>() == 16 && size_of::<eft_observer_parameters>() == 32);
    assert!(size_of::<eft_derivative_f32>() == 16 && size_of::<eft_derivative_f64>() == 32);
    assert!(size_of::<eft_derivative_state_f32>() == 16 && size_of::<eft_derivative_state_f64>() == 32);
    assert!(size_of::<eft_observer_f32>() == 32 && size_of::<eft_observer_f64>() == 64);
    assert!(size_of::<eft_observer_state_f32>() == 32 && size_of::<eft_observer_state_f64>() == 64);
    assert!(size_of::<eft_protection_parameters>() == 112);
    assert!(offset_of!(eft_protection_parameters, fault_time) == 104);
    assert!(size_of::<eft_protection_f32>() == 96 && size_of::<eft_protection_f64>() == 192);
    assert!(size_of::<eft_protection_state_f32>() == 64 && size_of::<eft_protection_state_f64>() == 128);
    assert!(size_of::<eft_protection_input_f32>() == 20 && size_of::<eft_protection_input_f64>() == 40);
    assert!(size_of::<eft_permitted_f32>() == 12 && size_of::<eft_permitted_f64>() == 24);
    assert!(size_of::<eft_stuck_parameters>() == 4);
    assert!(size_of::<eft_stuck_f32>() == 8 && size_of::<eft_stuck_f64>() == 16);
    assert!(size_of::<eft_stuck_state_f32>() == 32 && size_of::<eft_stuck_state_f64>() == 64);
    assert!(size_of::<eft_shadow_f32>() == 808 && size_of::<eft_shadow_f64>() == 1480);
};
