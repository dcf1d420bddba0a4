//! The test structure.

use crate::config::section::{choice, section};

section! {
    /// `[structure]`, Fig. 7.
    pub struct Structure {
        /// The kind of structure; parts that a kind does not use are ignored.
        pub kind: StructureKind,
        /// Mass m, kg.
        pub mass: f64,
        /// Viscous damping c, N·s/m.
        pub damping: f64,
        /// Stiffness k, N/m.
        pub stiffness: f64,
        /// Softening of the bilinear elastic kind.
        pub softening: Option<Softening>,
        /// Yielding of the Bouc–Wen kind.
        pub bouc_wen: Option<BoucWen>,
        /// A power-law damper in parallel with the viscous one, for any kind except the shear building.
        pub power_damper: Option<PowerDamper>,
        /// The stories of a shear building.
        pub stories: Option<Stories>,
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
    pub struct Softening {
        /// Displacement of the kink, m.
        pub displacement: f64,
        /// Stiffness beyond the kink, N/m.
        pub stiffness: f64,
    }
}

section! {
    /// How a Bouc–Wen spring yields.
    pub struct BoucWen {
        /// Yield displacement, m.
        pub yield_displacement: f64,
        /// Stiffness after yielding over that before, dimensionless.
        pub post_yield_ratio: f64,
        /// Sharpness of the yield point n, dimensionless.
        pub exponent: f64,
        /// Shape β of the loop, with γ = 1 − β, dimensionless.
        pub shape: f64,
    }
}

section! {
    /// The stories of a shear building, from the ground up; one actuator on each floor.
    pub struct Stories {
        /// Masses of the floors, kg.
        pub masses: Vec<f64>,
        /// Damping of the columns below each floor, N·s/m.
        pub dampings: Vec<f64>,
        /// Stiffness of the columns below each floor, N/m.
        pub stiffnesses: Vec<f64>,
    }
}

section! {
    /// A fluid damper with a power law.
    pub struct PowerDamper {
        /// Force at a velocity of 1 m/s, N.
        pub coefficient: f64,
        /// Exponent of the velocity, dimensionless.
        pub exponent: f64,
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
