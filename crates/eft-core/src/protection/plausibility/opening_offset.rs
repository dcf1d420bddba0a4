//! The opening offset, by which the valve's flow differs from that of the measured opening: the valve's null bias, and
//! the asymmetry of its flow curve.

use crate::integrity::integrity;
use crate::number::Real;

/// Time (s) over which the opening offset is averaged, and the time without one with which its mean begins.
const AVERAGING_TIME: f64 = 4.0;
const PRIOR_TIME: f64 = 0.03;
/// Largest null bias (1).
const LARGEST_BIAS: f64 = 0.05;
/// Largest asymmetry (1).
const LARGEST_ASYMMETRY: f64 = 0.1;
/// Variance of the opening's size (1) at which half of the asymmetry counts. A spool that hardly moves shows none.
const LEAST_VARIANCE: f64 = 1.0e-6;

/// Means over some seconds. The opening offset is a null bias, and an asymmetry times the size of the opening. Without
/// the second part a valve that passes more flow in one direction would seem to have a null bias while it swings. An
/// equal small error of both directions is in neither, because it has the sign of the opening.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct OpeningOffset<T> {
    /// Means (1) of the opening offset and of the opening's size.
    offset: T,
    size: T,
    /// Variance of the size, and covariance of both (1).
    variance: T,
    covariance: T,
    /// Time (s) of the samples, up to [`AVERAGING_TIME`], and their weight (1). The rest is the time before them.
    time: T,
    weight: T,
}
integrity!(OpeningOffset<T>: offset, size, variance, covariance, time, weight);

impl<T: Real> OpeningOffset<T> {
    /// Adds the offset at an opening (1) during a period (s).
    #[inline(always)]
    pub(super) fn add(&mut self, offset: T, opening: T, period: T) {
        let (size, most) = (self.size_of(opening), T::splat(LARGEST_BIAS));
        if self.time < T::splat(AVERAGING_TIME) {
            self.time = self.time + period;
        }
        let share = period / (T::splat(PRIOR_TIME) + self.time);
        self.weight = self.weight + share * (T::splat(1.0) - self.weight);
        // The means are those of the samples. A beginning at zero would look like an asymmetry.
        let share = share / self.weight;
        let (offset, size) = (offset.limit(-most, most) - self.offset, size - self.size);
        let keep = T::splat(1.0) - share;
        self.offset = self.offset + share * offset;
        self.size = self.size + share * size;
        self.variance = keep * (self.variance + share * size * size);
        self.covariance = keep * (self.covariance + share * size * offset);
    }

    /// Opening offset (1) per size of the opening.
    #[inline(always)]
    pub(super) fn asymmetry(&self) -> T {
        let most = T::splat(LARGEST_ASYMMETRY);
        (self.covariance / (self.variance + T::splat(LEAST_VARIANCE))).limit(-most, most)
    }

    /// Weight (1) of the time before the samples, without a opening offset.
    #[inline(always)]
    pub(super) fn prior_weight(&self) -> T {
        T::splat(1.0) - self.weight
    }

    /// Opening offset (1) at null.
    #[inline(always)]
    pub(super) fn null_bias(&self) -> T {
        self.weight * self.at_null()
    }

    /// Opening offset (1) at an opening (1).
    #[inline(always)]
    pub(super) fn at(&self, opening: T) -> T {
        self.weight * (self.offset + self.asymmetry() * (self.size_of(opening) - self.size))
    }

    /// Opening offset (1) at null by the samples alone.
    #[inline(always)]
    fn at_null(&self) -> T {
        self.offset - self.asymmetry() * self.size
    }

    /// Size (1) of an opening beside the null.
    #[inline(always)]
    fn size_of(&self, opening: T) -> T {
        (opening + self.at_null()).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1.0 / 4096.0;
    /// The opening offset after swings about a null whose offset is a function of the opening beside it.
    fn after(null: f64, amplitude: f64, missing_at: impl Fn(f64) -> f64) -> OpeningOffset<f64> {
        let mut offset = OpeningOffset::default();
        for n in 0..40_000 {
            let opening = amplitude * libm::sin(f64::from(n) * 0.0031);
            offset.add(missing_at(opening), null + opening, PERIOD);
        }
        offset
    }

    #[test]
    fn a_null_bias_and_an_asymmetry_are_told_apart_and_an_error_of_both_directions_is_neither() {
        for amplitude in [0.02, 0.2, 0.5] {
            for (bias, uneven, gain) in [
                (0.01, 0.0, 0.0),
                (0.004, 0.03, 0.0),
                (0.0, -0.03, 0.05),
                (-0.02, 0.0, 0.05),
                (-0.02, 0.03, -0.05),
            ] {
                let offset =
                    after(-bias, amplitude, |opening| bias + uneven * opening.abs() + gain * opening);
                let (found, asymmetry) = (offset.null_bias(), offset.asymmetry());
                assert!((found - bias).abs() < 3e-4, "{amplitude} {bias} {uneven} {gain}: {found}");
                assert!((asymmetry - uneven).abs() < 6e-3, "{amplitude} {bias} {uneven} {gain}: {asymmetry}");
                let at = offset.at(0.5 * amplitude - bias);
                let expected = bias + 0.5 * uneven * amplitude;
                assert!((at - expected).abs() < 5e-4, "{at}");
            }
        }
    }

    #[test]
    fn a_spool_that_hardly_moves_shows_half_of_an_asymmetry() {
        // The variance of |sin| is 1/2 − 4/π².
        let amplitude =
            libm::sqrt(LEAST_VARIANCE / (0.5 - 4.0 / (core::f64::consts::PI * core::f64::consts::PI)));
        let offset = after(0.0, amplitude, |opening| 0.04 * opening.abs());
        assert!((offset.asymmetry() - 0.02).abs() < 5e-4, "{}", offset.asymmetry());
    }

    #[test]
    fn a_null_bias_is_known_as_far_as_its_time_is_and_its_beginning_is_no_asymmetry() {
        let bias = 0.03;
        let mut offset = OpeningOffset::default();
        for n in 0..16_000 {
            let opening = 0.2 * libm::sin(f64::from(n) * 0.01);
            offset.add(bias, opening - bias, PERIOD);
            if n % 2000 == 0 {
                let time = PERIOD * f64::from(n + 1);
                let found = offset.null_bias();
                assert!((found - bias * time / (0.03 + time)).abs() < 1e-9, "{n}: {found}");
                assert!(offset.asymmetry().abs() < 1e-9, "{n}: {}", offset.asymmetry());
            }
        }
    }

    #[test]
    fn a_resting_spool_shows_a_null_bias_only() {
        let offset = after(-0.004, 0.0, |_| 0.004);
        assert!(offset.weight > 0.998, "{}", offset.weight);
        for found in [offset.null_bias(), offset.at(0.5)] {
            assert!((found - 0.004 * offset.weight).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn both_are_bounded() {
        for sign in [-1.0, 1.0] {
            let offset = after(0.0, 0.0, |_| sign * f64::INFINITY);
            assert!((offset.null_bias() - sign * 0.05 * offset.weight).abs() < 1e-12);
            let offset = after(0.0, 0.1, |opening| sign * opening.abs());
            assert!((offset.asymmetry() - sign * 0.1).abs() < 1e-12);
        }
    }
}
