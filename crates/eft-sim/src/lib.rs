//! The virtual rig of effective force testing.

mod checks;
mod error;
pub mod excitation;
pub mod metrics;
pub mod records;

pub use error::{Error, Result};
