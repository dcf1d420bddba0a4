//! The opening that the flow balance misses: the valve's null bias, and the asymmetry of its flow curve.

use crate::integrity::integrity;
use crate::number::Real;

/// Time (s) over which the missing opening is averaged, and the time without one with which its mean begins.
const MEMORY: f64 = 4.0;
const BEFORE: f64 = 0.03;
/// Largest null bias (1).
const LARGEST_BIAS: f64 = 0.05;
/// Largest asymmetry (1).
const LARGEST_ASYMMETRY: f64 = 0.1;
/// Variance of the opening's size (1) at which half of the asymmetry counts. A spool that hardly moves shows none.
const LEAST_VARIANCE: f64 = 1.0e-6;

/// Means over some seconds. The missing opening is a null bias, and an asymmetry times the size of the opening. Without the
/// second part a valve that passes more flow in one direction would seem to have a null bias while it swings. An equal
/// small error of both directions is in neither, because it has the sign of the opening.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct MissingOpening<T> {
    /// Means (1) of the missing opening and of the opening's size.
    missing: T,
    size: T,
    /// Variance of the size, and covariance of both (1).
    variance: T,
    covariance: T,
    /// Time (s) of the samples, up to [`MEMORY`], and their weight (1). The rest is the time before them.
    time: T,
    known: T,
}
integrity!(MissingOpening<T>: missing, size, variance, covariance, time, known);

impl<T: Real> MissingOpening<T> {
    /// Adds what is missing at an opening (1) during a period (s).
    #[inline(always)]
    pub(super) fn add(&mut self, missing: T, opened: T, period: T) {
        let (size, most) = (self.size_of(opened), T::splat(LARGEST_BIAS));
        if self.time < T::splat(MEMORY) {
            self.time = self.time + period;
        }
        let share = period / (T::splat(BEFORE) + self.time);
        self.known = self.known + share * (T::splat(1.0) - self.known);
        // The means are those of the samples. A beginning at zero would look like an asymmetry.
        let share = share / self.known;
        let (missing, size) = (missing.limit(-most, most) - self.missing, size - self.size);
        let keep = T::splat(1.0) - share;
        self.missing = self.missing + share * missing;
        self.size = self.size + share * size;
        self.variance = keep * (self.variance + share * size * size);
        self.covariance = keep * (self.covariance + share * size * missing);
    }

    /// Missing opening (1) per size of the opening.
    #[inline(always)]
    pub(super) fn asymmetry(&self) -> T {
        let most = T::splat(LARGEST_ASYMMETRY);
        (self.covariance / (self.variance + T::splat(LEAST_VARIANCE))).limit(-most, most)
    }

    /// Weight (1) of the time before the samples, without a missing opening.
    #[inline(always)]
    pub(super) fn unknown(&self) -> T {
        T::splat(1.0) - self.known
    }

    /// Missing opening (1) at null.
    #[inline(always)]
    pub(super) fn null_bias(&self) -> T {
        self.known * self.at_null()
    }

    /// Missing opening (1) at an opening (1).
    #[inline(always)]
    pub(super) fn at(&self, opened: T) -> T {
        self.known * (self.missing + self.asymmetry() * (self.size_of(opened) - self.size))
    }

    /// Missing opening (1) at null by the samples alone.
    #[inline(always)]
    fn at_null(&self) -> T {
        self.missing - self.asymmetry() * self.size
    }

    /// Size (1) of an opening beside the null.
    #[inline(always)]
    fn size_of(&self, opened: T) -> T {
        (opened + self.at_null()).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1.0 / 4096.0;
    /// The missing opening after swings about a null whose missing part is a function of the opening beside it.
    fn after(null: f64, amplitude: f64, missing_at: impl Fn(f64) -> f64) -> MissingOpening<f64> {
        let mut missing = MissingOpening::default();
        for n in 0..40_000 {
            let opening = amplitude * libm::sin(f64::from(n) * 0.0031);
            missing.add(missing_at(opening), null + opening, PERIOD);
        }
        missing
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
                let missing =
                    after(-bias, amplitude, |opening| bias + uneven * opening.abs() + gain * opening);
                let (found, asymmetry) = (missing.null_bias(), missing.asymmetry());
                assert!((found - bias).abs() < 3e-4, "{amplitude} {bias} {uneven} {gain}: {found}");
                assert!((asymmetry - uneven).abs() < 6e-3, "{amplitude} {bias} {uneven} {gain}: {asymmetry}");
                let at = missing.at(0.5 * amplitude - bias);
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
        let missing = after(0.0, amplitude, |opening| 0.04 * opening.abs());
        assert!((missing.asymmetry() - 0.02).abs() < 5e-4, "{}", missing.asymmetry());
    }

    #[test]
    fn a_null_bias_is_known_as_far_as_its_time_is_and_its_beginning_is_no_asymmetry() {
        let bias = 0.03;
        let mut missing = MissingOpening::default();
        for n in 0..16_000 {
            let opening = 0.2 * libm::sin(f64::from(n) * 0.01);
            missing.add(bias, opening - bias, PERIOD);
            if n % 2000 == 0 {
                let time = PERIOD * f64::from(n + 1);
                let found = missing.null_bias();
                assert!((found - bias * time / (0.03 + time)).abs() < 1e-9, "{n}: {found}");
                assert!(missing.asymmetry().abs() < 1e-9, "{n}: {}", missing.asymmetry());
            }
        }
    }

    #[test]
    fn a_resting_spool_shows_a_null_bias_only() {
        let missing = after(-0.004, 0.0, |_| 0.004);
        assert!(missing.known > 0.998, "{}", missing.known);
        for found in [missing.null_bias(), missing.at(0.5)] {
            assert!((found - 0.004 * missing.known).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn both_are_bounded() {
        for sign in [-1.0, 1.0] {
            let missing = after(0.0, 0.0, |_| sign * f64::INFINITY);
            assert!((missing.null_bias() - sign * 0.05 * missing.known).abs() < 1e-12);
            let missing = after(0.0, 0.1, |opening| sign * opening.abs());
            assert!((missing.asymmetry() - sign * 0.1).abs() < 1e-12);
        }
    }
}
