//! The actuator, Eq. (7): `K_a·Ṗ_L = Q_L − C_l·P_L − A·ẋ`.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::rig::Num;

/// Chambers and piston.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Actuator<S> {
    area: S,
    leakage: S,
    per_compressibility: S,
    stroke: S,
}

impl<S: Num> Actuator<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            area: S::from_lanes(|i| rig(i).actuator.piston_area),
            leakage: S::from_lanes(|i| rig(i).actuator.leakage),
            per_compressibility: S::from_lanes(|i| 1.0 / rig(i).actuator.compressibility),
            stroke: S::from_lanes(|i| rig(i).actuator.stroke),
        }
    }

    /// Rate of the load pressure (Pa/s) for a load flow (m³/s), the load pressure (Pa) and the piston velocity (m/s).
    #[inline(always)]
    pub(crate) fn rate(&self, load_flow: S, load_pressure: S, velocity: S) -> S {
        (load_flow - self.leakage * load_pressure - self.area * velocity) * self.per_compressibility
    }

    /// Force (N) of a load pressure (Pa), or force rate (N/s) of a pressure rate (Pa/s).
    #[inline(always)]
    pub(crate) fn force(&self, load_pressure: S) -> S {
        self.area * load_pressure
    }

    /// Where the piston (m) is beyond its stroke.
    #[inline(always)]
    pub(crate) fn beyond_stroke(&self, displacement: S) -> <S as Scalar>::Mask {
        displacement.abs().gt(self.stroke)
    }
}
