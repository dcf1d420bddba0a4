//! Selection at run time of code compiled for the processor. The bits are the same everywhere, because the
//! compiler neither fuses nor reorders operations, and [`Num::plus`] is fused on every processor.

use eft_core::Scalar;

use crate::lanes::Num;
#[cfg(target_arch = "x86_64")]
use crate::lanes::avx2;
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
use crate::lanes::avx512;

/// Work that [`Num::dispatch`] compiles for several processors. `run` and all it calls must be `#[inline(always)]`.
pub trait Work {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs `work` with AVX2 where the processor has it. No number of `work` may need it.
#[inline]
pub(crate) fn with_best_instructions<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the processor has the instructions that the function may use.
        return unsafe { with_avx2(work) };
    }
    work.run()
}

/// Whether the processor has AVX2 and fused multiply-add, which all processors with AVX2 have.
#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Whether the processor has the parts of AVX-512 that [`avx512`] uses.
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
pub(crate) fn with_avx512<W: Work>(work: W) -> W::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn with_avx2<W: Work>(work: W) -> W::Output {
    work.run()
}

/// Work for several rigs side by side, with their number chosen at run time.
pub(crate) trait WideWork {
    type Output;
    fn run<S: Num>(self) -> Self::Output;
}

/// Number of rigs that run side by side on this processor: 1 if more are not faster.
pub(crate) fn width() -> usize {
    #[cfg(target_arch = "x86_64")]
    return if has_avx2() { avx2::Eight::LANES } else { 1 };
    #[cfg(not(target_arch = "x86_64"))]
    Four::LANES
}

/// Two per register on other processors.
#[cfg(not(target_arch = "x86_64"))]
type Four = eft_core::Lanes<f64, 4>;

/// Runs `work` with [`width`] numbers side by side; `None` if the width is 1.
///
/// Test builds use AVX2 on every processor, because a second type lengthens their compilation. The
/// check of the finished wheel compares the bits.
pub(crate) fn dispatch_wide<W: WideWork>(work: W) -> Option<W::Output> {
    #[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
    if has_avx512() {
        return Some(work.run::<avx512::Eight>());
    }
    #[cfg(target_arch = "x86_64")]
    return has_avx2().then(|| work.run::<avx2::Eight>());
    #[cfg(not(target_arch = "x86_64"))]
    Some(work.run::<Four>())
}
