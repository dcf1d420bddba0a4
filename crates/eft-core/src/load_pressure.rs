//! The load pressure's influence on the flow, Eq. (6) of the paper, as a factor on the demanded flow.

use crate::error::{ConfigError, check, finite, positive};
use crate::scalar::Scalar;

/// The radicand is not let below this: there the valve cannot pass the flow anyway.
const RADICAND_FLOOR: f64 = 0.05;

/// `1/√(1 − sgn(x)·F/(A·P_s))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPressure<S> {
    per_newton: S,
}

impl<S: Scalar> LoadPressure<S> {
    /// The factor (1) on the demanded flow for a force (N) and the direction the valve opens in (its sign counts),
    /// and where the radicand was raised to its floor.
    ///
    /// # NaN
    /// The factor lies within [0, 4.48] for every input. A NaN force reads as floored (or, without a direction, as
    /// no force).
    ///
    /// # Cost
    /// One multiplication, one subtraction, one square root, one division.
    #[inline(always)]
    pub fn factor(&self, force: S, direction: S) -> (S, S::Mask) {
        let one = S::splat(1.0);
        let floor = S::splat(RADICAND_FLOOR);
        let radicand = one - (force * self.per_newton).times_sign_of(direction);
        let regular = radicand.ge(floor);
        (one / S::select(regular, radicand, floor).sqrt(), !regular)
    }
    /// Corrections of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a LoadPressure<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self { per_newton: S::from_lanes(|i| lane(i).per_newton) }
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl LoadPressure<$t> {
            /// From piston area `A` (m²) and supply pressure `P_s` (Pa).
            ///
            /// # Errors
            /// Either not positive and finite, or their product too far from 1 for the scalar in use.
            pub const fn new(piston_area: f64, supply_pressure: f64) -> Result<Self, ConfigError> {
                let area = check!(positive("piston_area", piston_area));
                let pressure = check!(positive("supply_pressure", supply_pressure));
                let per_newton = (1.0 / check!(positive("supply_pressure", area * pressure))) as $t;
                Ok(Self { per_newton: check!(finite("supply_pressure", per_newton as f64)) as $t })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
