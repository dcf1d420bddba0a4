//! Effective force testing in one crate: [`core`] is the controller that firmware links,
//! [`sim`] the virtual rig around it.

pub use eft_core as core;
pub use eft_sim as sim;
