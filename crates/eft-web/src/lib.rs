//! The virtual rig in a browser: settings as text in, traces out.
//!
//! A page writes the settings of a test into a buffer ([`reserve`]), asks for the test ([`run`]) and reads what came of
//! it through [`pointer()`] and [`length`]. The functions take numbers only, so that nothing stands between the page and
//! the module.

mod abi;
mod session;

pub use abi::{length, pointer, reserve, run};
pub use session::{Session, Told, hash};
