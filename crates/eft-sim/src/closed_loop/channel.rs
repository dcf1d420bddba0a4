//! A rig's channel and the learner beside it, as the simulator and Python run them: the learner inline behind the tick.

use serde::{Deserialize, Serialize};

use eft_core::{Calibration, ChannelState, Input, Learner, LearnerState, Output, Parameters};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::estimates::Estimates;
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::plant::TABLE_CAPACITY;

type Channel<P> = eft_core::Channel<P, TABLE_CAPACITY>;

/// A channel, its learner where something is learned, and what both remember.
#[derive(Debug, Clone)]
pub struct RigChannel<P: Precision> {
    channel: Box<Channel<P>>,
    state: Box<ChannelState<P>>,
    learning: Option<Box<Learning<P>>>,
}

/// A learner and what it remembers.
#[derive(Debug, Clone)]
pub(super) struct Learning<P: Precision> {
    pub(super) learner: Learner<P, TABLE_CAPACITY>,
    pub(super) state: LearnerState<P>,
    /// What the last window taught, to be published before the next tick: until then the calibration in use stays.
    learned: Option<Calibration<P>>,
}

impl<P: Precision> Learning<P> {
    /// Nothing learned yet.
    ///
    /// # Errors
    /// What `eft-core` refuses.
    pub(super) fn new(parameters: &Parameters) -> Result<Self> {
        let learner = P::learner(parameters)?;
        Ok(Self { state: learner.at_rest(), learner, learned: None })
    }

    /// No-load flows (m³/s) that a calibration's valve passes at these openings.
    pub(super) fn found_flows(&self, calibration: &Calibration<P>, openings: &[f64]) -> Vec<f64> {
        let flow = |opening: &f64| self.learner.found_flow(calibration, P::from_f64(*opening)).to_f64();
        openings.iter().map(flow).collect()
    }
}

/// What a channel and its learner remember, to be written and read again.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct RigChannelState<P: Precision> {
    channel: ChannelState<P>,
    learning: Option<(LearnerState<P>, Option<Calibration<P>>)>,
}

impl<P: Precision> RigChannel<P> {
    /// At rest.
    ///
    /// # Errors
    /// What `eft-core` refuses.
    pub fn new(parameters: &Parameters) -> Result<Self> {
        let channel = Box::new(P::channel(parameters)?);
        let learning =
            if parameters.learning.is_on() { Some(Box::new(Learning::new(parameters)?)) } else { None };
        Ok(Self { state: Box::new(channel.at_rest()), channel, learning })
    }

    /// One tick.
    pub fn step(&mut self, input: &Input<f64>) -> Output<f64> {
        self.step_via(input, |compensation| compensation)
    }

    /// One tick, the compensation signal passed through `path` on its way to the force loop.
    pub(crate) fn step_via(&mut self, input: &Input<f64>, path: impl FnOnce(P) -> P) -> Output<f64> {
        if let Some(calibration) = self.learning.as_mut().and_then(|learning| learning.learned.take()) {
            self.channel.publish(&mut self.state, calibration);
        }
        let out = self.channel.step_via(&mut self.state, &rounded(input), path);
        if let (Some(window), Some(learning)) = (&out.window, &mut self.learning) {
            learning.learned = Some(learning.learner.update(&mut learning.state, window));
        }
        widened(&out)
    }

    /// The last output once more; the state stays.
    pub fn hold(&self) -> Output<f64> {
        widened(&self.channel.hold(&self.state))
    }

    /// Goes to the state of a rig that has long been at this operating point: the next step with the same input has no
    /// bump. What was learned stays, the protection goes on where it is.
    pub fn prime(&mut self, input: &Input<f64>) {
        self.channel.prime(&mut self.state, &rounded(input));
    }

    /// Back to rest, nothing learned.
    pub fn reset(&mut self) {
        *self.state = self.channel.at_rest();
        if let Some(learning) = &mut self.learning {
            learning.state = learning.learner.at_rest();
            learning.learned = None;
        }
    }

    /// What it remembers now.
    pub fn state(&self) -> RigChannelState<P> {
        let learning = self.learning.as_ref().map(|learning| (learning.state, learning.learned));
        RigChannelState { channel: *self.state, learning }
    }

    /// Goes on from what a channel of the same parameters remembered.
    ///
    /// # Errors
    /// A state of a channel that learns for one that does not, or the other way round.
    pub fn go_to(&mut self, state: &RigChannelState<P>) -> Result<()> {
        match (&mut self.learning, &state.learning) {
            (None, None) => {}
            (Some(learning), Some((learned, next))) => (learning.state, learning.learned) = (*learned, *next),
            _ => {
                let allowed =
                    "must be of a controller that learns where this one does, and of none elsewhere";
                return Err(Error::value("state", "another controller's", allowed));
            }
        }
        *self.state = state.channel;
        Ok(())
    }

    /// What the learner has found, by the names of the traces; of a rig that does not learn what it is configured to.
    pub fn estimates(&self, rig: &RigConfig) -> Vec<(&'static str, f64)> {
        Estimates::<f64>::nominal(|_| rig).or(|_| self.calibration()).named()
    }

    /// Whether no tick has changed anything since the start or a reset.
    pub fn is_at_rest(&self) -> bool {
        *self.state == self.channel.at_rest()
    }

    /// Trips the protection, where there is one, from outside.
    pub fn trip(&mut self) {
        self.state.trip();
    }

    /// Asks the protection, where there is one, for the soft end.
    pub fn end(&mut self) {
        self.state.end();
    }

    /// What the protection will make of the next tick's command (N) if nothing new happens.
    pub(crate) fn preview(&self, next_command: f64) -> f64 {
        self.channel.preview(&self.state, P::from_f64(next_command)).to_f64()
    }

    /// The calibration in use, where something is learned.
    pub fn calibration(&self) -> Option<&Calibration<P>> {
        self.learning.as_ref().map(|_| self.state.calibration())
    }

    /// No-load flows (m³/s) that the valve was found to pass at these openings, where something is learned.
    pub fn found_flows(&self, openings: &[f64]) -> Option<Vec<f64>> {
        Some(self.learning.as_ref()?.found_flows(self.state.calibration(), openings))
    }
}

/// In the controller's precision.
pub(super) fn rounded<P: Precision>(i: &Input<f64>) -> Input<P> {
    Input {
        command: P::from_f64(i.command),
        velocity: P::from_f64(i.velocity),
        force: P::from_f64(i.force),
        spool: P::from_f64(i.spool),
        displacement: P::from_f64(i.displacement),
        acceleration: P::from_f64(i.acceleration),
        supply_pressure: P::from_f64(i.supply_pressure),
        next_command: P::from_f64(i.next_command),
        valve_command: P::from_f64(i.valve_command),
        alive: P::from_f64(i.alive),
        period: P::from_f64(i.period),
    }
}

fn widened<P: Precision>(out: &Output<P>) -> Output<f64> {
    Output {
        voltage: out.voltage.to_f64(),
        compensation: out.compensation.to_f64(),
        velocity: out.velocity.to_f64(),
        permitted_command: out.permitted_command.to_f64(),
        authority: out.authority.to_f64(),
        status: out.status,
        window: None,
    }
}
