//! The integral part of the force loop, `G_i·∫C_F·(F_c − F)·dt`. It removes the force error of a constant null bias.

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;
use crate::parameters::Parameters;

/// Largest opening (1) that the integral may hold. It exceeds every null bias, and limits the windup.
const OPENING: f64 = 0.2;

/// An integral part's immutable configuration. Its state is one number, the integral (V).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Integral<S> {
    /// V per N and sample.
    per_sample: S,
    /// Largest integral (V) to either side.
    limit: S,
    /// Whether any lane integrates.
    present: bool,
}
integrity!(Integral<T>: per_sample, limit, present);

impl<S: Scalar> Integral<S> {
    /// Whether any lane integrates.
    pub(crate) const fn is_present(&self) -> bool {
        self.present
    }

    /// An integral (V), within its limit.
    pub(crate) fn limited(&self, integral: S) -> S {
        integral.limit(-self.limit, self.limit)
    }

    /// One sample: the integral (V) of the earlier force errors. This error (N) is added where it is `good`.
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut S, good: S::Mask, error: S) -> S {
        let held = *state;
        let grown = self.limited(held + self.per_sample * error);
        *state = S::select(good, grown, held);
        held
    }

    /// Integral parts of single rigs in lanes.
    pub(crate) fn pack<'a>(lane: &dyn Fn(usize) -> &'a Integral<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            per_sample: S::from_lanes(|i| lane(i).per_sample),
            limit: S::from_lanes(|i| lane(i).limit),
            present: (0..S::LANES).any(|i| lane(i).present),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Integral<$t> {
            /// Nothing is integrated.
            pub(crate) const NONE: Self = Self { per_sample: 0.0, limit: 0.0, present: false };

            /// From the rig's parameters.
            ///
            /// # Errors
            /// An integral gain that is negative or not finite; `C_F`, the valve gain or the sample rate not positive.
            pub(crate) const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let gain = check!(within("integral_gain", p.integral_gain, 0.0, LARGEST));
                let sensitivity = check!(positive("force_sensitivity", p.force_sensitivity));
                let rate = check!(positive("sample_rate", p.sample_rate));
                Ok(Self {
                    per_sample: (gain * sensitivity / rate) as $t,
                    limit: (OPENING / check!(positive("valve_gain", p.valve_gain))) as $t,
                    present: gain > 0.0,
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

    const RIG: Parameters = Parameters { integral_gain: 4.0, ..Parameters::ZHAO2005 };

    #[test]
    fn a_constant_error_is_summed_up_to_a_fifth_of_the_opening() {
        let part = Integral::<f64>::new(&RIG).unwrap();
        for side in [1.0, -1.0] {
            let (mut state, limit) = (0.0, 0.2 / RIG.valve_gain);
            for n in 0..100_000 {
                let held = part.step(&mut state, true, side * 900.0);
                let expected = 4.0 * RIG.force_sensitivity * 900.0 * f64::from(n) / RIG.sample_rate;
                let expected = if expected < limit { expected } else { limit };
                assert!((side * held - expected).abs() < 1e-9, "{n}: {held} {expected}");
            }
            // Nothing winds up beyond the limit, so that an error of the other sign acts at once.
            part.step(&mut state, true, -side * 900.0);
            assert!(side * state < limit);
        }
    }

    #[test]
    fn a_bad_sample_and_no_error_leave_it() {
        let part = Integral::<f32>::new(&RIG).unwrap();
        let mut state = 0.5;
        for (good, error) in [(false, f32::NAN), (false, 5e3), (true, 0.0)] {
            assert_eq!(part.step(&mut state, good, error).to_bits(), 0.5_f32.to_bits());
            assert_eq!(state.to_bits(), 0.5_f32.to_bits());
        }
    }

    #[test]
    fn gains_out_of_range_are_refused_by_name() {
        let refused = |gain| {
            let rig = Parameters { integral_gain: gain, ..RIG };
            Integral::<f32>::new(&rig).unwrap_err()
        };
        let negative = refused(-1.0);
        assert!(
            matches!(negative, ConfigError::OutOfRange { parameter: "integral_gain", .. }),
            "{negative:?}"
        );
        assert!(matches!(refused(f64::NAN), ConfigError::NotFinite { parameter: "integral_gain" }));
    }
}
