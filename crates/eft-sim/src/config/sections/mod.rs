//! One struct per section. Ranges and defaults are in [`super::KEYS`].

mod control;
mod hydraulics;
mod safety;
mod sensors;
mod structure;
mod verdict;

pub use control::*;
pub use hydraulics::*;
pub use safety::*;
pub use sensors::*;
pub use structure::*;
pub use verdict::*;
