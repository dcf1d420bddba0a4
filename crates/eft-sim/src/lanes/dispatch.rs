//! Code compiled for the processor it runs on, chosen at run time. The bits are the same everywhere: nothing here
//! lets the compiler fuse or reorder, and what [`Num::plus`] fuses is fused on every processor.

#[cfg(target_arch = "x86_64")]
use std::any::TypeId;

use eft_core::Scalar;

use crate::lanes::Num;
#[cfg(target_arch = "x86_64")]
use crate::lanes::eight::Eight;

/// Something to be compiled several times. `run` and all it calls must be `#[inline(always)]`.
pub(crate) trait Work {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs `work`, whose numbers are `S`, with the instructions that this processor has.
#[inline]
pub(crate) fn dispatch<S: Num, W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if TypeId::of::<S>() == TypeId::of::<Eight>() || has_avx2() {
        // SAFETY: the processor has the instructions that the function may use, or there would be no `Eight`.
        return unsafe { with_avx2(work) };
    }
    work.run()
}

/// Whether the processor has AVX2 and, as all that have it do, the fused multiplication and addition.
#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<W: Work>(work: W) -> W::Output {
    work.run()
}

/// Something to be done with several rigs side by side, the number of them chosen at run time.
pub(crate) trait WideWork {
    type Output;
    fn run<S: Num>(self) -> Self::Output;
}

/// How many rigs run side by side on this processor: one where nothing is gained by more.
pub(crate) fn width() -> usize {
    #[cfg(target_arch = "x86_64")]
    return if has_avx2() { Eight::LANES } else { 1 };
    #[cfg(not(target_arch = "x86_64"))]
    Four::LANES
}

/// Two to a register on processors of other kinds.
#[cfg(not(target_arch = "x86_64"))]
type Four = eft_core::Lanes<f64, 4>;

/// Runs `work` with [`width`] numbers side by side; none where that is one.
pub(crate) fn dispatch_wide<W: WideWork>(work: W) -> Option<W::Output> {
    #[cfg(target_arch = "x86_64")]
    return has_avx2().then(|| work.run::<Eight>());
    #[cfg(not(target_arch = "x86_64"))]
    Some(work.run::<Four>())
}
