//! Limits of the valve command: amplitude and rate.

use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::{Mask, Scalar};
use crate::status;

/// Amplitude (V) and change per sample (V).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limiter<S> {
    amplitude: S,
    change: S,
}
integrity!(Limiter<T>: amplitude, change);

impl<S: Scalar> Limiter<S> {
    /// The command (V) that may follow `last` (V), and [`status::COMMAND_LIMITED`] and [`status::RATE_LIMITED`].
    ///
    /// The amplitude has priority over the rate. `last` lies within the amplitude, by [`within`](Self::within).
    ///
    /// # NaN
    /// A NaN command becomes the lowest one that may follow, and raises the flags.
    #[inline(always)]
    pub fn apply(&self, command: S, last: S) -> (S, S::Flags) {
        let limited = self.settled(command);
        // It lies between two numbers within the amplitude, so it is within the amplitude as well.
        let reached = limited.limit(last - self.change, last + self.change);
        // Neither is NaN. This is one comparison, where less and greater would be two.
        let differ = !(limited.le(reached) & limited.ge(reached));
        let flags = S::flag(!command.abs().le(self.amplitude), status::COMMAND_LIMITED)
            | S::flag(differ, status::RATE_LIMITED);
        (reached, flags)
    }
    /// The command (V) from which the rate counts, given the last one (V). It is the amplitude where the last one lies
    /// beyond it, as after a change of limits.
    #[inline(always)]
    pub fn within(&self, last: S) -> S {
        if last.abs().le(self.amplitude).all() { last } else { self.brought_back(last) }
    }
    #[cold]
    fn brought_back(&self, last: S) -> S {
        self.settled(last)
    }
    /// The steady command (V), for which only the amplitude counts.
    #[inline(always)]
    pub fn settled(&self, command: S) -> S {
        command.limit(-self.amplitude, self.amplitude)
    }
    /// Limits of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a Limiter<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self { amplitude: S::from_lanes(|i| lane(i).amplitude), change: S::from_lanes(|i| lane(i).change) }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Limiter<$t> {
            /// Lets nothing through.
            pub(crate) const CLOSED: Self = Self { amplitude: 0.0, change: 0.0 };

            /// From the largest command (V), the largest rate (V/s) and the sample rate (Hz); `f64::MAX` is no limit.
            ///
            /// # Errors
            /// A limit that is negative or not finite; a sample rate that is not positive.
            pub const fn new(amplitude: f64, rate: f64, sample_rate: f64) -> Result<Self, ConfigError> {
                // Half the largest f32, so that sums of two limits stay finite in either scalar.
                let most = f32::MAX as f64 / 2.0;
                let amplitude = check!(within("valve_command", amplitude, 0.0, f64::MAX));
                let change = check!(within("valve_command_rate", rate, 0.0, f64::MAX))
                    / check!(positive("sample_rate", sample_rate));
                Ok(Self {
                    amplitude: (if amplitude < most { amplitude } else { most }) as $t,
                    change: (if change < most { change } else { most }) as $t,
                })
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
    fn limits_are_reached_flagged_and_not_passed() {
        let limiter = Limiter::<f64>::new(10.0, 100.0, 100.0).unwrap();
        let cases = [
            (0.5, 0.0, 0.5, 0),
            (1.0, 0.0, 1.0, 0),
            (1.5, 0.0, 1.0, status::RATE_LIMITED),
            (-1.5, 0.0, -1.0, status::RATE_LIMITED),
            (12.0, 9.5, 10.0, status::COMMAND_LIMITED),
            (12.0, 2.0, 3.0, status::COMMAND_LIMITED | status::RATE_LIMITED),
            (-11.0, 15.0, 9.0, status::COMMAND_LIMITED | status::RATE_LIMITED),
            (f64::INFINITY, 0.0, 1.0, status::COMMAND_LIMITED | status::RATE_LIMITED),
        ];
        for (command, last, expected, flags) in cases {
            let (out, raised) = limiter.apply(command, limiter.within(last));
            assert!((out - expected).abs() < 1e-15, "{command} after {last}: {out}");
            assert_eq!(raised, flags, "{command} after {last}");
        }
        let (after_nan, raised) = limiter.apply(f64::NAN, 5.0);
        assert!((after_nan - 4.0).abs() < 1e-15 && raised & status::COMMAND_LIMITED != 0);
    }

    #[test]
    fn largest_limits_limit_nothing() {
        let limiter = Limiter::<f32>::new(f64::MAX, f64::MAX, 4096.0).unwrap();
        for command in [0.0, -1.0e30, 1.0e37] {
            let (out, flags) = limiter.apply(command, -command);
            assert_eq!((out.to_bits(), flags), (command.to_bits(), 0));
        }
        // They are finite, and so are their sums.
        let (most, _) = limiter.apply(f32::INFINITY, 0.0);
        assert!(limiter.apply(f32::INFINITY, most).0.is_finite());
    }
}
