//! The force loop: the paper's servovalve controller and the limits of what it commands.

mod limiter;
mod servovalve_controller;

pub use limiter::Limiter;
pub use servovalve_controller::{ServovalveController, ServovalveControllerState};
