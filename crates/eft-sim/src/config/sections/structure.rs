//! The test structure.

use crate::config::schema::Kind::{Choice, Float, Floats};
use crate::config::schema::Need::{self, Optional, Required, Unless, When};
use crate::config::section::{choice, section};

const BILINEAR: Need = When("structure.kind", "bilinear");
const BUILDING: Need = When("structure.kind", "shear_building");
const ONE_FLOOR: Need = Unless("structure.kind", "shear_building");
const BOUC_WEN: Need = When("structure.kind", "bouc_wen");

section! {
    /// `[structure]`, Fig. 7.
    pub struct Structure in "structure." {
        kind: StructureKind = "", Choice(StructureKind::WORDS), Required, "kind of structure; the keys of other kinds are ignored";
        mass: f64 = "kg", Float(1e-3, 1e12), ONE_FLOOR, "mass m; without effect in a shear building";
        damping: f64 = "N·s/m", Float(0.0, 1e12), ONE_FLOOR, "viscous damping c; without effect in a shear building";
        stiffness: f64 = "N/m", Float(0.0, 1e15), ONE_FLOOR, "stiffness k; without effect in a shear building";
        /// Softening of the bilinear elastic kind.
        softening: Option<Softening>;
        /// Yielding of the Bouc–Wen kind.
        bouc_wen: Option<BoucWen>;
        /// A power-law damper in parallel with the viscous one, for any kind except the shear building.
        power_damper: Option<PowerDamper>;
        /// The stories of a shear building.
        stories: Option<Stories>;
    }
}

choice! {
    /// The kind of structure.
    pub enum StructureKind {
        /// Linear spring.
        Linear = "linear",
        /// Two slopes, elastic, continuous.
        Bilinear = "bilinear",
        /// Hysteretic.
        BoucWen = "bouc_wen",
        /// Several stories, each with an actuator.
        ShearBuilding = "shear_building",
    }
}

section! {
    /// Where and how a bilinear elastic spring softens.
    pub struct Softening in "structure.softening." {
        displacement: f64 = "m", Float(1e-6, 1e3), BILINEAR, "displacement beyond which the spring softens, Fig. 7";
        stiffness: f64 = "N/m", Float(0.0, 1e15), BILINEAR, "stiffness beyond that displacement, Fig. 7";
    }
}

section! {
    /// How a Bouc–Wen spring yields.
    pub struct BoucWen in "structure.bouc_wen." {
        yield_displacement: f64 = "m", Float(1e-6, 1e3), BOUC_WEN, "yield displacement of the hysteretic spring";
        post_yield_ratio: f64 = "", Float(0.0, 1.0), BOUC_WEN, "stiffness after yielding over the stiffness before";
        exponent: f64 = "", Float(1.0, 100.0), BOUC_WEN, "sharpness of the yield point n";
        shape: f64 = "", Float(0.0, 1.0), BOUC_WEN, "shape of the loop β, with γ = 1 − β";
    }
}

section! {
    /// The stories of a shear building, from the ground up; one actuator on each floor.
    pub struct Stories in "structure.stories." {
        masses: Vec<f64> = "kg", Floats(1, 64, 1e-3, 1e12), BUILDING, "masses of the floors of a shear building, from the ground up";
        dampings: Vec<f64> = "N·s/m", Floats(1, 64, 0.0, 1e12), BUILDING, "damping of the columns below each floor";
        stiffnesses: Vec<f64> = "N/m", Floats(1, 64, 1e-3, 1e15), BUILDING, "stiffness of the columns below each floor";
    }
}

section! {
    /// A fluid damper with a power law.
    pub struct PowerDamper in "structure.power_damper." {
        coefficient: f64 = "N", Float(0.0, 1e12), Optional, "power-law damper: force at 1 m/s";
        exponent: f64 = "", Float(0.05, 3.0), Optional, "power-law damper: exponent of the velocity";
    }
}

/// Mass of a floor, and its connection to the floor below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Story {
    /// Mass, kg.
    pub mass: f64,
    /// Viscous damping, N·s/m.
    pub damping: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
}

impl Structure {
    fn several(&self) -> Option<&Stories> {
        self.stories.as_ref().filter(|_| self.kind == StructureKind::ShearBuilding)
    }

    /// Number of stories, each with an actuator; 1 for any kind except the shear building.
    pub fn floors(&self) -> usize {
        self.several().map_or(1, |stories| stories.masses.len())
    }

    /// Story `n` from the ground up; any structure except the shear building has one story.
    pub fn story(&self, n: usize) -> Story {
        let of = |list: &[f64]| list.get(n).copied().unwrap_or(f64::NAN);
        match self.several() {
            Some(Stories { masses, dampings, stiffnesses }) => {
                Story { mass: of(masses), damping: of(dampings), stiffness: of(stiffnesses) }
            }
            None => Story { mass: self.mass, damping: self.damping, stiffness: self.stiffness },
        }
    }
}
