//! One tick of the rig `guarded` in its firmware: what stands around the controller, in the simulator's order.

use eft_core::{
    AdaptiveControllerState, ControllerOutput, Measurements, ProtectionState, VelocityObserverState,
};

use crate::guarded::{CONTROLLER, PER_MASS, PROTECTION, VELOCITY};

/// What the rig's firmware remembers.
pub struct State {
    /// The controller's part.
    pub controller: AdaptiveControllerState<f32>,
    velocity: VelocityObserverState<f32>,
    protection: ProtectionState<f32>,
}

/// One tick's command and measurements, in SI units.
pub struct Sample {
    /// Force command (N).
    pub command: f32,
    /// Displacement (m).
    pub displacement: f32,
    /// Force (N).
    pub force: f32,
    /// Spool opening (1).
    pub spool: f32,
    /// Supply pressure (Pa).
    pub supply_pressure: f32,
}

impl State {
    /// A rig at rest before the start.
    pub fn at_rest() -> Self {
        Self {
            controller: CONTROLLER.at_rest(),
            velocity: VelocityObserverState::default(),
            protection: ProtectionState::default(),
        }
    }

    /// One tick: the velocity (m/s) that was found, and what drives the valve.
    #[inline(always)]
    pub fn step(&mut self, s: &Sample) -> (f32, ControllerOutput<f32>) {
        let velocity = VELOCITY.step(&mut self.velocity, s.displacement, s.force * PER_MASS);
        let permitted =
            PROTECTION.step(&mut self.protection, s.command, s.force, s.displacement, velocity, s.spool);
        let measured = Measurements {
            velocity,
            force: s.force,
            spool: s.spool,
            valve_command: 0.0,
            supply_pressure: s.supply_pressure,
        };
        let output = CONTROLLER.step(&mut self.controller, permitted.command, &measured);
        (velocity, PROTECTION.apply(&mut self.protection, &permitted, output))
    }
}
