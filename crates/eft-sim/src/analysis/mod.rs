//! Analyses of a rig before a test.

pub mod feasibility;
mod learned;
pub mod linear;
pub mod prediction;

pub use learned::learned;
