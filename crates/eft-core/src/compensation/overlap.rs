//! Overlap of the spool's lands. Within `±o` the valve passes no flow. A flow that needs the opening `y` of a valve
//! without overlap needs `y + o·sgn(y)`. Compensation and force loop open the valve together, so `y` is the sum of
//! both.

use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;
use crate::parameters::{Mode, Parameters};

/// Width of the step over the overlap (1, over the overlap).
const NARROW_STEP: f64 = 0.5;
/// Time constant of the sign's low-pass (1, over the valve's response delay).
const LOW_PASS_TIME: f64 = 0.4;
/// Width of the step without an integral part. Within the width the gain of the compensation is larger by a quarter.
const WIDE_STEP: f64 = 4.0;

/// The step over an overlap, `o·sat(z̄/δ)`, as a part of the compensation.
///
/// With an integral part of the force loop, `z̄` is the sum of both openings with a low-pass. Without the low-pass the
/// velocity's noise would move the sum to and fro over the step, and the mean step at a small opening would be small.
/// Without an integral part the gains are as the rig's engineer chose them. The force loop may then have no gain margin
/// for a narrow step, so that `z̄` is the compensation's opening alone and the step is wide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OverlapStep<S> {
    /// The overlap `o` (1).
    overlap: S,
    /// `o/δ` (1).
    slope: S,
    /// Share of a change that enters the low-pass in a sample (1).
    low_pass_gain: S,
    /// Opening (1) by the force loop, per force error (N) and per integral (V).
    per_error: S,
    per_integral: S,
    /// Whether any lane has an overlap.
    present: bool,
}
integrity!(OverlapStep<T>: overlap, slope, low_pass_gain, per_error, per_integral, present);

impl<S: Scalar> OverlapStep<S> {
    /// Whether any lane has an overlap.
    #[inline(always)]
    pub(crate) const fn is_present(&self) -> bool {
        self.present
    }

    /// The sum (1) of the compensation's opening of a valve without overlap and of that to which the force loop drives
    /// it, by its error (N) and its integral (V).
    #[inline(always)]
    pub(crate) fn combined_opening(&self, opening: S, error: S, integral: S) -> S {
        opening + self.per_error * error + self.per_integral * integral
    }

    /// The low-passed sum after a sample with this sum.
    #[inline(always)]
    pub(crate) fn low_passed(&self, low_passed_sum: S, sum: S) -> S {
        low_passed_sum + self.low_pass_gain * (sum - low_passed_sum)
    }

    /// The compensation's opening (1, within ±1) for one of a valve without overlap, at this low-passed sum.
    #[inline(always)]
    pub(crate) fn add_step(&self, low_passed_sum: S, opening: S) -> S {
        let one = S::splat(1.0);
        let step = (self.slope * low_passed_sum).limit(-self.overlap, self.overlap);
        (opening + step).limit(-one, one)
    }

    /// Steps of single rigs in lanes.
    pub(crate) fn pack<'a>(lane: &dyn Fn(usize) -> &'a OverlapStep<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            overlap: S::from_lanes(|i| lane(i).overlap),
            slope: S::from_lanes(|i| lane(i).slope),
            low_pass_gain: S::from_lanes(|i| lane(i).low_pass_gain),
            per_error: S::from_lanes(|i| lane(i).per_error),
            per_integral: S::from_lanes(|i| lane(i).per_integral),
            present: (0..S::LANES).any(|i| lane(i).present),
        }
    }
}

/// The overlap (1) of a scheme that has one.
///
/// # Errors
/// An overlap outside [0, 0.5].
pub(crate) const fn overlap(p: &Parameters) -> Result<f64, ConfigError> {
    let overlap = check!(within("overlap", p.overlap, 0.0, 0.5));
    Ok(if matches!(p.mode, Mode::Linear) { 0.0 } else { overlap })
}

macro_rules! constructor {
    ($t:ty) => {
        impl OverlapStep<$t> {
            /// No overlap.
            pub(crate) const NONE: Self = Self {
                overlap: 0.0,
                slope: 0.0,
                low_pass_gain: 1.0,
                per_error: 0.0,
                per_integral: 0.0,
                present: false,
            };

            /// From the rig's parameters.
            ///
            /// # Errors
            /// An overlap outside [0, 0.5]; with an overlap, a sample rate or gain that is not positive.
            pub(crate) const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let overlap = check!(overlap(p));
                if overlap == 0.0 {
                    return Ok(Self::NONE);
                }
                let valve_gain = check!(positive("valve_gain", p.valve_gain));
                let per_volt = valve_gain * check!(positive("proportional_gain", p.proportional_gain));
                // More than the stroke for 1 N is no force loop. The sum is finite for every command within this bound.
                let sensitivity = check!(positive("force_sensitivity", p.force_sensitivity));
                check!(within("force_sensitivity", sensitivity, 0.0, 1.0 / per_volt));
                let sample_rate = check!(positive("sample_rate", p.sample_rate));
                let wide = Self {
                    overlap: overlap as $t,
                    slope: (1.0 / WIDE_STEP) as $t,
                    low_pass_gain: 1.0,
                    per_error: 0.0,
                    per_integral: 0.0,
                    present: true,
                };
                if !p.integrates() {
                    return Ok(wide);
                }
                Ok(Self {
                    slope: (1.0 / NARROW_STEP) as $t,
                    low_pass_gain: (1.0 / (1.0 + sample_rate * LOW_PASS_TIME * p.response_delay)) as $t,
                    per_error: (per_volt * sensitivity) as $t,
                    per_integral: valve_gain as $t,
                    ..wide
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

    const RIG: Parameters = Parameters { overlap: 0.02, integral_gain: 1.0, ..Parameters::ZHAO2005 };

    #[test]
    fn a_steady_opening_beyond_the_width_is_larger_by_the_overlap() {
        let lap = OverlapStep::<f64>::new(&RIG).unwrap();
        for (opening, expected) in
            [(0.0, 0.0), (0.004, 0.012), (0.01, 0.03), (-0.01, -0.03), (0.7, 0.72), (-0.99, -1.0)]
        {
            let found = lap.add_step(opening, opening);
            assert!((found - expected).abs() < 1e-12, "{opening}: {found}");
        }
    }

    #[test]
    fn without_an_integral_part_the_step_is_wide_and_the_compensations_alone() {
        let lap = OverlapStep::<f64>::new(&Parameters { integral_gain: 0.0, ..RIG }).unwrap();
        for (opening, expected) in [(0.04, 0.05), (-0.08, -0.1), (0.2, 0.22)] {
            let low_passed_sum = lap.low_passed(-0.5, lap.combined_opening(opening, 1e4, 0.1));
            let found = lap.add_step(low_passed_sum, opening);
            assert!(
                (found - expected).abs() < 1e-12 && (low_passed_sum - opening).abs() < 1e-12,
                "{opening}: {found}"
            );
        }
    }

    /// A first-order low-pass: after its time constant 1/e of a step is left.
    #[test]
    fn the_sign_follows_with_a_share_of_the_response_delay() {
        let p = Parameters { response_delay: 0.05, ..RIG };
        let lap = OverlapStep::<f64>::new(&p).unwrap();
        let mut low_passed_sum = 0.0;
        for _ in 0..(LOW_PASS_TIME * 0.05 * p.sample_rate) as usize {
            low_passed_sum = lap.low_passed(low_passed_sum, 1.0);
        }
        assert!((1.0 - low_passed_sum - libm::exp(-1.0)).abs() < 0.01, "{low_passed_sum}");
        let at_once = OverlapStep::<f64>::new(&Parameters { response_delay: 0.0, ..RIG }).unwrap();
        assert!((at_once.low_passed(0.0, 0.3) - 0.3).abs() < 1e-15);
    }

    #[test]
    fn noise_about_a_small_opening_leaves_most_of_the_step() {
        let lap = OverlapStep::<f64>::new(&RIG).unwrap();
        let (mut low_passed_sum, mut sum) = (0.02, 0.0);
        for n in 0..1000 {
            let noise = if n % 2 == 0 { 0.05 } else { -0.05 };
            low_passed_sum = lap.low_passed(low_passed_sum, 0.02 + noise);
            sum += lap.add_step(low_passed_sum, 0.02 + noise);
        }
        assert!((sum / 1000.0 - 0.04).abs() < 1e-9, "{sum}");
    }

    /// The compensation takes the step that the sum needs, so that the force loop needs none of its own.
    #[test]
    fn the_sum_with_the_force_loop_determines_the_step() {
        let p = Parameters { force_sensitivity: 2e-5, proportional_gain: 2.0, valve_gain: 0.1, ..RIG };
        let lap = OverlapStep::<f64>::new(&p).unwrap();
        let sum = lap.combined_opening(0.003, -5000.0, 0.05);
        assert!((sum + 0.012).abs() < 1e-12, "{sum}");
        let found = lap.add_step(sum, 0.003);
        assert!((found - (0.003 - 0.02)).abs() < 1e-12, "{found}");
    }

    /// The value and the range are those of a parameter, not of a product.
    #[test]
    fn a_force_loop_that_opens_the_valve_for_a_newton_is_refused_by_the_sensitivity() {
        let rig = |force_sensitivity| Parameters { force_sensitivity, ..RIG };
        let highest = 1.0 / (RIG.valve_gain * RIG.proportional_gain);
        let refused = OverlapStep::<f64>::new(&rig(20.0)).unwrap_err();
        let parameter = "force_sensitivity";
        assert_eq!(refused, ConfigError::OutOfRange { parameter, value: 20.0, lowest: 0.0, highest });
        assert!(OverlapStep::<f64>::new(&rig(highest)).is_ok());
    }

    #[test]
    fn refused_by_name() {
        for overlap in [-1e-3, 0.6, f64::NAN] {
            let refused = OverlapStep::<f64>::new(&Parameters { overlap, ..RIG }).unwrap_err();
            let named = match refused {
                ConfigError::NotFinite { parameter } | ConfigError::OutOfRange { parameter, .. } => parameter,
                other => panic!("{other:?}"),
            };
            assert_eq!(named, "overlap");
        }
    }
}
