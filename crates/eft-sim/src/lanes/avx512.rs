//! Eight double-precision numbers side by side in one AVX-512 register.
//!
//! The bits are those of [`f64`]: each operation is the scalar one, lane by lane.

use core::arch::x86_64::*;
use core::mem::transmute;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use std::array;

use eft_core::{CELLS, Flags, Mask, Row, Scalar};

use crate::lanes::Num;
use crate::lanes::eight::eight;
use crate::lanes::processor::{Work, with_avx512};
use crate::lanes::table_rows::{self, Index};

/// Eight numbers. Only [`dispatch_wide`](crate::lanes::dispatch_wide) uses the type, after a check of the processor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eight(__m512d);

/// Eight truth values, a bit for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EightMask(__mmask8);

/// Eight status words.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EightFlags(__m256i);

/// The intrinsics need a processor with AVX-512. These types exist only on such a processor.
macro_rules! avx512 {
    ($call:expr) => {
        // SAFETY: `dispatch_wide` uses the types of this module only on a processor with AVX-512.
        unsafe { $call }
    };
}

#[inline(always)]
fn doubles(number: __m512d) -> [f64; 8] {
    // SAFETY: both are 64 bytes in which every bit pattern is a value.
    unsafe { transmute(number) }
}
/// Combined in registers, because eight narrow stores to memory would stall one wide load.
#[inline(always)]
fn from_doubles(a: [f64; 8]) -> __m512d {
    avx512!(_mm512_set_pd(a[7], a[6], a[5], a[4], a[3], a[2], a[1], a[0]))
}
#[inline(always)]
fn words(flags: __m256i) -> [u32; 8] {
    // SAFETY: both are 32 bytes in which every bit pattern is a value.
    unsafe { transmute(flags) }
}

macro_rules! lanewise {
    ($($number:ident: $trait:ident $method:ident $intrinsic:ident),*) => {$(
        impl $trait for $number {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(avx512!($intrinsic(self.0, other.0)))
            }
        }
    )*};
}
lanewise!(Eight: Add add _mm512_add_pd, Eight: Sub sub _mm512_sub_pd);
lanewise!(Eight: Mul mul _mm512_mul_pd, Eight: Div div _mm512_div_pd);
lanewise!(EightFlags: BitOr bitor _mm256_or_si256);

impl Num for Eight {
    #[inline(always)]
    fn plus(self, factor: Self, other: Self) -> Self {
        Self(avx512!(_mm512_fmadd_pd(factor.0, other.0, self.0)))
    }
    fn dispatch<W: Work>(work: W) -> W::Output {
        // SAFETY: the type exists only on a processor with AVX-512.
        unsafe { with_avx512(work) }
    }
    eight!(append);
}

impl Neg for Eight {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(avx512!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}

eight!();

impl BitAnd for EightMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}
impl BitOr for EightMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
impl Not for EightMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}
impl Mask for EightMask {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self(if value { u8::MAX } else { 0 })
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0 == u8::MAX
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        lane < 8 && self.0 >> lane & 1 == 1
    }
    #[inline(always)]
    fn from_lanes(mut f: impl FnMut(usize) -> bool) -> Self {
        Self((0..8).fold(0, |bits, lane| bits | u8::from(f(lane)) << lane))
    }
}

impl Default for EightFlags {
    #[inline(always)]
    fn default() -> Self {
        Self(avx512!(_mm256_setzero_si256()))
    }
}
impl Flags for EightFlags {
    #[inline(always)]
    fn lane(self, lane: usize) -> u32 {
        words(self.0).get(lane).copied().unwrap_or(0)
    }
    #[inline(always)]
    fn from_lanes(f: impl FnMut(usize) -> u32) -> Self {
        let words: [u32; 8] = array::from_fn(f);
        // SAFETY: both are 32 bytes in which every bit pattern is a value.
        Self(unsafe { transmute::<[u32; 8], __m256i>(words) })
    }
}

impl Scalar for Eight {
    eight!(scalar);

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(avx512!(_mm512_set1_pd(value)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> EightMask {
        EightMask(avx512!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> EightMask {
        EightMask(avx512!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn select(mask: EightMask, yes: Self, no: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_pd(mask.0, no.0, yes.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx512!(_mm512_abs_pd(self.0)))
    }
    // Of equal numbers and with NaN, these instructions give the second operand.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(avx512!(_mm512_max_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self(avx512!(_mm512_min_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx512!(_mm512_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn flag(mask: EightMask, bit: u32) -> EightFlags {
        EightFlags(avx512!(_mm256_maskz_set1_epi32(mask.0, bit as i32)))
    }
    #[inline(always)]
    fn select_flags(mask: EightMask, yes: EightFlags, no: EightFlags) -> EightFlags {
        EightFlags(avx512!(_mm256_mask_blend_epi32(mask.0, no.0, yes.0)))
    }
    #[inline(always)]
    fn at_least(words: EightFlags, least: EightFlags) -> EightMask {
        EightMask(avx512!(_mm256_cmpge_epu32_mask(words.0, least.0)))
    }
    #[inline(always)]
    fn cell(self) -> (Index, EightMask) {
        // Values outside the 32-bit integers, including NaN, become the smallest integer, which is not a
        // cell.
        let (places, inside) = avx512!({
            let cell = _mm256_sub_epi32(_mm512_cvttpd_epi32(self.0), _mm256_set1_epi32(1));
            let nearest = _mm256_min_epu32(cell, _mm256_set1_epi32(CELLS as i32 - 1));
            (_mm256_slli_epi32::<3>(nearest), _mm256_cmpeq_epi32_mask(nearest, cell))
        });
        // SAFETY: these are eight times a cell of the index.
        (unsafe { Index::new(words(places)) }, EightMask(inside))
    }
}
