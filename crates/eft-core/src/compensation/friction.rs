//! Friction of the actuator's seals. The load cell is behind the seals, so the oil carries the measured force and the
//! friction, `A·P_L = F + F_f`. At each reversal `F_f` changes its sign, and the oil takes the flow `(K_a/A)·Ḟ_f`.

use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::Scalar;
use crate::parameters::Parameters;

/// Longest lead of the friction's flow (1, over the valve's response delay).
const LONGEST_LEAD: f64 = 0.5;
/// Largest friction (N); with it a force stays far below twice [`LARGEST`](crate::LARGEST).
const LARGEST_FRICTION: f64 = 1.0e9;

/// Coulomb friction with a slope at standstill, `F_f = F_c·sat(ẋ/v_0)`.
///
/// Within `±v_0` its flow leads the piston's by `F_c·K_a/(A²·v_0)`, as an additional lead of the velocity, which
/// amplifies the velocity's noise. `v_0` is [`Parameters::friction_velocity`], and larger where this lead would exceed
/// half of the response delay and two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Friction<S> {
    /// `F_c` (N).
    force: S,
    /// `F_c/v_0` (N·s/m).
    per_velocity: S,
    /// Whether any lane has friction.
    present: bool,
}
integrity!(Friction<T>: force, per_velocity, present);

impl<S: Scalar> Friction<S> {
    /// Whether any lane has friction.
    pub(crate) const fn is_present(&self) -> bool {
        self.present
    }

    /// The friction (N) against a velocity (m/s), within `±F_c`.
    #[inline(always)]
    pub(crate) fn against(&self, velocity: S) -> S {
        (self.per_velocity * velocity).limit(-self.force, self.force)
    }

    /// Frictions of single rigs in lanes.
    pub(crate) fn pack<'a>(lane: &dyn Fn(usize) -> &'a Friction<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            force: S::from_lanes(|i| lane(i).force),
            per_velocity: S::from_lanes(|i| lane(i).per_velocity),
            present: (0..S::LANES).any(|i| lane(i).present),
        }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Friction<$t> {
            /// No friction.
            pub(crate) const NONE: Self = Self { force: 0.0, per_velocity: 0.0, present: false };

            /// From the rig's parameters.
            ///
            /// # Errors
            /// A friction that is negative, beyond 1e9 N or not finite; with a friction, a velocity, area,
            /// compressibility or sample rate that is not positive.
            pub(crate) const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let force = check!(within("friction", p.friction, 0.0, LARGEST_FRICTION));
                if force == 0.0 {
                    return Ok(Self::NONE);
                }
                let velocity = check!(positive("friction_velocity", p.friction_velocity));
                let area = check!(positive("piston_area", p.piston_area));
                let compressibility = check!(positive("compressibility", p.compressibility));
                let two_samples = 2.0 / check!(positive("sample_rate", p.sample_rate));
                let lead = LONGEST_LEAD * p.response_delay;
                let lead = if lead > two_samples { lead } else { two_samples };
                // The piston moves by this distance (m) when the friction changes from 0 to `F_c`.
                let distance = force / area * (compressibility / area);
                let least = distance / lead;
                let velocity = if least > velocity { least } else { velocity };
                Ok(Self { force: force as $t, per_velocity: (force / velocity) as $t, present: true })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: Parameters = Parameters { friction: 800.0, friction_velocity: 0.01, ..Parameters::ZHAO2005 };

    #[test]
    fn it_is_proportional_to_small_velocities_and_constant_at_large_ones() {
        let friction = Friction::<f64>::new(&RIG).unwrap();
        for (velocity, expected) in
            [(0.0, 0.0), (0.004, 320.0), (-0.004, -320.0), (0.5, 800.0), (-9.0, -800.0)]
        {
            assert!((friction.against(velocity) - expected).abs() < 1e-9, "{velocity}");
        }
    }

    #[test]
    fn its_lead_is_at_most_half_of_the_response_delay_and_two_samples() {
        let stiffness = RIG.piston_area * RIG.piston_area / RIG.compressibility;
        for (response_delay, lead) in [(0.0058, 0.0029), (0.0, 2.0 / RIG.sample_rate)] {
            let p = Parameters { friction_velocity: 1e-6, response_delay, ..RIG };
            let friction = Friction::<f64>::new(&p).unwrap();
            assert!((friction.per_velocity / stiffness - lead).abs() < 1e-9, "{response_delay}");
        }
    }

    #[test]
    fn it_is_within_its_bounds_for_every_velocity() {
        let friction = Friction::<f32>::new(&RIG).unwrap();
        for velocity in [f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            assert!(friction.against(velocity).abs() <= 800.0, "{velocity}");
        }
    }

    #[test]
    fn refused_by_name() {
        for (name, p) in [
            ("friction", Parameters { friction: -1.0, ..RIG }),
            ("friction", Parameters { friction: f64::NAN, ..RIG }),
            ("friction_velocity", Parameters { friction_velocity: 0.0, ..RIG }),
        ] {
            match Friction::<f64>::new(&p).unwrap_err() {
                ConfigError::NotFinite { parameter }
                | ConfigError::NotPositive { parameter, .. }
                | ConfigError::OutOfRange { parameter, .. } => assert_eq!(parameter, name),
                other => panic!("{other:?}"),
            }
        }
    }
}
