//! The trait of all numbers: `f32`, `f64` and lanes of them.
//!
//! Blocks select instead of branching, so the same source runs one rig or several in lanes.
//! No operation here fuses, reorders or calls a platform's mathematics library, so bits agree everywhere.

use crate::checksum::Integrity;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::number::row::{CELLS, CROWDED, Row, search};

/// The outcome of a comparison, one truth value a lane.
pub trait Mask:
    Copy + PartialEq + core::fmt::Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
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

/// Status bits or a count, one word a lane.
pub trait Flags: Copy + core::fmt::Debug + Default + PartialEq + BitOr<Output = Self> + 'static {
    /// The word of one lane; lanes that do not exist read zero.
    fn lane(self, lane: usize) -> u32;
    /// One word a lane.
    fn from_lanes(f: impl FnMut(usize) -> u32) -> Self;
}

/// A floating-point number, or several in lanes.
///
/// # NaN
/// Comparisons with NaN are false in every implementation, so `select(x.lt(limit), x, limit)` turns NaN
/// into the limit. The blocks rely on it.
pub trait Scalar:
    Copy
    + Default
    + PartialEq
    + core::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One lane of it: `f32` or `f64`.
    type Element: Real;
    /// The result of a comparison.
    type Mask: Mask;
    /// Status words.
    type Flags: Flags;
    /// A byte of a table's index a lane.
    type Cell: Copy + PartialEq + core::fmt::Debug;
    /// An index a lane.
    type Index: Copy + core::fmt::Debug;
    /// The number of lanes.
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
    /// Where one word is not less than the other.
    fn at_least(words: Self::Flags, least: Self::Flags) -> Self::Mask;

    /// Cell bytes from one a lane.
    fn cell_from_lanes(f: impl FnMut(usize) -> u8) -> Self::Cell;
    /// The integer part of `self - 1`, and whether it is a cell of a [`PiecewiseLinear`](crate::PiecewiseLinear)'s
    /// index; NaN is in none.
    fn cell(self) -> (Self::Index, Self::Mask);
    /// The row of a table's map that `self` lies on, in `cell` of the index to its rows; finite where `cell` is none.
    fn row<const N: usize>(
        self,
        cells: &[Self::Cell; CELLS],
        rows: &[Row<Self>; N],
        cell: Self::Index,
    ) -> Row<Self>;

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
    /// The larger one; `other` where they are equal or either is NaN.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self::select(self.gt(other), self, other)
    }
    /// The smaller one; `other` where they are equal or either is NaN.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// Limits to `[lowest, highest]`; NaN becomes `lowest`.
    #[inline(always)]
    fn limit(self, lowest: Self, highest: Self) -> Self {
        self.larger(lowest).smaller(highest)
    }
    /// `self` with the sign of `direction`; zero where `direction` is zero or NaN.
    #[inline(always)]
    fn times_sign_of(self, direction: Self) -> Self {
        let zero = Self::splat(0.0);
        Self::select(direction.gt(zero), self, Self::select(direction.lt(zero), -self, zero))
    }
}

impl<S: Scalar> Row<S> {
    #[inline(always)]
    pub(crate) fn at(&self, x: S) -> S {
        self.value + (x - self.start) * self.slope
    }

    /// The row of one lane.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> Row<S::Element> {
        Row { start: self.start.lane(lane), value: self.value.lane(lane), slope: self.slope.lane(lane) }
    }

    /// Start, value and slope of the row of each lane's `x`, by halving, for crowded knots.
    #[cold]
    pub fn search<const N: usize>(rows: &[Self; N], x: &S) -> [S; 3] {
        let found = |lane: usize| {
            let row = search(rows, |row| row.start.lane(lane), x.lane(lane));
            row.map_or_else(Row::default, |row| row.lane(lane))
        };
        [
            S::from_lanes(|lane| found(lane).start),
            S::from_lanes(|lane| found(lane).value),
            S::from_lanes(|lane| found(lane).slope),
        ]
    }
}

/// A single floating-point number.
pub trait Real:
    Scalar<Element = Self, Mask = bool, Flags = u32, Cell = u8, Index = u32> + PartialOrd + Integrity
{
    /// Rounded to this type.
    fn from_f64(value: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
    /// Rounded to this type, without an `f64` on the way.
    fn from_u32(value: u32) -> Self;
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
    #[inline(always)]
    fn from_lanes(mut f: impl FnMut(usize) -> u32) -> Self {
        f(0)
    }
}

macro_rules! real {
    ($t:ty, $sqrt:path) => {
        impl Scalar for $t {
            type Element = $t;
            type Mask = bool;
            type Flags = u32;
            type Cell = u8;
            type Index = u32;
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
            fn at_least(words: u32, least: u32) -> bool {
                words >= least
            }
            #[inline(always)]
            fn cell_from_lanes(mut f: impl FnMut(usize) -> u8) -> u8 {
                f(0)
            }
            #[inline(always)]
            fn cell(self) -> (u32, bool) {
                let cell = (self as i32).wrapping_sub(1) as u32;
                (cell, cell < CELLS as u32)
            }
            #[inline(always)]
            fn row<const N: usize>(self, cells: &[u8; CELLS], rows: &[Row<Self>; N], cell: u32) -> Row<Self> {
                let first = usize::from(cells.get(cell as usize).copied().unwrap_or(CROWDED));
                match rows.get(first..first + 2) {
                    Some([row, next]) => *(if self < next.start { row } else { next }),
                    _ => search(rows, |row| row.start, self).copied().unwrap_or_default(),
                }
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
            fn from_u32(value: u32) -> Self {
                value as $t
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }
        }
    };
}
/// Square roots; every one of them is correctly rounded.
#[cfg(not(feature = "std"))]
mod root {
    pub(super) use eft_sqrt::sqrtf;
    pub(super) use libm::sqrt;
}
/// The compiler's own, which it can put into vector instructions.
#[cfg(feature = "std")]
mod root {
    extern crate std;
    #[inline(always)]
    pub(super) fn sqrt(x: f64) -> f64 {
        x.sqrt()
    }
    #[inline(always)]
    pub(super) fn sqrtf(x: f32) -> f32 {
        x.sqrt()
    }
}
real!(f32, root::sqrtf);
real!(f64, root::sqrt);
