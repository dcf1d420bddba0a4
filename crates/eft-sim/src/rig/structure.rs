//! The test structure, Fig. 7: `m·ẍ + c·ẋ + r(x) = F`, `r` linear or bilinear elastic.

use crate::config::{RigConfig, StructureKind};
use crate::rig::Num;

/// Mass, viscous damper and spring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Structure<S> {
    per_mass: S,
    damping: S,
    /// Slope to the softening displacement.
    stiffness: S,
    /// What the spring loses at the softening displacement.
    lost_stiffness: S,
    softening_displacement: S,
}

impl<S: Num> Structure<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Self {
        let softening = |i: usize| match (rig(i).structure.kind, &rig(i).structure.softening) {
            (StructureKind::Bilinear, Some(s)) => (s.displacement, s.stiffness),
            // The elastic part; the one that yields is a block of its own.
            (StructureKind::BoucWen, _) => {
                let elastic = rig(i).structure.bouc_wen.as_ref().map_or(1.0, |b| b.post_yield_ratio);
                (0.0, elastic * rig(i).structure.stiffness)
            }
            _ => (0.0, rig(i).structure.stiffness),
        };
        Self {
            per_mass: S::from_lanes(|i| 1.0 / rig(i).structure.mass),
            damping: S::from_lanes(|i| rig(i).structure.damping),
            stiffness: S::from_lanes(|i| rig(i).structure.stiffness),
            lost_stiffness: S::from_lanes(|i| rig(i).structure.stiffness - softening(i).1),
            softening_displacement: S::from_lanes(|i| softening(i).0),
        }
    }

    /// Acceleration (m/s²) under a force (N) at a displacement (m) and velocity (m/s).
    #[inline(always)]
    pub(crate) fn acceleration(&self, force: S, displacement: S, velocity: S) -> S {
        self.linear_acceleration(force - self.softening_force(displacement), displacement, velocity)
    }

    /// Acceleration (m/s²) under a force (N) of the same structure without softening.
    #[inline(always)]
    pub(crate) fn linear_acceleration(&self, force: S, displacement: S, velocity: S) -> S {
        (force - self.damping * velocity - self.stiffness * displacement) * self.per_mass
    }

    /// What softening adds to the spring's force (N) at a displacement (m): zero up to the softening displacement,
    /// continuous there.
    #[inline(always)]
    pub(crate) fn softening_force(&self, displacement: S) -> S {
        let inner = displacement.limit(-self.softening_displacement, self.softening_displacement);
        self.lost_stiffness * (inner - displacement)
    }

    /// Force (N) of the viscous damper at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn damping_force(&self, velocity: S) -> S {
        self.damping * velocity
    }

    /// Kinetic energy and that of the spring (J).
    pub(crate) fn stored(&self, displacement: S, velocity: S) -> S {
        let half = S::splat(0.5);
        let inner = displacement.limit(-self.softening_displacement, self.softening_displacement);
        let beyond = displacement - inner;
        half * velocity * velocity / self.per_mass + half * self.stiffness * displacement * displacement
            - half * self.lost_stiffness * beyond * beyond
    }
}
