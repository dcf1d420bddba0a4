//! Links only if no exported function can panic: the panic handler calls what does not exist.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use eft_ffi::*;

unsafe extern "C" {
    fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // Safety: never linked.
    unsafe { a_panic_is_reachable() }
}

/// Every exported function, kept by its address.
#[unsafe(no_mangle)]
pub extern "C" fn eft_proof(n: usize) {
    black_box(eft_abi_version as *const () as usize);
    macro_rules! keep {
        ($($function:ident)*) => { $(black_box($function as *const () as usize);)* };
    }
    keep!(eft_adaptive_check_f32 eft_adaptive_compensation_step_f32
        eft_adaptive_compensation_step_ahead_f32 eft_adaptive_configure_f32
        eft_adaptive_flow_f32 eft_adaptive_hold_f32 eft_adaptive_learned_f32 eft_adaptive_missed_f32
        eft_adaptive_prime_f32 eft_adaptive_reset_f32 eft_adaptive_step_f32 eft_adaptive_step_ahead_f32 eft_check_f32
        eft_compensation_step_f32 eft_configure_f32 eft_derivative_check_f32 eft_derivative_configure_f32
        eft_derivative_reset_f32 eft_derivative_step_f32 eft_hold_f32 eft_missed_f32 eft_observer_check_f32
        eft_observer_configure_f32 eft_observer_reset_f32 eft_observer_step_f32 eft_prime_f32
        eft_protection_apply_f32 eft_protection_check_f32 eft_protection_configure_f32 eft_protection_end_f32
        eft_protection_is_down_f32 eft_protection_preview_f32 eft_protection_reset_f32 eft_protection_step_f32 eft_protection_trip_f32
        eft_reset_f32 eft_shadow_init_f32 eft_shadow_offer_f32 eft_shadow_take_f32 eft_step_f32
        eft_stuck_check_f32 eft_stuck_configure_f32 eft_stuck_reset_f32 eft_stuck_step_f32);
    keep!(eft_adaptive_check_f64 eft_adaptive_compensation_step_f64
        eft_adaptive_compensation_step_ahead_f64 eft_adaptive_configure_f64
        eft_adaptive_flow_f64 eft_adaptive_hold_f64 eft_adaptive_learned_f64 eft_adaptive_missed_f64
        eft_adaptive_prime_f64 eft_adaptive_reset_f64 eft_adaptive_step_f64 eft_adaptive_step_ahead_f64 eft_check_f64
        eft_compensation_step_f64 eft_configure_f64 eft_derivative_check_f64 eft_derivative_configure_f64
        eft_derivative_reset_f64 eft_derivative_step_f64 eft_hold_f64 eft_missed_f64 eft_observer_check_f64
        eft_observer_configure_f64 eft_observer_reset_f64 eft_observer_step_f64 eft_prime_f64
        eft_protection_apply_f64 eft_protection_check_f64 eft_protection_configure_f64 eft_protection_end_f64
        eft_protection_is_down_f64 eft_protection_preview_f64 eft_protection_reset_f64 eft_protection_step_f64 eft_protection_trip_f64
        eft_reset_f64 eft_shadow_init_f64 eft_shadow_offer_f64 eft_shadow_take_f64 eft_step_f64
        eft_stuck_check_f64 eft_stuck_configure_f64 eft_stuck_reset_f64 eft_stuck_step_f64);
    #[cfg(feature = "panic")]
    black_box([1, 2, 3][black_box(n)]);
    black_box(n);
}
