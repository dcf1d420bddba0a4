//! Mass, viscous damper and spring of a story, Fig. 7: `m·ẍ + c·ẋ + r(x) = F`, `r` linear or bilinear elastic.

use crate::config::{RigConfig, StructureKind};
use crate::lanes::Num;

/// Mass, viscous damper and spring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Story<S> {
    per_mass: S,
    damping: S,
    /// Stiffness up to the softening displacement.
    stiffness: S,
    /// Decrease of the stiffness at the softening displacement.
    lost_stiffness: S,
    softening_displacement: S,
}

impl<S: Num> Story<S> {
    /// Story `n` of each rig, from the ground up.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig, n: usize) -> Self {
        let story = |i: usize| rig(i).structure.story(n);
        let softening = |i: usize| match (rig(i).structure.kind, &rig(i).structure.softening) {
            (StructureKind::Bilinear, Some(s)) => (s.displacement, s.stiffness),
            // The elastic part; the yielding part is a separate block.
            (StructureKind::BoucWen, _) => {
                let elastic = rig(i).structure.bouc_wen.as_ref().map_or(1.0, |b| b.post_yield_ratio);
                (0.0, elastic * story(i).stiffness)
            }
            _ => (0.0, story(i).stiffness),
        };
        Self {
            per_mass: S::from_lanes(|i| 1.0 / story(i).mass),
            damping: S::from_lanes(|i| story(i).damping),
            stiffness: S::from_lanes(|i| story(i).stiffness),
            lost_stiffness: S::from_lanes(|i| story(i).stiffness - softening(i).1),
            softening_displacement: S::from_lanes(|i| softening(i).0),
        }
    }

    /// Acceleration (m/s²) under a force (N) at a displacement (m) and velocity (m/s).
    #[inline(always)]
    pub(crate) fn acceleration(&self, force: S, displacement: S, velocity: S) -> S {
        self.linear_acceleration(force - self.softening_force(displacement), displacement, velocity)
    }

    /// Acceleration (m/s²) under a force (N) of the same story without softening.
    #[inline(always)]
    pub(crate) fn linear_acceleration(&self, force: S, displacement: S, velocity: S) -> S {
        (force - self.damping * velocity - self.stiffness * displacement) * self.per_mass
    }

    /// Change of the spring's force (N) by softening at a displacement (m). It is zero up to the softening
    /// displacement and continuous there.
    #[inline(always)]
    pub(crate) fn softening_force(&self, displacement: S) -> S {
        self.lost_stiffness * (self.straight(displacement) - displacement)
    }

    /// Force (N) of damper and spring at a displacement (m) and velocity (m/s).
    #[inline(always)]
    pub(crate) fn force(&self, displacement: S, velocity: S) -> S {
        self.damping_force(velocity) + self.stiffness * displacement + self.softening_force(displacement)
    }

    /// Force (N) of the viscous damper at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn damping_force(&self, velocity: S) -> S {
        self.damping * velocity
    }

    /// Kinetic energy (J) at a velocity (m/s).
    pub(crate) fn kinetic_energy(&self, velocity: S) -> S {
        S::splat(0.5) * velocity * velocity / self.per_mass
    }

    /// Energy (J) of the spring at a displacement (m).
    pub(crate) fn elastic_energy(&self, displacement: S) -> S {
        let beyond = displacement - self.straight(displacement);
        S::splat(0.5) * (self.stiffness * displacement * displacement - self.lost_stiffness * beyond * beyond)
    }

    /// The part of a displacement (m) up to the softening displacement.
    #[inline(always)]
    fn straight(&self, displacement: S) -> S {
        displacement.limit(-self.softening_displacement, self.softening_displacement)
    }
}
