//! The firmware of the rig `guarded`: velocity observer, protection, and a controller that adapts.

use eft_rigs::guarded_tick::{self, State};

pub use eft_rigs::guarded::SAMPLE_RATE;

use crate::{Answer, Sample};

/// What it remembers.
pub struct Firmware(State);

impl Firmware {
    /// At rest.
    pub fn new() -> Self {
        Self(State::at_rest())
    }

    /// One tick.
    pub fn tick(&mut self, s: &Sample) -> Answer {
        let (velocity, output) = self.0.step(&guarded_tick::Sample {
            command: s.command,
            displacement: s.displacement,
            force: s.force,
            spool: s.spool,
            supply_pressure: s.supply_pressure,
        });
        let learned = &self.0.controller.compensation;
        Answer {
            output,
            velocity,
            flow_gain: learned.flow_gain(),
            response_delay: learned.response_delay(),
            valve_gain: learned.valve_gain(),
            level: learned.level(),
        }
    }
}
