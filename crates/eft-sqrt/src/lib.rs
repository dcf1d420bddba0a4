#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod unit {
    // For calls that the compiler does not replace. Weak, because a C library may have its own.
    core::arch::global_asm!(
        ".section .text.sqrtf, \"ax\"",
        ".weak sqrtf",
        ".type sqrtf, %function",
        ".thumb_func",
        "sqrtf:",
        ".inst.w 0xeeb10ac0", // vsqrt.f32 s0, s0; as a number, because the assembler does not know the FPU
        "bx lr",
        ".size sqrtf, . - sqrtf",
    );
    unsafe extern "C" {
        pub(crate) safe fn sqrtf(x: f32) -> f32;
    }
}

/// √x (root of the unit of `x`), correctly rounded on every target.
///
/// # NaN
/// NaN for NaN and for negative numbers; −0 for −0.
///
/// # Cost
/// On ARM with a hardware float ABI one `vsqrt.f32`, if the compiler can prove that `x` is not negative (at opt-level
/// 3), otherwise a call of it. On other targets `libm`.
#[inline(always)]
pub fn sqrtf(x: f32) -> f32 {
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    return unit::sqrtf(x);
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    return libm::sqrtf(x);
}
