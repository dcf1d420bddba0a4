//! The firmware of the paper's rig: one controller.

use eft_core::{Controller, ControllerState};
use eft_rigs::zhao2005::{CONTROLLER, PARAMETERS, POINTS};

pub use eft_rigs::zhao2005::SAMPLE_RATE;

use crate::{Answer, Sample};

/// The controller and what it remembers.
pub struct Firmware {
    controller: Controller<f32, POINTS>,
    state: ControllerState<f32>,
}

impl Firmware {
    /// At rest.
    pub fn new() -> Self {
        #[cfg(feature = "flipped")]
        let controller = crate::flipped::controller(&CONTROLLER);
        #[cfg(not(feature = "flipped"))]
        let controller = CONTROLLER;
        Self { controller, state: ControllerState::default() }
    }

    /// One tick.
    pub fn tick(&mut self, s: &Sample) -> Answer {
        let output = self.controller.step(&mut self.state, s.command, s.velocity, s.force, s.spool);
        let delay = PARAMETERS.response_delay as f32;
        Answer {
            output,
            velocity: s.velocity,
            flow_gain: 1.0,
            response_delay: delay,
            valve_gain: 1.0,
            level: 1.0,
        }
    }
}
