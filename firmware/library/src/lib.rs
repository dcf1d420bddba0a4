//! The C interface as a static library. A program with a reachable panic does not link, since the panic handler calls a
//! function that does not exist.
#![no_std]

pub use eft_ffi::*;

unsafe extern "C" {
    fn eft_a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // Safety: never linked.
    unsafe { eft_a_panic_is_reachable() }
}
