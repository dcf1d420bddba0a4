//! The simulation compared with independent answers: smaller steps, closed forms, energy, linear models, other
//! machines.
#![allow(clippy::unwrap_used)]

mod convergence;
mod diverging;
mod effects;
mod golden_bits;
mod linear_against_simulation;
#[path = "../results/mod.rs"]
mod results;
mod truth;
