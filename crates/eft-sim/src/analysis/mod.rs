//! Analyses of a rig before a test.

pub mod feasibility;
mod guarded;
mod learned;
pub mod linear;
pub mod prediction;

pub use guarded::guarded;
pub(crate) use guarded::{Guarded, after_guard};
pub(crate) use learned::after_learning;
pub use learned::{Unreached, growth_until_learned, learned};
