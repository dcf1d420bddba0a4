//! The whole test structure: mass, viscous damper and spring, a power-law damper, a part that yields.

use crate::config::{RigConfig, StructureKind};
use crate::rig::Num;
use crate::rig::bouc_wen::BoucWen;
use crate::rig::power_damper::{PowerDamper, steepest};
use crate::rig::structure::Structure;

/// `m·ẍ + c·ẋ + C·|ẋ|^a·sgn(ẋ) + r(x, z) = F`.
#[derive(Debug, Clone)]
pub(crate) struct Specimen<S> {
    structure: Structure<S>,
    power_damper: PowerDamper<S>,
    bouc_wen: BoucWen<S>,
}

impl<S: Num> Specimen<S> {
    /// The true structures of `rig(0)`, `rig(1)`, … side by side, one a lane.
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Self {
        let rig = |i| rig(i).plant();
        Self {
            structure: Structure::pack(rig),
            power_damper: PowerDamper::pack(rig),
            bouc_wen: BoucWen::pack(rig),
        }
    }

    /// Acceleration (m/s²) under a force (N) at a displacement (m), velocity (m/s) and hysteresis `z`.
    #[inline(always)]
    pub(crate) fn acceleration(&self, force: S, displacement: S, velocity: S, z: S) -> S {
        let taken = self.power_damper.force(velocity) + self.bouc_wen.force(z);
        self.structure.acceleration(force - taken, displacement, velocity)
    }

    /// Rate (1/s) of the hysteresis `z`.
    #[inline(always)]
    pub(crate) fn hysteresis_rate(&self, velocity: S, z: S) -> S {
        self.bouc_wen.rate(velocity, z)
    }

    /// Power (W) lost in the dampers.
    #[inline(always)]
    pub(crate) fn damping_loss(&self, velocity: S) -> S {
        (self.structure.damping_force(velocity) + self.power_damper.force(velocity)) * velocity
    }

    /// Power (W) into the part that yields.
    #[inline(always)]
    pub(crate) fn hysteresis_power(&self, velocity: S, z: S) -> S {
        self.bouc_wen.force(z) * velocity
    }

    /// Kinetic energy and that of the elastic spring (J).
    pub(crate) fn stored(&self, displacement: S, velocity: S) -> S {
        self.structure.stored(displacement, velocity)
    }
}

/// Whether a structure needs more than mass, viscous damper and elastic spring.
pub(crate) fn is_plain(rig: &RigConfig) -> bool {
    rig.structure.power_damper.is_none() && rig.structure.kind != StructureKind::BoucWen
}

/// The fastest rate (1/s) that the parts beyond the plain structure bring.
pub(crate) fn fastest_rate(rig: &RigConfig) -> f64 {
    let s = &rig.structure;
    s.power_damper.as_ref().map_or(0.0, |d| steepest(d.coefficient, d.exponent) / s.mass)
}
