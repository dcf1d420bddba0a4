//! One struct per section, with a row of the schema for each value: unit, range, default and meaning.

mod control;
mod hydraulics;
mod rig;
mod safety;
mod sensors;
mod structure;
mod verdict;

pub use control::*;
pub use hydraulics::*;
pub use rig::*;
pub use safety::*;
pub use sensors::*;
pub use structure::*;
pub use verdict::*;
