//! The test structure: stories above each other. A single structure has one story.
//!
//! `m_i·ẍ_i + f_i − f_{i+1} = F_i`, `f_i = c_i·ḋ_i + C·|ḋ_i|^a·sgn(ḋ_i) + r(d_i, z_i)` with the drift
//! `d_i = x_i − x_{i−1}`. Story 1 is on the ground; `f_i` is the force between floor `i` and the floor below.

use crate::config::{RigConfig, StructureKind};
use crate::lanes::Num;
use crate::plant::bouc_wen::BoucWen;
use crate::plant::power_damper::{PowerDamper, steepest};
use crate::plant::{EnergyBalance, Story};

/// Stories from the ground up.
#[derive(Debug, Clone)]
pub(crate) struct Structure<S> {
    floors: Vec<Floor<S>>,
}

/// A floor and its connection to the floor below.
#[derive(Debug, Clone)]
struct Floor<S> {
    story: Story<S>,
    power_damper: PowerDamper<S>,
    bouc_wen: BoucWen<S>,
}

/// Displacement (m), velocity (m/s) and hysteresis `z` of a floor, or of the drift below it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Motion<S> {
    pub(crate) displacement: S,
    pub(crate) velocity: S,
    pub(crate) hysteresis: S,
}

impl<S: Copy> Motion<S> {
    #[inline(always)]
    pub(crate) fn to_array(self) -> [S; 3] {
        [self.displacement, self.velocity, self.hysteresis]
    }

    #[inline(always)]
    pub(crate) fn from_array([displacement, velocity, hysteresis]: [S; 3]) -> Self {
        Self { displacement, velocity, hysteresis }
    }
}

impl<S: Num> Structure<S> {
    /// The true structures of `rig(0)`, `rig(1)`, … side by side, one per lane, with the same number of
    /// stories.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let rig: &dyn Fn(usize) -> _ = &|i| rig(i).plant();
        let floor = |n| Floor {
            story: Story::pack(rig, n),
            power_damper: PowerDamper::pack(rig),
            bouc_wen: BoucWen::pack(rig),
        };
        Self { floors: (0..rig(0).structure.floors()).map(floor).collect() }
    }

    /// Number of stories.
    pub(crate) fn len(&self) -> usize {
        self.floors.len()
    }

    /// Accelerations (m/s²) under a force (N) on each floor in motion: one pass from the roof down.
    #[inline(always)]
    pub(crate) fn accelerations(
        &self,
        force: impl Fn(usize) -> S,
        motion: impl Fn(usize) -> Motion<S>,
        mut store: impl FnMut(usize, S),
    ) {
        let mut from_above = S::splat(0.0);
        for (i, floor) in self.floors.iter().enumerate().rev() {
            let drift = drift(&motion, i);
            let spring_force =
                floor.power_damper.force(drift.velocity) + floor.bouc_wen.force(drift.hysteresis);
            let net_force = force(i) + from_above - spring_force;
            store(i, floor.story.acceleration(net_force, drift.displacement, drift.velocity));
            if i > 0 {
                from_above = spring_force + floor.story.force(drift.displacement, drift.velocity);
            }
        }
    }

    /// Rate (1/s) of a floor's hysteresis.
    #[inline(always)]
    pub(crate) fn hysteresis_rate(&self, i: usize, motion: impl Fn(usize) -> Motion<S>) -> S {
        let drift = drift(&motion, i);
        self.floors[i].bouc_wen.rate(drift.velocity, drift.hysteresis)
    }

    /// Adds the powers (W) of the dampers and the yielding parts.
    #[inline(always)]
    pub(crate) fn add_powers(&self, powers: &mut EnergyBalance<S>, motion: impl Fn(usize) -> Motion<S>) {
        for (i, floor) in self.floors.iter().enumerate() {
            let Motion { velocity, hysteresis, .. } = drift(&motion, i);
            let damping = floor.story.damping_force(velocity) + floor.power_damper.force(velocity);
            powers.damping = powers.damping + damping * velocity;
            powers.hysteresis = powers.hysteresis + floor.bouc_wen.force(hysteresis) * velocity;
        }
    }

    /// Kinetic energy and that of the elastic springs (J).
    pub(crate) fn stored(&self, motion: impl Fn(usize) -> Motion<S>) -> S {
        self.floors.iter().enumerate().fold(S::splat(0.0), |sum, (i, floor)| {
            let elastic = floor.story.elastic_energy(drift(&motion, i).displacement);
            sum + floor.story.kinetic_energy(motion(i).velocity) + elastic
        })
    }
}

/// Motion of a floor relative to the floor below.
#[inline(always)]
fn drift<S: Num>(motion: impl Fn(usize) -> Motion<S>, i: usize) -> Motion<S> {
    let above = motion(i);
    if i == 0 {
        return above;
    }
    let below = motion(i - 1);
    Motion {
        displacement: above.displacement - below.displacement,
        velocity: above.velocity - below.velocity,
        // It already belongs to the columns.
        hysteresis: above.hysteresis,
    }
}

/// Whether a structure needs more than one mass, viscous damper and elastic spring.
pub(crate) fn is_plain(rig: &RigConfig) -> bool {
    use StructureKind::{Bilinear, Linear};
    rig.structure.power_damper.is_none() && matches!(rig.structure.kind, Linear | Bilinear)
}

/// The drift (m) up to which the true structure moves linearly: zero with hysteresis or a power damper, infinite
/// without softening.
pub(crate) fn linear_up_to(rig: &RigConfig) -> f64 {
    let structure = &rig.plant().structure;
    match structure.kind {
        StructureKind::ShearBuilding => f64::INFINITY,
        _ if structure.power_damper.is_some() => 0.0,
        StructureKind::Linear => f64::INFINITY,
        StructureKind::Bilinear => {
            structure.softening.as_ref().map_or(f64::INFINITY, |soft| soft.displacement)
        }
        StructureKind::BoucWen => 0.0,
    }
}

/// The fastest rate (1/s) of the parts beyond the plain structure.
pub(crate) fn fastest_rate(rig: &RigConfig) -> f64 {
    let structure = &rig.structure;
    if structure.kind != StructureKind::ShearBuilding {
        let damper = structure.power_damper.as_ref();
        return damper.map_or(0.0, |d| steepest(d.coefficient, d.exponent) / structure.mass);
    }
    // Gershgorin's circles limit the frequency of every mode of a building.
    let stories: Vec<_> = (0..structure.floors()).map(|n| structure.story(n)).collect();
    let bound = |(i, story): (usize, &crate::config::Story)| {
        let (k, c) = stories.get(i + 1).map_or((0.0, 0.0), |above| (above.stiffness, above.damping));
        let elastic = (2.0 * (story.stiffness + k) / story.mass).sqrt();
        elastic.max(2.0 * (story.damping + c) / story.mass)
    };
    stories.iter().enumerate().map(bound).fold(0.0, f64::max)
}
