//! Several rigs side by side: the numbers that hold them, and the processor's instructions for them.

mod dispatch;
#[cfg(target_arch = "x86_64")]
mod eight;

use eft_core::{Lanes, Scalar};

pub(crate) use dispatch::{WideWork, Work, dispatch, dispatch_wide, width};

/// Most rigs side by side.
pub(crate) const WIDEST: usize = 8;

/// The plant's numbers: double precision, one or several side by side.
pub trait Num: Scalar<Element = f64> + 'static {
    /// `self + factor·other`, rounded once.
    ///
    /// # Cost
    /// One instruction where the processor has it; without it, many times as long for the same bits.
    fn plus(self, factor: Self, other: Self) -> Self;
}

impl Num for f64 {
    #[inline(always)]
    fn plus(self, factor: f64, other: f64) -> f64 {
        factor.mul_add(other, self)
    }
}

impl<const N: usize> Num for Lanes<f64, N> {
    #[inline(always)]
    fn plus(self, factor: Self, other: Self) -> Self {
        Self::from_lanes(|i| self.lane(i).plus(factor.lane(i), other.lane(i)))
    }
}
