//! The force loop: the paper's servovalve controller and the limits of what it commands.

mod integral;
mod limiter;
mod servovalve_controller;

pub(crate) use integral::Integral;
pub use limiter::Limiter;
pub use servovalve_controller::{ServovalveController, ServovalveControllerState};
