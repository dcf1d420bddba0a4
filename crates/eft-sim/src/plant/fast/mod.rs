//! The paper's rig without further effects, one or several side by side, with an exact step of the linear
//! part.

mod exponential;
mod plain;
mod propagator;

pub(crate) use exponential::{Exponential, FastState, Prediction};
