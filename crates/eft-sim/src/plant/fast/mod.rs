//! The paper's rig without other effects, one or several side by side: the linear part stepped exactly.

mod exponential;
mod plain;
mod propagator;

pub(crate) use exponential::{Exponential, FastState, Prediction};
