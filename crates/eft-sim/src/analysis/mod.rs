//! Analyses of a rig before a test.

pub mod feasibility;
pub mod linear;
