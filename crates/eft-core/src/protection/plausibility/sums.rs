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
        self.excess([T::splat(0.0); 2])
    }
    /// The larger side, each without what is allowed for it.
    #[inline(always)]
    pub(super) fn excess(&self, [above, below]: [T; 2]) -> T {
        let (above, below) = (self.above - above, self.below - below);
        if above > below { above } else { below }
    }
}

/// The velocities (m/s) at which the two sides of a sum last were zero. A delay adds itself times the change since then.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Began<T> {
    pub(super) above: T,
    pub(super) below: T,
}
integrity!(Began<T>: above, below);

impl<T: Real> Began<T> {
    /// Adds to a sum whose residual contains a delay (s) between two velocities, of which one is `now` (m/s).
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        sum: &mut Sum<T>,
        [residual, tolerance, limit]: [T; 3],
        [delay, now]: [T; 2],
    ) {
        let [above, below] = self.allowed(delay, now);
        sum.add(residual, tolerance, limit + if above > below { above } else { below });
        if !(sum.above > T::splat(0.0)) {
            self.above = now;
        }
        if !(sum.below > T::splat(0.0)) {
            self.below = now;
        }
    }

    /// What a delay (s) of either sign may have added to the two sides of the sum.
    #[inline(always)]
    pub(super) fn allowed(&self, delay: T, now: T) -> [T; 2] {
        [self.above, self.below].map(|began| delay * (now - began).abs())
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
