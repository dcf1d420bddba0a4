//! Controllers designed from a rig.
//!
//! The rooms below take plain numbers, so that the configuration can ask them for a controller.

mod force_loop;
mod held_piston;

pub use force_loop::{ForceLoop, ForceLoopMargins, design};
pub use held_piston::HeldPiston;
