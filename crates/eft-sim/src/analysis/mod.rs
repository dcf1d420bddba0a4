//! What can be said of a rig before a test.

pub mod feasibility;
pub mod linear;
