#![doc = include_str!("../README.md")]
// The last bits of the platform's functions differ between platforms, and a test has the same bits on each.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

#[allow(clippy::disallowed_methods, reason = "not part of a test")]
pub mod analysis;
pub mod batch;
mod checks;
pub mod closed_loop;
pub mod config;
pub mod design;
mod error;
mod files;
pub mod firmware;
mod fourier;
pub mod ground_motion;
#[allow(clippy::disallowed_methods, reason = "not part of a test")]
pub mod identification;
mod instruments;
mod interruption;
mod lanes;
#[allow(clippy::disallowed_methods, reason = "not part of a test")]
pub mod metrics;
pub mod plant;
mod state_space;
pub mod units;

pub use analysis::{Unreached, feasibility, growth_until_learned, guarded, learned, linear, prediction};
pub use closed_loop::{IdealResponse, SimulateOptions, TestRun, ideal_response, simulate};
pub use config::RigConfig;
pub use error::{Error, Result};
pub use firmware::{export, processor_in_the_loop};
pub use ground_motion::{excitation, preparation, records, spectra};
pub use interruption::interruptible;
