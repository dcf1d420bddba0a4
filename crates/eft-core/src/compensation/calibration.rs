//! The learner's estimates, in the form that the tick uses.

use crate::integrity::integrity;

use crate::compensation::{CurvePiece, LeadNetwork, PIECES, table_itself};
use crate::error::{ConfigError, LARGEST, SMALLEST, check, positive, within};
use crate::number::{Flags, Scalar};
use crate::parameters::Parameters;

/// The only data that goes from the learner to the tick, made once a window.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Calibration<S: Scalar> {
    /// Number of its window; `u32::MAX` if it comes from the configuration or from what was saved.
    pub window: u32,
    /// Bits of [`status`](crate::status) about the learning.
    pub status: S::Flags,
    /// True flow over the table's, `θ` (1).
    pub flow_gain: S,
    /// 1/`flow_gain` (1), by which the tick multiplies the demanded flow.
    pub per_flow_gain: S,
    /// The inverse of the estimated valve, with the guard's level in its gain.
    pub lead: LeadNetwork<S>,
    /// Delay (s) of the measured spool after its command: that of the valve, half a sample of hold, and computation. It
    /// is that of the lead network that undoes the valve best in the motion that was learned.
    pub response_delay: S,
    /// Delay (s) of the measured velocity after the measured spool. The lead network compensates for both delays.
    pub velocity_delay: S,
    /// The spool's gain over the configured one (1), with that network, in that motion. It exceeds the gain at rest.
    pub valve_gain: S,
    /// Commanded opening (1) at which the valve passes nothing at no load.
    pub null_offset: S,
    /// The compensation signal (V) for the null offset, `null_offset/(G_p·K_s)`, which the tick adds. With an integral
    /// part it is that of the known [`null_bias`](Parameters::null_bias) alone.
    pub null_signal: S,
    /// The guard's factor on the compensation level (1).
    pub level: S,
    /// Standard deviations of the estimates.
    pub deviations: Deviations<S>,
    /// The gate's test ratio (1): the models' squared residual over its permitted value. Above 1 nothing is learned.
    pub test_ratio: S,
    /// The flow table's correction, from the most negative flow up.
    pub curve: [CurvePiece<S>; PIECES],
}
integrity!(
    Calibration<T>: window, status, flow_gain, per_flow_gain, lead, response_delay, velocity_delay, valve_gain,
    null_offset, null_signal, level, deviations, test_ratio, curve
);

/// Standard deviations of the estimates; infinite before anything is learned.
///
/// They have two parts. The scatter from test to test by noise follows from the information of the least squares and
/// from the models' mean square residual. The systematic errors of the models are the same in every test. Their size
/// follows from the delays and from the motion's mean-square frequency; of some only a bound is known. The page on
/// self-calibration has the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Deviations<S> {
    /// Of the flow gain (1).
    pub flow_gain: S,
    /// Of the valve gain (1).
    pub valve_gain: S,
    /// Of the response delay (s).
    pub response_delay: S,
    /// Of the velocity's delay (s).
    pub velocity_delay: S,
    /// Of the null offset (1).
    pub null_offset: S,
}
integrity!(Deviations<T>: flow_gain, valve_gain, response_delay, velocity_delay, null_offset);

impl<S: Scalar> Deviations<S> {
    /// Nothing learned.
    pub(crate) fn unknown() -> Self {
        let unknown = S::splat(f64::INFINITY);
        Self {
            flow_gain: unknown,
            valve_gain: unknown,
            response_delay: unknown,
            velocity_delay: unknown,
            null_offset: unknown,
        }
    }
}

impl<S: Scalar> Calibration<S> {
    /// The paper's scheme, from a lead network, the response delay (s) for which it compensates, and the known null
    /// bias (1).
    pub(crate) fn of(lead: LeadNetwork<S>, response_delay: S, null_bias: S) -> Self {
        let one = S::splat(1.0);
        Self {
            window: u32::MAX,
            status: S::Flags::default(),
            flow_gain: one,
            per_flow_gain: one,
            lead,
            response_delay,
            velocity_delay: S::splat(0.0),
            valve_gain: one,
            null_offset: null_bias,
            null_signal: null_bias * lead.gain(),
            level: one,
            deviations: Deviations::unknown(),
            test_ratio: S::splat(0.0),
            curve: table_itself(),
        }
    }

    /// Calibrations of single rigs in lanes, each of the same window.
    #[inline(always)]
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a Calibration<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        let of = |value: fn(&Calibration<S::Element>) -> S::Element| S::from_lanes(|i| value(lane(i)));
        let mut curve = table_itself();
        for (n, piece) in curve.iter_mut().enumerate() {
            let of = |i: usize| lane(i).curve.get(n);
            piece.offset = S::from_lanes(|i| of(i).map_or(S::Element::default(), |p| p.offset));
            piece.slope = S::from_lanes(|i| of(i).map_or(S::Element::default(), |p| p.slope));
        }
        Self {
            window: lane(0).window,
            status: S::Flags::from_lanes(|i| lane(i).status),
            flow_gain: of(|c| c.flow_gain),
            per_flow_gain: of(|c| c.per_flow_gain),
            lead: LeadNetwork::pack(&|i| &lane(i).lead),
            response_delay: of(|c| c.response_delay),
            velocity_delay: of(|c| c.velocity_delay),
            valve_gain: of(|c| c.valve_gain),
            null_offset: of(|c| c.null_offset),
            null_signal: of(|c| c.null_signal),
            level: of(|c| c.level),
            deviations: Deviations {
                flow_gain: of(|c| c.deviations.flow_gain),
                valve_gain: of(|c| c.deviations.valve_gain),
                response_delay: of(|c| c.deviations.response_delay),
                velocity_delay: of(|c| c.deviations.velocity_delay),
                null_offset: of(|c| c.deviations.null_offset),
            },
            test_ratio: of(|c| c.test_ratio),
            curve,
        }
    }
}

/// The estimates with their standard deviations, without the coefficients for the tick.
#[cfg(feature = "defmt")]
impl<T: crate::number::Real + defmt::Format> defmt::Format for Calibration<T> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "window {=u32}: flow gain {} ± {}, valve gain {} ± {}, response delay {} ± {} s, \
             velocity delay {} ± {} s, null offset {} ± {}, level {}, test ratio {} {}",
            self.window,
            self.flow_gain,
            self.deviations.flow_gain,
            self.valve_gain,
            self.deviations.valve_gain,
            self.response_delay,
            self.deviations.response_delay,
            self.velocity_delay,
            self.deviations.velocity_delay,
            self.null_offset,
            self.deviations.null_offset,
            self.level,
            self.test_ratio,
            crate::status::Words(self.status),
        );
    }
}

/// The known null bias (1).
///
/// # Errors
/// A null bias outside [-0.5, 0.5].
pub(crate) const fn null_bias(p: &Parameters) -> Result<f64, ConfigError> {
    within("null_bias", p.null_bias, -0.5, 0.5)
}

macro_rules! constructor {
    ($t:ty) => {
        impl Calibration<$t> {
            /// The paper's scheme: the configured valve and the uncorrected flow table.
            ///
            /// # Errors
            /// A valve gain, proportional gain, response delay, `α`, sample rate or null bias that is refused, by name.
            pub fn nominal(p: &Parameters) -> Result<Self, ConfigError> {
                let lead = check!(LeadNetwork::<$t>::by(p));
                Ok(Self::of(lead, p.response_delay as $t, check!(null_bias(p)) as $t))
            }
        }

        impl LeadNetwork<$t> {
            /// From the configuration.
            pub(crate) const fn by(p: &Parameters) -> Result<Self, ConfigError> {
                let valve_gain = check!(positive("valve_gain", p.valve_gain));
                let proportional = check!(positive("proportional_gain", p.proportional_gain));
                let (lowest, highest) = (1.0 / (LARGEST * proportional), 1.0 / (SMALLEST * proportional));
                check!(within("valve_gain", valve_gain, lowest, highest));
                Self::new(1.0 / (proportional * valve_gain), p.response_delay, p.lead_alpha, p.sample_rate)
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    /// A valve as configured, a flow table without a correction, and estimates of unknown error.
    #[test]
    fn the_nominal_calibration_changes_nothing() {
        let found = Calibration::<f64>::nominal(&Parameters::ZHAO2005).unwrap();
        let factors = [found.flow_gain, found.per_flow_gain, found.valve_gain, found.level];
        let offsets = [found.velocity_delay, found.null_offset, found.null_signal, found.test_ratio];
        assert_eq!((factors, offsets, found.response_delay), ([1.0; 4], [0.0; 4], 5.0e-3));
        for piece in found.curve {
            assert_eq!(piece, CurvePiece { offset: 0.0, slope: 1.0 });
        }
        let Deviations { flow_gain, valve_gain, response_delay, velocity_delay, null_offset } =
            found.deviations;
        let deviations = [flow_gain, valve_gain, response_delay, velocity_delay, null_offset];
        assert!(deviations.into_iter().all(|deviation| deviation > f64::MAX));
        // 1/(G_p·K_s)
        assert!((found.lead.gain() * 0.8059 * 0.1 - 1.0).abs() < 1e-15);
    }

    /// The value and the range are those of a parameter, not of `1/(G_p·K_s)`.
    #[test]
    fn a_product_of_gains_out_of_range_is_refused_by_the_valve_gain() {
        for (proportional_gain, refused, accepted) in
            [(1e-2, 0.999e-10, 1.001e-10), (1e8, 1.001e10, 0.999e10)]
        {
            let of = |valve_gain| {
                Calibration::<f64>::nominal(&Parameters {
                    proportional_gain,
                    valve_gain,
                    ..Parameters::ZHAO2005
                })
            };
            let error = of(refused).unwrap_err();
            let ConfigError::OutOfRange { parameter: "valve_gain", value, lowest, highest } = error else {
                panic!("{error:?}");
            };
            assert!(value.total_cmp(&refused).is_eq());
            let allowed = [1e-12 / proportional_gain, 1e18 / proportional_gain];
            assert!((lowest / allowed[0] - 1.0).abs() < 1e-12 && (highest / allowed[1] - 1.0).abs() < 1e-12);
            assert!(of(accepted).is_ok());
        }
    }

    #[test]
    fn a_known_null_bias_is_held_by_its_signal_and_refused_beyond_half_the_stroke() {
        for bias in [-0.5, -0.02, 0.02, 0.5] {
            let p = Parameters { null_bias: bias, ..Parameters::ZHAO2005 };
            let found = Calibration::<f64>::nominal(&p).unwrap();
            // The force loop turns 1 V of compensation into G_p·K_s of opening.
            let opening = found.null_signal * p.proportional_gain * p.valve_gain;
            assert!(
                found.null_offset.total_cmp(&bias).is_eq() && (opening / bias - 1.0).abs() < 1e-12,
                "{found:?}"
            );
        }
        for bias in [-0.51, 0.51, f64::NAN] {
            let p = Parameters { null_bias: bias, ..Parameters::ZHAO2005 };
            let refused = Calibration::<f64>::nominal(&p);
            let (Err(ConfigError::OutOfRange { parameter, .. }) | Err(ConfigError::NotFinite { parameter })) =
                refused
            else {
                panic!("{refused:?}");
            };
            assert_eq!(parameter, "null_bias");
        }
    }
}
