#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod unit {
    // What a call is answered with where the compiler leaves one. Weak: a C library may bring its own.
    core::arch::global_asm!(
        ".section .text.sqrtf, \"ax\"",
        ".weak sqrtf",
        ".type sqrtf, %function",
        ".thumb_func",
        "sqrtf:",
        ".inst.w 0xeeb10ac0", // vsqrt.f32 s0, s0; the assembler is not told of the FPU
        "bx lr",
        ".size sqrtf, . - sqrtf",
    );
    unsafe extern "C" {
        pub(crate) safe fn sqrtf(x: f32) -> f32;
    }
}

/// √x in the unit's root, correctly rounded on every target.
///
/// # NaN
/// NaN for NaN and for negative numbers; −0 for −0.
///
/// # Cost
/// On ARM with a hardware float ABI: `vsqrt.f32` alone where the compiler sees that `x` is not negative (at opt-level
/// 3), a call of it elsewhere. On other targets `libm`.
#[inline(always)]
pub fn sqrtf(x: f32) -> f32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    return unit::sqrtf(x);
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    return libm::sqrtf(x);
}
