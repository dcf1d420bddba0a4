//! Links only if no exported function can panic, since the panic handler calls a function that does not exist.
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
    keep!(eft_calibration_in_use_f32 eft_check_f32 eft_configure_f32 eft_first_calibration_f32 eft_found_flow_f32 eft_hold_f32
        eft_input_init_f32 eft_integrity_f32 eft_is_down_f32 eft_learn_f32 eft_learner_check_f32 eft_learner_configure_f32
        eft_learner_integrity_f32 eft_learner_reset_f32 eft_learner_state_integrity_f32 eft_missed_f32 eft_offer_calibration_f32 eft_offer_channel_f32
        eft_offer_window_f32 eft_prime_f32 eft_publish_f32 eft_read_calibration_f32 eft_request_end_f32
        eft_request_trip_f32 eft_reset_f32 eft_reset_with_f32
        eft_save_calibration_f32 eft_start_from_f32 eft_state_integrity_f32 eft_step_f32 eft_take_calibration_f32 eft_take_channel_f32
        eft_take_over_f32 eft_take_window_f32);
    keep!(eft_calibration_in_use_f64 eft_check_f64 eft_configure_f64 eft_first_calibration_f64 eft_found_flow_f64 eft_hold_f64
        eft_input_init_f64 eft_integrity_f64 eft_is_down_f64 eft_learn_f64 eft_learner_check_f64 eft_learner_configure_f64
        eft_learner_integrity_f64 eft_learner_reset_f64 eft_learner_state_integrity_f64 eft_missed_f64 eft_offer_calibration_f64 eft_offer_channel_f64
        eft_offer_window_f64 eft_prime_f64 eft_publish_f64 eft_read_calibration_f64 eft_request_end_f64
        eft_request_trip_f64 eft_reset_f64 eft_reset_with_f64
        eft_save_calibration_f64 eft_start_from_f64 eft_state_integrity_f64 eft_step_f64 eft_take_calibration_f64 eft_take_channel_f64
        eft_take_over_f64 eft_take_window_f64);
    #[cfg(feature = "panic")]
    black_box([1, 2, 3][black_box(n)]);
    black_box(n);
}
