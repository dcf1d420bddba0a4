//! The numbers that the blocks are written over: `f32`, `f64` and lanes of them.

mod lanes;
pub(crate) mod scalar;
#[cfg(test)]
mod tests;

pub use lanes::{LaneFlags, LaneMask, Lanes};
pub use scalar::{Flags, Mask, Real, Scalar};
