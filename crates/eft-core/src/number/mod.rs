//! The numbers that the blocks are written over: `f32`, `f64` and lanes of them.

mod lanes;
mod row;
pub(crate) mod scalar;
#[cfg(test)]
mod tests;

pub use lanes::{LaneFlags, LaneMask, Lanes};
pub(crate) use row::CROWDED;
#[cfg(test)]
pub(crate) use row::search;
pub use row::{CELLS, Row};
pub use scalar::{Flags, Mask, Real, Scalar};
