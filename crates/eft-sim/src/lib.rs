#![doc = include_str!("../README.md")]

pub mod batch;
mod checks;
pub mod closed_loop;
pub mod config;
mod dispatch;
#[cfg(target_arch = "x86_64")]
mod eight;
mod error;
pub mod excitation;
pub mod export;
pub mod feasibility;
mod files;
mod fourier;
pub mod identification;
pub mod linear;
pub mod metrics;
pub mod preparation;
pub mod processor_in_the_loop;
pub mod records;
pub mod rig;
mod sensors;
pub mod spectra;

pub use closed_loop::{IdealResponse, SimulateOptions, TestRun, ideal_response, simulate};
pub use config::RigConfig;
pub use error::{Error, Result};
