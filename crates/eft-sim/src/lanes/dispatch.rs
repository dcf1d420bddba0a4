//! The number of rigs side by side, by the processor.

use eft_core::Scalar;

use crate::lanes::Num;
#[cfg(target_arch = "x86_64")]
use crate::lanes::avx2;
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
use crate::lanes::avx512;
#[cfg(target_arch = "x86_64")]
use crate::lanes::processor::has_avx2;
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
use crate::lanes::processor::has_avx512;

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
