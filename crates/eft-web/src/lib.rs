//! The virtual rig in a browser: settings as text in, traces out.
//!
//! A page writes the settings of a test into a buffer ([`reserve`]), runs the test ([`run`]) and reads its
//! results through [`pointer()`] and [`length`]. The functions have numbers as arguments only, so the page
//! needs no further interface to the module.

mod abi;
mod session;

pub use abi::{length, pointer, reserve, run};
pub use session::{Session, Told, hash};
