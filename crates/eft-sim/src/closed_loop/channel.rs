//! A rig's channel with its learner, as the simulator and Python run them. The learner runs inline after the
//! tick.

use serde::{Deserialize, Serialize};

use eft_core::{
    Calibration, ChannelState, ConfigError, Input, Learner, LearnerState, Mode, Output, Parameters,
    SavedCalibration,
};

use crate::closed_loop::{Estimates, Precision};
use crate::config::{RigConfig, TABLE_CAPACITY};
use crate::{Error, Result};

type Channel<P> = eft_core::Channel<P, TABLE_CAPACITY>;

/// A channel, its learner if the rig learns, and the states of both.
#[derive(Debug, Clone)]
pub struct RigChannel<P: Precision> {
    channel: Box<Channel<P>>,
    state: Box<ChannelState<P>>,
    learning: Option<Box<RigLearner<P>>>,
}

/// A learner and its state.
#[derive(Debug, Clone)]
pub(super) struct RigLearner<P: Precision> {
    pub(super) learner: Learner<P, TABLE_CAPACITY>,
    pub(super) state: LearnerState<P>,
    /// At the start and after a reset.
    initial: LearnerState<P>,
    /// What was saved, as the tick uses it from the first sample on.
    pub(super) first: Option<Calibration<P>>,
    /// The calibration from the last window, which is published before the next tick.
    next: Option<Calibration<P>>,
}

impl<P: Precision> RigLearner<P> {
    /// A learner at rest, or one that starts from a saved calibration.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    pub(super) fn new(parameters: &Parameters, saved: Option<&SavedCalibration>) -> Result<Self> {
        let learner = P::learner(parameters)?;
        let saved = saved.map(|saved| learner.start_from(saved)).transpose();
        let saved = saved.map_err(|error| reference_error(error, parameters.mode))?;
        let first = saved.as_ref().map(|state| learner.first_calibration(state));
        let initial = saved.unwrap_or_else(|| learner.at_rest());
        Ok(Self { state: initial, initial, first, learner, next: None })
    }

    /// The channel's state at the start.
    pub(super) fn initial_channel_state(&self, channel: &Channel<P>) -> ChannelState<P> {
        self.first.as_ref().map_or_else(|| channel.at_rest(), |first| channel.at_rest_with(first))
    }

    /// The learned calibration, if anything was learned.
    pub(super) fn saved(&self) -> Option<SavedCalibration> {
        Some(self.learner.saved(&self.state)).filter(|saved| saved.excitation > 0.0)
    }

    /// No-load flows (m³/s) of a calibration's valve at these openings.
    pub(super) fn found_flows(&self, calibration: &Calibration<P>, openings: &[f64]) -> Vec<f64> {
        let flow = |opening: &f64| self.learner.found_flow(calibration, P::from_f64(*opening)).to_f64();
        openings.iter().map(flow).collect()
    }
}

/// The core's refusal of a saved calibration, with the remedy if that is of another scheme or flow table.
fn reference_error(error: ConfigError, mode: Mode) -> Error {
    const KEY: &str = "calibration.greatest_flow";
    match error {
        ConfigError::OutOfRange { parameter: KEY, value, lowest, highest } => {
            let own = 0.5 * (lowest + highest);
            let (reference, is, of) = match mode {
                Mode::Linear => ("compensation.flow_gain", "is", "flow gain"),
                Mode::Off | Mode::Nonlinear => ("the greatest flow of the flow table", "is not", "table"),
            };
            let allowed = format!(
                "must be {own:.6} m³/s, {reference}, as compensation.mode {is} \"linear\"; leave out the calibration \
                 of another {of} or mode"
            );
            Error::value(KEY, format!("{value:.6}"), allowed)
        }
        other => other.into(),
    }
}

/// The state of a channel and its learner, which can be stored and restored.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct RigChannelState<P: Precision> {
    channel: ChannelState<P>,
    learning: Option<(LearnerState<P>, Option<Calibration<P>>)>,
}

impl<P: Precision> RigChannel<P> {
    /// At rest; a learner starts from what was saved.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    pub fn new(parameters: &Parameters, saved: Option<&SavedCalibration>) -> Result<Self> {
        let channel = Box::new(P::channel(parameters)?);
        let learns = parameters.learning.is_on();
        let learning = learns.then(|| RigLearner::new(parameters, saved).map(Box::new)).transpose()?;
        let mut whole = Self { state: Box::new(channel.at_rest()), channel, learning };
        *whole.state = whole.start();
        Ok(whole)
    }

    /// The state at the start and after a reset.
    fn start(&self) -> ChannelState<P> {
        let learning = self.learning.as_ref();
        learning.map_or_else(|| self.channel.at_rest(), |one| one.initial_channel_state(&self.channel))
    }

    /// One tick.
    pub fn step(&mut self, input: &Input<f64>) -> Output<f64> {
        self.step_via(input, |compensation| compensation)
    }

    /// One tick, with the compensation signal passed through `path` before the force loop.
    pub(crate) fn step_via(&mut self, input: &Input<f64>, path: impl FnOnce(P) -> P) -> Output<f64> {
        if let Some(calibration) = self.learning.as_mut().and_then(|learning| learning.next.take()) {
            self.channel.publish(&mut self.state, calibration);
        }
        let out = self.channel.step_via(&mut self.state, &to_precision(input), path);
        if let (Some(window), Some(learning)) = (&out.window, &mut self.learning) {
            learning.next = Some(learning.learner.update(&mut learning.state, window));
        }
        to_double(&out)
    }

    /// Returns the last output again and leaves the state unchanged.
    pub fn hold(&self) -> Output<f64> {
        to_double(&self.channel.hold(&self.state))
    }

    /// The output before the first tick, which holds the valve at its known or saved null.
    pub fn before(&self) -> Output<f64> {
        let held = self.channel.hold(&self.start());
        Output { velocity: 0.0, permitted_command: 0.0, status: 0, ..to_double(&held) }
    }

    /// Sets the state of a rig that has long been at this operating point, so that the next step with the
    /// same input has no bump. The calibration and the state of the protection are kept.
    pub fn prime(&mut self, input: &Input<f64>) {
        self.channel.prime(&mut self.state, &to_precision(input));
    }

    /// Returns to rest and to the saved calibration from which the learner started.
    pub fn reset(&mut self) {
        *self.state = self.start();
        if let Some(learning) = &mut self.learning {
            learning.state = learning.initial;
            learning.next = None;
        }
    }

    /// The present state.
    pub fn state(&self) -> RigChannelState<P> {
        let learning = self.learning.as_ref().map(|learning| (learning.state, learning.next));
        RigChannelState { channel: *self.state, learning }
    }

    /// Restores the state of a channel with the same parameters.
    ///
    /// # Errors
    /// A state with a learner for a channel without one, or the reverse.
    pub fn go_to(&mut self, state: &RigChannelState<P>) -> Result<()> {
        match (&mut self.learning, &state.learning) {
            (None, None) => {}
            (Some(learning), Some((learned, next))) => (learning.state, learning.next) = (*learned, *next),
            _ => {
                let allowed =
                    "must be of a controller that learns where this one does, and of none elsewhere";
                return Err(Error::value("state", "another controller's", allowed));
            }
        }
        *self.state = state.channel;
        Ok(())
    }

    /// The learner's estimates by the names of the traces; for a rig that does not learn, the configured
    /// values.
    pub fn estimates(&self, rig: &RigConfig) -> Vec<(&'static str, f64)> {
        Estimates::<f64>::nominal(&|_| rig).or(|_| self.calibration()).named()
    }

    /// Whether no tick has changed anything since the start or a reset.
    pub fn is_at_rest(&self) -> bool {
        *self.state == self.start()
    }

    /// Trips the protection, if there is one, on request.
    pub fn trip(&mut self) {
        self.state.trip();
    }

    /// Starts the soft end of the protection, if there is one.
    pub fn end(&mut self) {
        self.state.end();
    }

    /// The command (N) that the protection will permit at the next tick if nothing new happens.
    pub(crate) fn preview(&self, next_command: f64) -> f64 {
        self.channel.preview(&self.state, P::from_f64(next_command)).to_f64()
    }

    /// The calibration in use, if the rig learns.
    pub fn calibration(&self) -> Option<&Calibration<P>> {
        self.learning.as_ref().map(|_| self.state.calibration())
    }

    /// The learned calibration, from which a later test may start.
    pub fn saved(&self) -> Option<SavedCalibration> {
        self.learning.as_ref()?.saved()
    }

    /// Learned no-load flows (m³/s) of the valve at these openings, if the rig learns.
    pub fn found_flows(&self, openings: &[f64]) -> Option<Vec<f64>> {
        Some(self.learning.as_ref()?.found_flows(self.state.calibration(), openings))
    }
}

/// The input in the controller's precision.
pub(super) fn to_precision<P: Precision>(i: &Input<f64>) -> Input<P> {
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
        load_pressure: P::from_f64(i.load_pressure),
    }
}

fn to_double<P: Precision>(out: &Output<P>) -> Output<f64> {
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
