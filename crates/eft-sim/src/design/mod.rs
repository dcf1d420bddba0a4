//! Controllers designed from a rig.
//!
//! All functions take plain numbers, so that the configuration can call them.

mod cache;
mod force_loop;
mod held_piston;
mod known_rig;
mod phase_delay;
mod velocity_estimate;

pub use cache::design;
pub use force_loop::{ForceLoop, ForceLoopMargins};
pub use held_piston::HeldPiston;
pub(crate) use held_piston::PRESSURE;
pub use phase_delay::phase_delay;
pub(crate) use velocity_estimate::{EstimateStates, ObserverNoises, VelocityEstimate, observer_gains};
