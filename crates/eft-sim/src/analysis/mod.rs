//! Analyses of a rig before a test.

mod adaptation;
pub mod feasibility;
mod guarded;
mod learned;
pub mod linear;
mod motion;
pub mod prediction;

pub(crate) use adaptation::Adaptation;
pub use adaptation::growth_until_learned;
pub use guarded::guarded;
pub(crate) use guarded::{Guarded, after_guard};
pub(crate) use learned::after_learning;
pub use learned::{Unreached, learned};
