//! A rig's controller for a loop that someone else closes: one sample at a time, with all that its configuration
//! asks for.

use eft_core::{
    AdaptiveCompensationState, AdaptiveControllerState, ControllerOutput, ControllerState, Feedforward,
    FeedforwardState, Measurements, Output,
};

use crate::closed_loop::controller::{Precision, RigAdaptiveController, RigController, adapts};
use crate::closed_loop::guarded::Guarded;
use crate::closed_loop::velocity_estimate::VelocityEstimate;
use crate::config::RigConfig;
use crate::error::Result;
use crate::sensors::Signals;

/// What one sample brings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Force command (N).
    pub command: f64,
    /// Force command (N) of the next sample; only a feedforward that looks ahead looks at it.
    pub next_command: f64,
    /// Piston velocity (m/s); not looked at where it is estimated.
    pub velocity: f64,
    /// Force (N).
    pub force: f64,
    /// Spool opening (1).
    pub spool: f64,
    /// Displacement (m); only the protection looks at it, and a velocity that is estimated.
    pub displacement: f64,
    /// Valve command (V) that stood when the others were sampled; only the estimators of a compensation alone look at
    /// it, a whole controller knows its own.
    pub valve_command: f64,
    /// Supply pressure (Pa); the configured one where there is no transducer.
    pub supply_pressure: f64,
    /// Acceleration (m/s²); only an observer that reads an accelerometer looks at it.
    pub acceleration: f64,
}

/// What a channel makes of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelOutput {
    /// Valve command of a controller, compensation signal of a compensation (V).
    pub value: f64,
    /// Force command (N) that the protection lets be followed.
    pub permitted_command: f64,
    /// Factor (1) that the protection puts on the valve command, in `value` already where that is one.
    pub authority: f64,
    /// Bits of [`eft_core::status`].
    pub status: u32,
}

/// How far a rig's controller reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// The compensation signal alone, for an analog servovalve controller behind it.
    Compensation,
    /// The whole tick, to the valve command.
    ValveCommand,
}

/// A rig's controller and what it remembers.
#[derive(Debug, Clone)]
pub struct Channel<P: Precision> {
    core: Core<P>,
    estimate: Option<Box<VelocityEstimate<P>>>,
    protection: Option<Guarded<P>>,
    looks_ahead: bool,
    configured_supply: Option<P>,
    reach: Reach,
}

/// The paper's scheme with feedforward, or the adaptive one: what is off does not run.
#[derive(Debug, Clone)]
enum Core<P: Precision> {
    Fixed {
        controller: Box<RigController<P>>,
        feedforward: Feedforward<P>,
        state: ControllerState<P>,
        forward: FeedforwardState<P>,
    },
    Adaptive {
        controller: Box<RigAdaptiveController<P>>,
        state: Box<AdaptiveControllerState<P>>,
    },
}

impl<P: Precision<Flags = u32>> Core<P> {
    /// The compensation alone, for a command (N) and the one that is fed forward.
    fn compensation(&mut self, command: P, fed: P, m: &Measurements<P>) -> Output<P> {
        match self {
            Self::Fixed { controller, feedforward, state, forward } => {
                let flow = feedforward.step(forward, fed);
                let (core, state) = (&controller.compensation, &mut state.compensation);
                core.step(state, m.velocity, m.force, m.spool, flow)
            }
            Self::Adaptive { controller, state } => {
                controller.compensation.step_ahead(&mut state.compensation, command, fed, m)
            }
        }
    }

    /// The whole tick for a command (N) and the one that is fed forward.
    fn tick(&mut self, command: P, fed: P, m: &Measurements<P>) -> ControllerOutput<P> {
        match self {
            Self::Fixed { controller, feedforward, state, forward } => {
                let flow = feedforward.step(forward, fed);
                controller.step_via(state, command, m.velocity, m.force, m.spool, flow, |v| v)
            }
            Self::Adaptive { controller, state } => controller.step_ahead(state, command, fed, m),
        }
    }
}

impl<P: Precision<Flags = u32>> Channel<P> {
    /// The controller of a rig at a sample rate (Hz), at rest.
    ///
    /// # Errors
    /// An invalid configuration; what `eft-core` refuses.
    pub fn new(rig: &RigConfig, sample_rate: f64, reach: Reach) -> Result<Self> {
        rig.validate()?;
        crate::checks::positive("sample_rate", sample_rate, "Hz")?;
        let core = if adapts(rig) {
            let controller = Box::new(P::adaptive(rig, sample_rate)?);
            let state = Box::new(controller.at_rest());
            Core::Adaptive { controller, state }
        } else {
            Core::Fixed {
                controller: Box::new(P::controller(rig, sample_rate)?),
                feedforward: P::feedforward(rig, sample_rate)?,
                state: ControllerState::default(),
                forward: FeedforwardState::default(),
            }
        };
        let configured = P::from_f64(rig.supply.pressure);
        Ok(Self {
            core,
            estimate: VelocityEstimate::new(rig, sample_rate)?.map(Box::new),
            protection: Guarded::new(|_| rig, sample_rate)?,
            looks_ahead: rig.compensation.look_ahead,
            configured_supply: (!rig.compensation.supply_correction).then_some(configured),
            reach,
        })
    }

    /// One sample.
    ///
    /// # NaN
    /// A sample that is not finite, or beyond its range, repeats the last output and is flagged.
    pub fn step(&mut self, sample: &Sample) -> ChannelOutput {
        let mut sample = *sample;
        if let Some(estimate) = &mut self.estimate {
            sample.velocity = estimate.velocity(sample.displacement, sample.force, sample.acceleration);
        }
        let sample = &sample;
        let (command, next, authority, protection) = match &mut self.protection {
            None => (P::from_f64(sample.command), P::from_f64(sample.next_command), P::splat(1.0), 0),
            Some(guarded) => {
                let (command, next, flags) =
                    guarded.protect(sample.command, sample.next_command, &signals(sample));
                (command, next, guarded.authority(), flags)
            }
        };
        let fed = if self.looks_ahead { next } else { command };
        let measured = self.measured(sample);
        let (value, status) = match self.reach {
            Reach::Compensation => {
                let out = self.core.compensation(command, fed, &measured);
                if let Some(guarded) = &mut self.protection {
                    guarded.watch(out.status);
                }
                (out.value, out.status | protection)
            }
            Reach::ValveCommand => {
                let out = self.core.tick(command, fed, &measured);
                let out = self.protection.as_mut().map_or(out, |guarded| guarded.apply(out));
                (out.valve_command, out.status)
            }
        };
        ChannelOutput {
            value: value.to_f64(),
            permitted_command: command.to_f64(),
            authority: authority.to_f64(),
            status,
        }
    }

    /// The last output once more; the state stays.
    pub fn hold(&self) -> (f64, u32) {
        let authority = self.protection.as_ref().map_or(P::splat(1.0), Guarded::authority);
        let (valve_command, compensation, status) = match &self.core {
            Core::Fixed { controller, state, .. } => {
                let out = controller.hold(state);
                (out.valve_command, out.compensation, out.status)
            }
            Core::Adaptive { controller, state } => {
                let out = controller.hold(state);
                (out.valve_command, out.compensation, out.status)
            }
        };
        match self.reach {
            Reach::Compensation => (compensation.to_f64(), status),
            Reach::ValveCommand => ((valve_command * authority).to_f64(), status),
        }
    }

    /// Goes to the state of a rig that has long been at this operating point, nothing learned yet: the next step with
    /// the same sample has no bump. The protection goes on where it is.
    pub fn prime(&mut self, sample: &Sample) {
        let mut sample = *sample;
        if let Some(estimate) = &mut self.estimate {
            estimate.rest(sample.displacement, sample.force, sample.acceleration);
            sample.velocity = 0.0;
        }
        let sample = &sample;
        let m = self.measured(sample);
        let command = P::from_f64(sample.command);
        match &mut self.core {
            Core::Fixed { controller, feedforward, state, forward } => {
                *forward = feedforward.at_rest(command);
                let flow = feedforward.step(forward, command);
                *state = controller.prime(command, m.velocity, m.force, m.spool, flow);
            }
            Core::Adaptive { controller, state } => **state = controller.prime(command, &m),
        }
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        match &mut self.core {
            Core::Fixed { state, forward, .. } => {
                *state = ControllerState::default();
                *forward = FeedforwardState::default();
            }
            Core::Adaptive { controller, state } => **state = controller.at_rest(),
        }
        if let Some(estimate) = &mut self.estimate {
            estimate.rest(0.0, 0.0, 0.0);
        }
        if let Some(guarded) = &mut self.protection {
            guarded.reset();
        }
    }

    /// Whether no sample has been taken in since the start or a reset.
    pub fn is_at_rest(&self) -> bool {
        let resting = self.protection.as_ref().is_none_or(Guarded::is_at_rest);
        resting
            && self.estimate.as_ref().is_none_or(|estimate| estimate.is_at_rest())
            && match &self.core {
                Core::Fixed { state, forward, .. } => {
                    *state == ControllerState::default() && *forward == FeedforwardState::default()
                }
                Core::Adaptive { controller, state } => **state == controller.at_rest(),
            }
    }

    /// Asks the protection, where there is one, for the soft end.
    pub fn end(&mut self) {
        if let Some(guarded) = &mut self.protection {
            guarded.end();
        }
    }

    /// What was learned, where the rig adapts or guards.
    pub fn learned(&self) -> Option<&AdaptiveCompensationState<P>> {
        match &self.core {
            Core::Fixed { .. } => None,
            Core::Adaptive { state, .. } => Some(&state.compensation),
        }
    }

    /// No-load flows (m³/s) that the valve was found to pass at these openings, where the rig adapts or guards.
    pub fn found_flows(&self, openings: &[f64]) -> Option<Vec<f64>> {
        let Core::Adaptive { controller, state } = &self.core else { return None };
        let (core, state) = (&controller.compensation, &state.compensation);
        let flow = |opening: &f64| core.found_flow(state, P::from_f64(*opening)).to_f64();
        Some(openings.iter().map(flow).collect())
    }

    fn measured(&self, sample: &Sample) -> Measurements<P> {
        Measurements {
            velocity: P::from_f64(sample.velocity),
            force: P::from_f64(sample.force),
            spool: P::from_f64(sample.spool),
            valve_command: P::from_f64(sample.valve_command),
            supply_pressure: self.configured_supply.unwrap_or_else(|| P::from_f64(sample.supply_pressure)),
        }
    }
}

fn signals(sample: &Sample) -> Signals<f64> {
    Signals {
        displacement: sample.displacement,
        velocity: sample.velocity,
        force: sample.force,
        spool: sample.spool,
        supply_pressure: sample.supply_pressure,
        acceleration: sample.acceleration,
    }
}
