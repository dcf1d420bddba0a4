//! Analyses of a rig before a test.

pub mod feasibility;
mod learned;
pub mod linear;
pub mod prediction;

pub(crate) use learned::after_learning;
pub use learned::{Unreached, learned};
