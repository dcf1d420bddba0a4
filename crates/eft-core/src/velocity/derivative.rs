//! Velocity as the filtered derivative of the displacement.

use crate::error::{ConfigError, LARGEST, check, positive};
use crate::integrity::integrity;
use crate::number::Real;

/// Difference from sample to sample, then two equal first-order low-passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilteredDerivative<T> {
    sample_rate: T,
    pub(crate) share: T,
}
integrity!(FilteredDerivative<T>: sample_rate, share);

/// The state of a filtered derivative, made by [`FilteredDerivative::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct FilteredDerivativeState<T> {
    displacement: T,
    pub(crate) first: T,
    second: T,
}
integrity!(FilteredDerivativeState<T>: displacement, first, second);

impl<T: Real> FilteredDerivative<T> {
    /// One sample: velocity (m/s) for the measured displacement (m).
    ///
    /// # NaN
    /// A displacement that is not finite, or beyond [`LARGEST`], leaves the state as it was. The result is NaN, which
    /// the controller refuses.
    ///
    /// # Cost
    /// Four multiplications and additions, one comparison.
    #[inline(always)]
    pub fn step(&self, state: &mut FilteredDerivativeState<T>, displacement: T) -> T {
        if !(displacement.abs() <= T::splat(LARGEST)) {
            return T::splat(f64::NAN);
        }
        let slope = (displacement - state.displacement) * self.sample_rate;
        state.displacement = displacement;
        state.first = state.first + self.share * (slope - state.first);
        state.second = state.second + self.share * (state.first - state.second);
        state.second
    }

    /// A sample that was lost: the velocity (m/s) if the motion of the last period (s) goes on.
    #[inline(always)]
    pub(crate) fn go_on(&self, state: &mut FilteredDerivativeState<T>, period: T) -> T {
        let displacement = state.displacement + period * state.first;
        self.step(state, displacement)
    }

    /// Goes over `gap` lost samples before this displacement (m), so that its step has the mean slope of the gap.
    pub(crate) fn bridge(&self, state: &mut FilteredDerivativeState<T>, displacement: T, gap: T) {
        let change = displacement - state.displacement;
        state.displacement = state.displacement + change * (gap / (gap + T::splat(1.0)));
    }

    /// Resumes after `ticks` samples of which all but this one were lost, as if the displacement (m) had changed
    /// linearly.
    pub(crate) fn resumed(
        &self,
        before: &FilteredDerivativeState<T>,
        displacement: T,
        ticks: T,
    ) -> FilteredDerivativeState<T> {
        let change = (displacement - before.displacement) / ticks;
        let velocity = change * self.sample_rate;
        FilteredDerivativeState { displacement: displacement - change, first: velocity, second: velocity }
    }

    /// The steady state at this displacement (m), so that the next step has no kick.
    pub fn at_rest(&self, displacement: T) -> FilteredDerivativeState<T> {
        let zero = T::splat(0.0);
        let good = displacement.abs() <= T::splat(LARGEST);
        FilteredDerivativeState {
            displacement: if good { displacement } else { zero },
            first: zero,
            second: zero,
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl FilteredDerivative<$t> {
            /// From the corner of its low-passes (Hz) and the sample rate (Hz).
            ///
            /// # Errors
            /// Either not positive and finite.
            pub const fn new(corner: f64, sample_rate: f64) -> Result<Self, ConfigError> {
                let rate = check!(positive("sample_rate", sample_rate));
                let angle = core::f64::consts::TAU * check!(positive("corner", corner)) / rate;
                let share = angle / (1.0 + 0.5 * angle);
                // A corner above the highest one at this rate filters nothing.
                let share = if share < 1.0 { share } else { 1.0 };
                Ok(Self { sample_rate: rate as $t, share: share as $t })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_its_corner_half_of_the_velocity_passes() {
        for (corner, rate) in [(80.0, 4096.0), (20.0, 4096.0), (80.0, 20e3)] {
            let derivative = FilteredDerivative::<f64>::new(corner, rate).unwrap();
            let mut state = derivative.at_rest(0.0);
            let angle = core::f64::consts::TAU * corner / rate;
            let samples = (20.0 * rate / corner) as u32;
            let largest = (0..samples).fold(0.0, |most: f64, n| {
                let velocity = derivative.step(&mut state, libm::sin(angle * f64::from(n)));
                if n > samples / 2 && velocity > most { velocity } else { most }
            });
            // Two low-passes of 1/√2 each.
            let passed = largest / (core::f64::consts::TAU * corner);
            assert!((passed - 0.5).abs() < 0.03, "{corner} Hz at {rate} Hz: {passed}");
        }
    }

    const DERIVATIVE: FilteredDerivative<f64> = FilteredDerivative { sample_rate: 1000.0, share: 0.25 };

    fn near(what: &str, found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
    }

    #[test]
    fn the_change_per_sample_passes_two_low_passes() {
        let mut state = FilteredDerivativeState { displacement: 0.010, first: 2.0, second: 1.0 };
        let velocity = DERIVATIVE.step(&mut state, 0.014);
        near("first", state.first, 0.75 * 2.0 + 0.25 * 4.0);
        near("second", state.second, 0.75 + 0.25 * 2.5);
        near("velocity", velocity, state.second);
        near("displacement", state.displacement, 0.014);
    }

    #[test]
    fn after_a_gap_it_has_the_mean_velocity_of_the_gap() {
        let before = FilteredDerivativeState { displacement: 0.010, first: 2.0, second: 1.0 };
        let mut state = DERIVATIVE.resumed(&before, 0.030, 4.0);
        // 20 mm in four samples. The next step takes the displacement once more.
        near("displacement", state.displacement, 0.025);
        near("velocity", DERIVATIVE.step(&mut state, 0.030), 5.0);
    }

    #[test]
    fn the_largest_displacement_is_accepted() {
        for (displacement, accepted) in [(LARGEST, true), (-LARGEST, true), (1.001 * LARGEST, false)] {
            let mut state = DERIVATIVE.at_rest(0.0);
            assert_eq!(DERIVATIVE.step(&mut state, displacement).is_finite(), accepted, "{displacement}");
            let rest = DERIVATIVE.at_rest(displacement).displacement;
            near("at rest", rest, if accepted { displacement } else { 0.0 });
        }
    }

    #[test]
    fn a_corner_beyond_the_rate_filters_nothing() {
        for (corner, share) in
            [(1e3, 1.0), (100.0, 0.2 * core::f64::consts::PI / (1.0 + 0.1 * core::f64::consts::PI))]
        {
            let found = FilteredDerivative::<f64>::new(corner, 1000.0).unwrap();
            near("share", found.share, share);
            near("rate", found.sample_rate, 1000.0);
        }
    }
}
