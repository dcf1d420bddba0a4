//! Each block of the core compared with its equations, and defined for all inputs.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod channel;
mod compensation;
mod controller;
mod endurance;
mod exhaustive;
mod integrity;
mod lead;
mod learning;
mod lost_motion;
mod lost_samples;
mod lost_valve_command;
mod own_calibration;
mod piecewise;
mod protection;
mod publication;
mod rig;
mod saved;
#[cfg(feature = "serde")]
mod wire;
