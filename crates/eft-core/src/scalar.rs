//! The one trait behind every number: `f32`, `f64` and lanes of them.
//!
//! Blocks select instead of branching, so the same source runs one rig or several side by side.
//! No operation here fuses, reorders or calls a platform's mathematics library, so bits agree everywhere.

use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// The outcome of a comparison, one truth value a lane.
pub trait Mask:
    Copy + core::fmt::Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same truth value in every lane.
    fn splat(value: bool) -> Self;
    /// Whether any lane is true.
    fn any(self) -> bool;
    /// Whether every lane is true.
    fn all(self) -> bool;
    /// The truth value of one lane; lanes that do not exist are false.
    fn lane(self, lane: usize) -> bool;
    /// A mask from one truth value a lane.
    fn from_lanes(f: impl FnMut(usize) -> bool) -> Self;
}

/// Status bits, one word a lane.
pub trait Flags: Copy + core::fmt::Debug + Default + BitOr<Output = Self> {
    /// The word of one lane; lanes that do not exist read zero.
    fn lane(self, lane: usize) -> u32;
}

/// A floating-point number, or several side by side.
///
/// # NaN
/// Comparisons with NaN are false in every implementation, so `select(x.lt(limit), x, limit)` turns NaN
/// into the limit. The blocks rely on it.
pub trait Scalar:
    Copy
    + Default
    + core::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One lane of it: `f32` or `f64`.
    type Element: Real;
    /// What comparisons give.
    type Mask: Mask;
    /// Status words.
    type Flags: Flags;
    /// A table index a lane.
    type Index: Copy + core::fmt::Debug;
    /// How many numbers stand side by side.
    const LANES: usize;

    /// The same number in every lane, rounded once from `f64`.
    fn splat(value: f64) -> Self;
    /// One number a lane.
    fn from_lanes(f: impl FnMut(usize) -> Self::Element) -> Self;
    /// One lane; lanes that do not exist read zero.
    fn lane(self, lane: usize) -> Self::Element;
    /// self < other
    fn lt(self, other: Self) -> Self::Mask;
    /// self <= other
    fn le(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// |self|, by clearing the sign bit.
    fn abs(self) -> Self;
    /// The correctly rounded square root.
    fn sqrt(self) -> Self;
    /// `bit` where the mask is true.
    fn flag(mask: Self::Mask, bit: u32) -> Self::Flags;
    /// `yes` where the mask is true, `no` elsewhere.
    fn select_flags(mask: Self::Mask, yes: Self::Flags, no: Self::Flags) -> Self::Flags;

    /// Table indices from one a lane.
    fn index_from_lanes(f: impl FnMut(usize) -> u8) -> Self::Index;
    /// The integer part, saturating at 0 and 255; NaN gives 0.
    fn truncate(self) -> Self::Index;
    /// Entry `index` of a table of indices of power-of-two length, wrapping.
    fn index_at<const M: usize>(table: &[Self::Index; M], index: Self::Index) -> Self::Index;
    /// Entry `index` of a table; zero beyond its end.
    fn at<const N: usize>(table: &[Self; N], index: Self::Index) -> Self;
    /// One more where the mask is true.
    fn advance(index: Self::Index, mask: Self::Mask) -> Self::Index;

    /// self > other
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// self >= other
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// Limits to `[lowest, highest]`; NaN becomes `lowest`.
    #[inline(always)]
    fn limit(self, lowest: Self, highest: Self) -> Self {
        let raised = Self::select(self.gt(lowest), self, lowest);
        Self::select(raised.lt(highest), raised, highest)
    }
    /// `self` with the sign of `direction`; zero where `direction` is zero or NaN.
    #[inline(always)]
    fn times_sign_of(self, direction: Self) -> Self {
        let zero = Self::splat(0.0);
        Self::select(direction.gt(zero), self, Self::select(direction.lt(zero), -self, zero))
    }
}

/// A single floating-point number.
pub trait Real:
    Scalar<Element = Self, Mask = bool, Flags = u32, Index = u8> + PartialOrd + PartialEq
{
    /// Rounded to this type.
    fn from_f64(value: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        value
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self && lane == 0
    }
    #[inline(always)]
    fn from_lanes(mut f: impl FnMut(usize) -> bool) -> Self {
        f(0)
    }
}

impl Flags for u32 {
    #[inline(always)]
    fn lane(self, lane: usize) -> u32 {
        if lane == 0 { self } else { 0 }
    }
}

macro_rules! real {
    ($t:ty, $sqrt:path) => {
        impl Scalar for $t {
            type Element = $t;
            type Mask = bool;
            type Flags = u32;
            type Index = u8;
            const LANES: usize = 1;

            #[inline(always)]
            fn splat(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn from_lanes(mut f: impl FnMut(usize) -> $t) -> Self {
                f(0)
            }
            #[inline(always)]
            fn lane(self, lane: usize) -> $t {
                if lane == 0 { self } else { 0.0 }
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline(always)]
            fn flag(mask: bool, bit: u32) -> u32 {
                if mask { bit } else { 0 }
            }
            #[inline(always)]
            fn select_flags(mask: bool, yes: u32, no: u32) -> u32 {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn index_from_lanes(mut f: impl FnMut(usize) -> u8) -> u8 {
                f(0)
            }
            #[inline(always)]
            fn truncate(self) -> u8 {
                self as u8
            }
            #[inline(always)]
            fn index_at<const M: usize>(table: &[u8; M], index: u8) -> u8 {
                const { assert!(M.is_power_of_two()) };
                table.get(usize::from(index) & (M - 1)).copied().unwrap_or(0)
            }
            #[inline(always)]
            fn at<const N: usize>(table: &[Self; N], index: u8) -> Self {
                table.get(usize::from(index)).copied().unwrap_or(0.0)
            }
            #[inline(always)]
            fn advance(index: u8, mask: bool) -> u8 {
                index.wrapping_add(u8::from(mask))
            }
        }

        impl Real for $t {
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }
        }
    };
}
real!(f32, libm::sqrtf);
real!(f64, libm::sqrt);
