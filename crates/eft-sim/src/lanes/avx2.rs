//! Eight double-precision numbers side by side in two AVX2 registers.
//!
//! The bits are those of [`f64`]: each operation is the scalar one, lane by lane.

use core::arch::x86_64::*;
use core::mem::transmute;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use std::array;

use eft_core::{CELLS, Flags, Mask, Row, Scalar};

use crate::lanes::Num;
use crate::lanes::eight::eight;
use crate::lanes::processor::{Work, with_avx2};
use crate::lanes::table_rows::{self, Index};

/// Eight numbers. Only [`dispatch_wide`](crate::lanes::dispatch_wide) uses the type, after a check of the processor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eight([__m256d; 2]);

/// Eight truth values, all bits of a lane or none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightMask([__m256d; 2]);

/// Eight status words, each in the low half of a lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightFlags([__m256d; 2]);

/// The intrinsics need a processor with AVX2. These types exist only on such a processor.
macro_rules! avx2 {
    ($call:expr) => {
        // SAFETY: `dispatch_wide` uses the types of this module only on a processor with AVX2.
        unsafe { $call }
    };
}

/// The same for both halves. It is not a closure, because the compiler may not inline closures in code that
/// it considers rare. An intrinsic outside `dispatch` is then a call.
macro_rules! both {
    (|$half:pat_param| $number:expr) => {
        [
            {
                let $half: usize = 0;
                $number
            },
            {
                let $half: usize = 1;
                $number
            },
        ]
    };
}

/// Plain data of one size: eight 64-bit lanes.
#[inline(always)]
fn doubles(halves: [__m256d; 2]) -> [f64; 8] {
    // SAFETY: both are 64 bytes in which every bit pattern is a value.
    unsafe { transmute(halves) }
}
#[inline(always)]
fn words(halves: [__m256d; 2]) -> [u64; 8] {
    // SAFETY: as above.
    unsafe { transmute(halves) }
}
/// Combined in registers, because eight narrow stores to memory would stall one wide load.
#[inline(always)]
fn from_doubles(a: [f64; 8]) -> [__m256d; 2] {
    avx2!([_mm256_set_pd(a[3], a[2], a[1], a[0]), _mm256_set_pd(a[7], a[6], a[5], a[4])])
}
#[inline(always)]
fn from_words(lanes: [u64; 8]) -> [__m256d; 2] {
    // SAFETY: as above.
    unsafe { transmute(lanes) }
}

macro_rules! lanewise {
    ($($number:ident: $trait:ident $method:ident $intrinsic:ident),*) => {$(
        impl $trait for $number {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(both!(|i| avx2!($intrinsic(self.0[i], other.0[i]))))
            }
        }
    )*};
}
lanewise!(Eight: Add add _mm256_add_pd, Eight: Sub sub _mm256_sub_pd);
lanewise!(Eight: Mul mul _mm256_mul_pd, Eight: Div div _mm256_div_pd);
lanewise!(EightMask: BitAnd bitand _mm256_and_pd, EightMask: BitOr bitor _mm256_or_pd);
lanewise!(EightFlags: BitOr bitor _mm256_or_pd);

impl Num for Eight {
    #[inline(always)]
    fn plus(self, factor: Self, other: Self) -> Self {
        Self(both!(|i| avx2!(_mm256_fmadd_pd(factor.0[i], other.0[i], self.0[i]))))
    }
    fn dispatch<W: Work>(work: W) -> W::Output {
        // SAFETY: the type exists only on a processor with AVX2.
        unsafe { with_avx2(work) }
    }
    eight!(append);
    #[inline(always)]
    fn append_flags(to: &mut Vec<u32>, from: &[EightFlags], lane: usize) {
        // SAFETY: as in `append`.
        let words: &[[u64; 8]] = unsafe { core::slice::from_raw_parts(from.as_ptr().cast(), from.len()) };
        assert!(lane < 8);
        to.extend(words.iter().map(|lanes| lanes[lane] as u32));
    }
}

impl Neg for Eight {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(both!(|i| avx2!(_mm256_xor_pd(self.0[i], _mm256_set1_pd(-0.0)))))
    }
}

eight!();
impl PartialEq for EightMask {
    fn eq(&self, other: &Self) -> bool {
        words(self.0) == words(other.0)
    }
}
impl Not for EightMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let ones = Self::splat(true);
        Self(both!(|i| avx2!(_mm256_xor_pd(self.0[i], ones.0[i]))))
    }
}
impl Mask for EightMask {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self(from_words([if value { u64::MAX } else { 0 }; 8]))
    }
    #[inline(always)]
    fn any(self) -> bool {
        avx2!(_mm256_movemask_pd(_mm256_or_pd(self.0[0], self.0[1]))) != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        avx2!(_mm256_movemask_pd(_mm256_and_pd(self.0[0], self.0[1]))) == 0b1111
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        words(self.0).get(lane).is_some_and(|word| *word != 0)
    }
    #[inline(always)]
    fn from_lanes(mut f: impl FnMut(usize) -> bool) -> Self {
        Self(from_words(array::from_fn(|lane| if f(lane) { u64::MAX } else { 0 })))
    }
}

impl Default for EightFlags {
    #[inline(always)]
    fn default() -> Self {
        Self(from_words([0; 8]))
    }
}
impl Flags for EightFlags {
    #[inline(always)]
    fn lane(self, lane: usize) -> u32 {
        words(self.0).get(lane).map_or(0, |word| *word as u32)
    }
    #[inline(always)]
    fn from_lanes(mut f: impl FnMut(usize) -> u32) -> Self {
        Self(from_words(array::from_fn(|lane| u64::from(f(lane)))))
    }
}

impl Scalar for Eight {
    eight!(scalar);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(both!(|_| avx2!(_mm256_set1_pd(value))))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> EightMask {
        EightMask(both!(|i| avx2!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0[i], other.0[i]))))
    }
    #[inline(always)]
    fn le(self, other: Self) -> EightMask {
        EightMask(both!(|i| avx2!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0[i], other.0[i]))))
    }
    #[inline(always)]
    fn select(mask: EightMask, yes: Self, no: Self) -> Self {
        Self(both!(|i| avx2!(_mm256_blendv_pd(no.0[i], yes.0[i], mask.0[i]))))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(both!(|i| avx2!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0[i]))))
    }
    // The sign bits decide where the direction is not zero.
    #[inline(always)]
    fn times_sign_of(self, direction: Self) -> Self {
        Self(both!(|i| avx2!({
            let sign = _mm256_and_pd(direction.0[i], _mm256_set1_pd(-0.0));
            let directed = _mm256_cmp_pd::<_CMP_NEQ_OQ>(direction.0[i], _mm256_setzero_pd());
            _mm256_and_pd(_mm256_xor_pd(self.0[i], sign), directed)
        })))
    }
    // Of equal numbers and with NaN, these instructions give the second operand.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(both!(|i| avx2!(_mm256_max_pd(self.0[i], other.0[i]))))
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self(both!(|i| avx2!(_mm256_min_pd(self.0[i], other.0[i]))))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(both!(|i| avx2!(_mm256_sqrt_pd(self.0[i]))))
    }
    #[inline(always)]
    fn flag(mask: EightMask, bit: u32) -> EightFlags {
        let bits = from_words([u64::from(bit); 8]);
        EightFlags(both!(|i| avx2!(_mm256_and_pd(mask.0[i], bits[i]))))
    }
    #[inline(always)]
    fn select_flags(mask: EightMask, yes: EightFlags, no: EightFlags) -> EightFlags {
        EightFlags(both!(|i| avx2!(_mm256_blendv_pd(no.0[i], yes.0[i], mask.0[i]))))
    }
    #[inline(always)]
    fn at_least(words: EightFlags, least: EightFlags) -> EightMask {
        // As 64-bit integers, in which 32-bit words are never negative.
        !EightMask(both!(|i| avx2!({
            let (words, least) = (_mm256_castpd_si256(words.0[i]), _mm256_castpd_si256(least.0[i]));
            _mm256_castsi256_pd(_mm256_cmpgt_epi64(least, words))
        })))
    }
    #[inline(always)]
    fn cell(self) -> (Index, EightMask) {
        let half = |i: usize| {
            // Values outside the 32-bit integers, including NaN, become the smallest integer, which is not a
            // cell.
            avx2!({
                let cell = _mm_sub_epi32(_mm256_cvttpd_epi32(self.0[i]), _mm_set1_epi32(1));
                let nearest = _mm_min_epu32(cell, _mm_set1_epi32(CELLS as i32 - 1));
                let inside = _mm_cmpeq_epi32(nearest, cell);
                (_mm_slli_epi32::<3>(nearest), _mm256_castsi256_pd(_mm256_cvtepi32_epi64(inside)))
            })
        };
        let ((low, in_low), (high, in_high)) = (half(0), half(1));
        // SAFETY: both are 32 bytes in which every bit pattern is a value.
        let places = unsafe { transmute::<[__m128i; 2], [u32; 8]>([low, high]) };
        // SAFETY: `half` gives eight times a cell of the index.
        (unsafe { Index::new(places) }, EightMask([in_low, in_high]))
    }
}
