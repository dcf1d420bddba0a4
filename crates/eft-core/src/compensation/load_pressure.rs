//! The load pressure's influence on the flow, Eq. (6) of the paper, as a factor on the demanded flow.

use crate::error::{ConfigError, check, positive};
use crate::integrity::integrity;
use crate::number::Scalar;

/// Floor of the radicand. Below it the valve cannot pass the flow in any case.
const RADICAND_FLOOR: f64 = 0.05;

/// `1/√(1 − sgn(x)·F/(A·P_s))`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct LoadPressure<S> {
    per_newton: S,
}
integrity!(LoadPressure<T>: per_newton);

impl<S: Scalar> LoadPressure<S> {
    /// The factor (1) on the demanded flow for a force (N) and the direction in which the valve opens (its sign
    /// counts), and where the radicand was raised to its floor.
    ///
    /// # NaN
    /// The factor lies within [0, 4.48] for every input. With a NaN force the radicand is at its floor. Without a
    /// direction, a NaN force counts as no force.
    ///
    /// # Cost
    /// One multiplication, one subtraction, one square root, one division.
    #[inline(always)]
    pub fn factor(&self, force: S, direction: S) -> (S, S::Mask) {
        let (root, floored) = self.root(force, direction, S::splat(1.0));
        (S::splat(1.0) / root, floored)
    }

    /// The factor's reciprocal, `√(supply − sgn(x)·F/(A·P_s))`, with the supply at a multiple `supply` (1) of its
    /// pressure. A division by it saves a multiplication.
    #[inline(always)]
    pub fn root(&self, force: S, direction: S, supply: S) -> (S, S::Mask) {
        let (zero, floor) = (S::splat(0.0), S::splat(RADICAND_FLOOR));
        let share = force * self.per_newton;
        let closing = S::select(direction.lt(zero), supply + share, supply);
        let radicand = S::select(direction.gt(zero), supply - share, closing);
        let regular = radicand.ge(floor);
        (S::select(regular, radicand, floor).sqrt(), !regular)
    }
    /// Corrections of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a LoadPressure<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self { per_newton: S::from_lanes(|i| lane(i).per_newton) }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl LoadPressure<$t> {
            /// No correction: the factor is 1 for every force.
            pub const NONE: Self = Self { per_newton: 0.0 };

            /// From piston area `A` (m²) and supply pressure `P_s` (Pa).
            ///
            /// # Errors
            /// Either not positive and finite.
            pub const fn new(piston_area: f64, supply_pressure: f64) -> Result<Self, ConfigError> {
                let area = check!(positive("piston_area", piston_area));
                let pressure = check!(positive("supply_pressure", supply_pressure));
                Ok(Self { per_newton: (1.0 / (area * pressure)) as $t })
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
    fn factor_is_the_root_of_equation_6() {
        let correction = LoadPressure::<f64>::new(8.212e-3, 1.9e7).unwrap();
        for percent in -100..=95 {
            let share = f64::from(percent) / 100.0;
            let force = share * 8.212e-3 * 1.9e7;
            for direction in [1.0, 0.01] {
                let (factor, floored) = correction.factor(force, direction);
                assert!((factor * factor * (1.0 - share) - 1.0).abs() < 1e-13, "{share}");
                assert!(!floored || percent == 95);
                let (mirrored, _) = correction.factor(-force, -direction);
                assert!((mirrored - factor).abs() < 1e-15);
            }
            let (closed, floored) = correction.factor(force, 0.0);
            assert!((closed - 1.0).abs() < 1e-15 && !floored);
        }
    }

    #[test]
    fn factor_is_finite_and_floored_where_the_valve_cannot_follow() {
        let correction = LoadPressure::<f32>::new(8.212e-3, 1.9e7).unwrap();
        let most = 1.0 / libm::sqrtf(0.05);
        for force in [1.6e5, 1.0e12, f32::MAX, f32::INFINITY, f32::NAN] {
            let (factor, floored) = correction.factor(force, 1.0);
            assert!(floored && factor.to_bits() == most.to_bits());
        }
        for force in [-1.6e5, -1.0e12, f32::MIN, f32::NEG_INFINITY] {
            let (factor, floored) = correction.factor(force, 1.0);
            assert!(!floored && (0.0..1.0).contains(&factor));
        }
    }
}
