//! Several numbers in lanes, as a plain array. It is portable, and the compiler vectorises it where it can.

use core::array;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::number::row::{CELLS, CROWDED, Row, search};
use crate::number::{Flags, Mask, Real, Scalar};

/// `L` numbers, one for each lane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Lanes<T, const L: usize>(pub [T; L]);

impl<T: Real, const L: usize> Default for Lanes<T, L> {
    #[inline(always)]
    fn default() -> Self {
        Self([T::default(); L])
    }
}

impl<T: Real, const L: usize> Lanes<T, L> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self;
        for (a, b) in out.0.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        out
    }
    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(T, T) -> bool) -> LaneMask<L> {
        let mut out = [false; L];
        for (o, (a, b)) in out.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            *o = f(a, b);
        }
        LaneMask(out)
    }
}

macro_rules! lanewise {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl<T: Real, const L: usize> $trait for Lanes<T, L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    )*};
}
lanewise!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<T: Real, const L: usize> Neg for Lanes<T, L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|a| -a))
    }
}

/// One truth value a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneMask<const L: usize>(pub [bool; L]);

impl<const L: usize> BitAnd for LaneMask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self::from_lanes(|i| self.lane(i) & other.lane(i))
    }
}
impl<const L: usize> BitOr for LaneMask<L> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self::from_lanes(|i| self.lane(i) | other.lane(i))
    }
}
impl<const L: usize> Not for LaneMask<L> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|a| !a))
    }
}
impl<const L: usize> Mask for LaneMask<L> {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self([value; L])
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().any(|&a| a)
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0.iter().all(|&a| a)
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.0.get(lane).copied().unwrap_or(false)
    }
    #[inline(always)]
    fn from_lanes(f: impl FnMut(usize) -> bool) -> Self {
        Self(array::from_fn(f))
    }
}

/// One status word a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneFlags<const L: usize>(pub [u32; L]);

impl<const L: usize> Default for LaneFlags<L> {
    #[inline(always)]
    fn default() -> Self {
        Self([0; L])
    }
}
impl<const L: usize> BitOr for LaneFlags<L> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.lane(i) | other.lane(i)))
    }
}
impl<const L: usize> Flags for LaneFlags<L> {
    #[inline(always)]
    fn lane(self, lane: usize) -> u32 {
        self.0.get(lane).copied().unwrap_or(0)
    }
    #[inline(always)]
    fn from_lanes(f: impl FnMut(usize) -> u32) -> Self {
        Self(array::from_fn(f))
    }
}

impl<T: Real, const L: usize> Scalar for Lanes<T, L> {
    type Element = T;
    type Mask = LaneMask<L>;
    type Flags = LaneFlags<L>;
    type Cell = [u8; L];
    type Index = [u32; L];
    const LANES: usize = L;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([T::from_f64(value); L])
    }
    #[inline(always)]
    fn from_lanes(f: impl FnMut(usize) -> T) -> Self {
        Self(array::from_fn(f))
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> T {
        self.0.get(lane).copied().unwrap_or_default()
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<L> {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<L> {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn select(mask: LaneMask<L>, yes: Self, no: Self) -> Self {
        Self(array::from_fn(|i| if mask.lane(i) { yes.lane(i) } else { no.lane(i) }))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(T::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(T::sqrt))
    }
    #[inline(always)]
    fn flag(mask: LaneMask<L>, bit: u32) -> LaneFlags<L> {
        LaneFlags(mask.0.map(|a| if a { bit } else { 0 }))
    }
    #[inline(always)]
    fn select_flags(mask: LaneMask<L>, yes: LaneFlags<L>, no: LaneFlags<L>) -> LaneFlags<L> {
        LaneFlags(array::from_fn(|i| if mask.lane(i) { yes.lane(i) } else { no.lane(i) }))
    }
    #[inline(always)]
    fn at_least(words: LaneFlags<L>, least: LaneFlags<L>) -> LaneMask<L> {
        LaneMask(array::from_fn(|i| words.lane(i) >= least.lane(i)))
    }
    #[inline(always)]
    fn cell_from_lanes(f: impl FnMut(usize) -> u8) -> [u8; L] {
        array::from_fn(f)
    }
    #[inline(always)]
    fn cell(self) -> ([u32; L], LaneMask<L>) {
        let cells = self.0.map(T::cell);
        (cells.map(|(cell, _)| cell), LaneMask(cells.map(|(_, inside)| inside)))
    }
    #[inline(always)]
    fn row<const N: usize>(
        self,
        cells: &[[u8; L]; CELLS],
        rows: &[Row<Self>; N],
        cell: [u32; L],
    ) -> Row<Self> {
        let found: [Row<T>; L] = array::from_fn(|i| {
            let x = self.lane(i);
            let entry = cell.get(i).and_then(|&cell| cells.get(cell as usize)?.get(i));
            let first = usize::from(entry.copied().unwrap_or(CROWDED));
            match rows.get(first..first + 2) {
                Some([here, next]) => {
                    if x < next.start.lane(i) {
                        here.lane(i)
                    } else {
                        next.lane(i)
                    }
                }
                _ => search(rows, |row| row.start.lane(i), x).map_or_else(Row::default, |row| row.lane(i)),
            }
        });
        Row {
            start: Self(found.map(|row| row.start)),
            value: Self(found.map(|row| row.value)),
            slope: Self(found.map(|row| row.slope)),
        }
    }
}
