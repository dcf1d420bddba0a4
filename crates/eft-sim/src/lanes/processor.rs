//! Selection at run time of code compiled for the processor. The bits are the same everywhere, because the
//! compiler neither fuses nor reorders operations, and `Num::plus` is fused on every processor.

/// Work that `Num::dispatch` compiles for several processors. `run` and all it calls must be `#[inline(always)]`.
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
pub(crate) fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Whether the processor has the parts of AVX-512 that `avx512.rs` uses.
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
pub(crate) fn has_avx512() -> bool {
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
