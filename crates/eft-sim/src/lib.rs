//! The virtual rig of effective force testing.

mod error;

pub use error::{Error, Result};
