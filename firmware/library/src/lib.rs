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

/// The compiler's support library of a host refers to it. No program calls it, since no panic is reachable.
#[cfg(not(target_os = "none"))]
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}
