//! The correctly rounded square root of an `f32`, without `std`.
//!
//! Stable Rust has none for bare metal: `core::f32::math::sqrt` is unstable, and `libm`'s is software (about 50
//! instructions) where `vsqrt.f32` is one. This crate exists so that the one `unsafe` line that reaches it stays
//! outside `eft-core`, which forbids them.
#![no_std]

/// √x in the unit's root, correctly rounded on every target.
///
/// # NaN
/// NaN for NaN and for negative numbers; −0 for −0.
///
/// # Cost
/// On ARM with a hardware float ABI: `vsqrt.f32` and two to four register moves. `libm` elsewhere.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
#[allow(unsafe_code)]
pub fn sqrtf(x: f32) -> f32 {
    let mut bits = x.to_bits();
    // `sreg` operands are refused on these targets, so the number goes through a core register.
    // Safety: every target with this ABI has an FPU with `vsqrt.f32`; it touches no memory, and `s0` is declared.
    unsafe {
        core::arch::asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inout(reg) bits,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(bits)
}

/// √x in the unit's root, correctly rounded on every target.
///
/// # NaN
/// NaN for NaN and for negative numbers; −0 for −0.
///
/// # Cost
/// On ARM with a hardware float ABI: `vsqrt.f32` and two to four register moves. `libm` elsewhere.
#[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
#[inline(always)]
pub fn sqrtf(x: f32) -> f32 {
    libm::sqrtf(x)
}
