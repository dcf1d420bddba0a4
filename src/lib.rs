#![doc = include_str!("README.md")]

pub use eft_core as core;
pub use eft_sim as sim;
