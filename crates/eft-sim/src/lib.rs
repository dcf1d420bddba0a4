//! The virtual rig of effective force testing.

mod checks;
pub mod config;
mod error;
pub mod excitation;
pub mod metrics;
pub mod records;

pub use config::RigConfig;
pub use error::{Error, Result};
