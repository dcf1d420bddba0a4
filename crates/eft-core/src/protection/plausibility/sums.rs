//! The filters and sums of a plausibility watch.

use crate::integrity::integrity;
use crate::number::Real;

/// A two-sided cumulative sum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Sum<T> {
    pub(super) above: T,
    pub(super) below: T,
}
integrity!(Sum<T>: above, below);

impl<T: Real> Sum<T> {
    #[inline(always)]
    pub(super) fn add(&mut self, residual: T, tolerance: T, limit: T) {
        let zero = T::splat(0.0);
        let most = T::splat(2.0) * limit;
        self.above = (self.above + (residual - tolerance)).limit(zero, most);
        self.below = (self.below - (residual + tolerance)).limit(zero, most);
    }
    #[inline(always)]
    pub(super) fn size(&self) -> T {
        if self.above > self.below { self.above } else { self.below }
    }
}

#[inline(always)]
pub(super) fn follow<T: Real>(state: &mut T, share: T, value: T) -> T {
    *state = *state + share * (value - *state);
    *state
}

/// Two first-order high-passes in series.
#[inline(always)]
pub(super) fn rest<T: Real>([first, second]: &mut [T; 2], share: T, value: T) -> T {
    let once = value - follow(first, share, value);
    once - follow(second, share, once)
}

#[inline(always)]
pub(super) fn envelope<T: Real>(state: &mut T, decay: T, value: T) -> T {
    let (size, held) = (value.abs(), decay * *state);
    *state = if size > held { size } else { held };
    *state
}
