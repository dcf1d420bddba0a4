//! The filters and sums of a plausibility watch.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::gate::LARGEST_COUNT;

/// Counts a tick without a reading since the last one; 0 is before the first.
#[inline(always)]
pub(super) fn count_since(ticks: &mut u32) {
    if *ticks > 0 && *ticks < LARGEST_COUNT {
        *ticks += 1;
    }
}

/// A two-sided cumulative sum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Cusum<T> {
    pub(super) above: T,
    pub(super) below: T,
}
integrity!(Cusum<T>: above, below);

impl<T: Real> Cusum<T> {
    #[inline(always)]
    pub(super) fn add(&mut self, residual: T, tolerance: T, limit: T) {
        let zero = T::splat(0.0);
        let most = T::splat(2.0) * limit;
        self.above = (self.above + (residual - tolerance)).limit(zero, most);
        self.below = (self.below - (residual + tolerance)).limit(zero, most);
    }

    /// Whether either side is beyond a share of the limit.
    #[inline(always)]
    pub(super) fn is_beyond(&self, limit: T, share: T) -> bool {
        larger(self.above, self.below) > share * limit
    }
}

/// The velocities (m/s) at which the two sides of a sum last were zero. A delay adds itself times the change since
/// then.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CusumStart<T> {
    pub(super) above: T,
    pub(super) below: T,
}
integrity!(CusumStart<T>: above, below);

impl<T: Real> CusumStart<T> {
    /// Adds to a sum whose residual contains a delay (s) between two velocities, of which one is `now` (m/s).
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        sum: &mut Cusum<T>,
        [residual, tolerance, limit]: [T; 3],
        [delay, now]: [T; 2],
    ) {
        let [above, below] = self.allowed(delay, now);
        sum.add(residual, tolerance, limit + larger(above, below));
        if !(sum.above > T::splat(0.0)) {
            self.above = now;
        }
        if !(sum.below > T::splat(0.0)) {
            self.below = now;
        }
    }

    /// Whether either side is beyond a share of the sum's limit and what a delay may have added.
    #[inline(always)]
    pub(super) fn is_beyond(&self, sum: &Cusum<T>, limit: T, share: T, [delay, now]: [T; 2]) -> bool {
        let [above, below] = self.allowed(delay, now);
        larger(sum.above - above, sum.below - below) > share * limit
    }

    /// What a delay (s) of either sign may have added to the two sides of the sum.
    #[inline(always)]
    fn allowed(&self, delay: T, now: T) -> [T; 2] {
        [self.above, self.below].map(|start| delay * (now - start).abs())
    }
}

/// Which of velocity and displacement changed the flow's balance since their difference began. Only changes count: a
/// wrong calibration leaves a residual as well, but did not begin with the difference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Evidence<T> {
    /// Difference of the velocities (m/s) and residual of the flow (m³/s) at the beginning.
    difference: T,
    residual: T,
    /// As the average of the motion's `misfit`, but the sum (m⁴/s²) of all samples.
    pub(super) misfit: T,
}
integrity!(Evidence<T>: difference, residual, misfit);

impl<T: Real> Evidence<T> {
    /// Adds a sample, or begins anew while there is no difference.
    #[inline(always)]
    pub(super) fn add(&mut self, differs: bool, difference: T, residual: T, area: T) {
        if differs {
            let (difference, residual) = (difference - self.difference, residual - self.residual);
            self.misfit = self.misfit + difference * (residual - T::splat(0.5) * (area * difference));
        } else {
            *self = Self { difference, residual, misfit: T::splat(0.0) };
        }
    }

    /// Whether the residual is that of a wrong displacement.
    #[inline(always)]
    pub(super) fn is_of_displacement(&self) -> bool {
        self.misfit <= T::splat(0.0)
    }
}

#[inline(always)]
pub(super) fn low_pass<T: Real>(state: &mut T, share: T, value: T) -> T {
    *state = *state + share * (value - *state);
    *state
}

/// Two first-order high-passes in series.
#[inline(always)]
pub(super) fn high_pass<T: Real>([first, second]: &mut [T; 2], share: T, value: T) -> T {
    let once = value - low_pass(first, share, value);
    once - low_pass(second, share, once)
}

#[inline(always)]
pub(super) fn envelope<T: Real>(state: &mut T, decay: T, value: T) -> T {
    let (size, held) = (value.abs(), decay * *state);
    *state = if size > held { size } else { held };
    *state
}

/// The larger of two numbers.
#[inline(always)]
pub(super) fn larger<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// The opposition of two signals: the smaller of their sizes, negative if they have the same sign.
#[inline(always)]
pub(super) fn opposition<T: Real>(a: T, b: T) -> T {
    let (first, second) = (a.abs(), b.abs());
    let size = if first < second { first } else { second };
    if a * b < T::splat(0.0) { size } else { -size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_from_before_the_difference_is_no_evidence() {
        // The flow is 3 % larger than the table's, at 0.4 m/s and an area of 0.01 m².
        let (speed, area, before) = (0.4, 0.01, 0.03 * 0.4 * 0.01);
        for (velocity_error, displacement_stops, of_displacement) in
            [(0.0, true, true), (-speed, false, false)]
        {
            for before in [-before, before] {
                let mut evidence = Evidence::<f64>::default();
                evidence.add(false, 0.001, before, area);
                for n in 1..=5 {
                    // The low-passes let the difference grow.
                    let share = 0.02 * f64::from(n);
                    let stopped = if displacement_stops { speed } else { 0.0 };
                    let difference = 0.001 + share * (velocity_error + stopped);
                    evidence.add(true, difference, before + share * area * velocity_error, area);
                    assert_eq!(evidence.is_of_displacement(), of_displacement, "{n} {before}");
                }
            }
        }
    }
}
