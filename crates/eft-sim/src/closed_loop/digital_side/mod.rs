//! Sensors, controller and converter: from the plant's signals to the drive of its valve.

mod channels;
mod drive;
mod parts;
mod valve_command;

pub(crate) use channels::ChannelKind;
pub(crate) use parts::{DigitalSide, Feedback};

use eft_core::{ControllerState, Mask, Real, SavedCalibration, Scalar};

use crate::Result;
use crate::closed_loop::digital_side::channels::run_channels;
use crate::closed_loop::digital_side::parts::ControllerSource;
use crate::closed_loop::digital_side::valve_command::learn;
use crate::closed_loop::{
    DigitalOutput, Estimates, EstimatesInUse, ExternalController, LearningLanes, Precision, RigChannel,
    RigController, adapts, parameters,
};
use crate::config::{Realization, RigConfig, VelocitySource};
use crate::instruments::{AnalogOutput, CommandDelay, Dac, DelayLines, Sensors};
use crate::lanes::{Num, Work};
use crate::plant::{Analog, Signals};

/// Which copy of `sample` a digital side uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SamplePath {
    /// Ideal instruments and an analog loop behind the compensation.
    Ideal,
    /// The same with learners.
    IdealLearning,
    /// Any rig.
    General,
}

impl<S: Num, C: Scalar<Element: Precision>> DigitalSide<S, C> {
    /// The digital sides of `rig(0)`, `rig(1)`, … at rest, one per lane, all with the same realization and
    /// [`ChannelKind`]. `actuator` is the actuator's number in its rig; each actuator has its own noise.
    pub(crate) fn new<'a>(
        rig: &dyn Fn(usize) -> &'a RigConfig,
        sample_rate: f64,
        actuator: usize,
    ) -> Result<Self> {
        let lanes = 0..S::LANES;
        let parameters: Vec<_> =
            lanes.clone().map(|i| parameters(rig(i), sample_rate)).collect::<Result<_>>()?;
        let controllers: Vec<_> = parameters.iter().map(C::Element::controller).collect::<Result<_>>()?;
        let controller = RigController::<C>::pack(&|i| &controllers[i]);
        let kind = ChannelKind::of(rig(0));
        let source = if S::LANES == C::LANES && kind == ChannelKind::Learning {
            ControllerSource::Learning(Box::new(LearningLanes::new(&parameters, &controllers, |i| {
                rig(i).calibration.of(actuator)
            })?))
        } else if S::LANES != C::LANES || kind != ChannelKind::Controller {
            let of = |(i, p)| RigChannel::new(p, rig(i).calibration.of(actuator));
            let channels = parameters.iter().enumerate().map(of).collect::<Result<_>>()?;
            ControllerSource::Channels(channels, Box::default())
        } else {
            ControllerSource::SideBySide
        };
        let null_signal = |i: usize| {
            let nominal = controllers[i].nominal();
            controllers[i].null_signal(source.calibration(i).unwrap_or(&nominal)).to_f64()
        };
        let sensors = Sensors::new(&rig, sample_rate, actuator as u64);
        let delay = |i: usize| rig(i).compensation.computation_delay as usize;
        let computation = DelayLines::new(S::LANES, delay, null_signal);
        let command_delay = CommandDelay::new(|i| rig(i).controller.force_delay * sample_rate);
        let realization = rig(0).controller.realization;
        let rest = |i: usize| match realization {
            Realization::Digital => rig(i).null_command(actuator),
            Realization::Analog => null_signal(i),
        };
        let dac = Dac::new(S::LANES, |i| &rig(i).plant().dac, rest);
        let has_ideal_instruments =
            sensors.is_none() && computation.is_none() && command_delay.is_none() && dac.is_ideal();
        let null_signal = S::from_lanes(null_signal);
        Ok(Self {
            kind,
            source,
            ideal: has_ideal_instruments && realization == Realization::Analog,
            calibration: Box::new(controller.nominal()),
            controller,
            estimates: EstimatesInUse::new(Estimates::nominal(&rig)),
            last_analog: None,
            null_signal,
            estimates_velocity: rig(0).controller.velocity_source != VelocitySource::Sensor,
            adapts: lanes.into_iter().any(|i| adapts(rig(i))),
            computation,
            command_delay,
            realization,
            analog: Analog::pack(rig),
            sensors,
            dac,
            sample_rate,
            records_valve_command: true,
        })
    }

    /// The same without a trace of the analog valve command.
    pub(crate) fn without_traces(self) -> Self {
        Self { records_valve_command: false, ..self }
    }

    /// The fastest copy of [`sample`](Self::sample) that is valid.
    pub(crate) fn path(&self) -> SamplePath {
        match self.source {
            ControllerSource::SideBySide if self.ideal => SamplePath::Ideal,
            ControllerSource::Learning(_) if self.ideal => SamplePath::IdealLearning,
            _ => SamplePath::General,
        }
    }

    /// Samples, and returns the drive of the valve until the next tick. `next_command` is the command at that
    /// tick. `IDEAL` and `LEARNS` must match the [`path`](Self::path).
    #[inline(always)]
    pub(crate) fn sample<const IDEAL: bool, const LEARNS: bool>(
        &mut self,
        state: &mut ControllerState<C>,
        command: S,
        next_command: S,
        truth: &Signals<S>,
        plant: &impl Feedback<S>,
    ) -> DigitalOutput<S> {
        let commands = [command, next_command];
        if !IDEAL {
            return self.sample_general(state, &commands, truth, plant);
        }
        let (mut measured, cell) = (*truth, AnalogOutput::ideal());
        let voltage = if LEARNS { self.analog_command::<true>(command, cell, plant) } else { S::splat(0.0) };
        // Both outputs stay in registers. The output of a function that is not inlined would be copied through
        // memory.
        let out = match &mut self.source {
            ControllerSource::Learning(learning) if LEARNS => {
                learn::<true, S, C>(learning, &mut self.computation, commands, &mut measured, voltage)
            }
            _ => self.control::<true>(state, commands, &measured),
        };
        self.drive::<true, LEARNS>(out, &measured, cell, plant)
    }

    /// The same with every instrument and channel.
    // A separate function, because otherwise its long code would be compiled into every loop.
    #[inline(never)]
    fn sample_general(
        &mut self,
        state: &mut ControllerState<C>,
        commands: &[S; 2],
        truth: &Signals<S>,
        plant: &impl Feedback<S>,
    ) -> DigitalOutput<S> {
        S::dispatch(GeneralSample { side: self, state, commands, truth, plant })
    }

    /// The controllers' state at rest.
    pub(crate) fn at_rest(&self) -> ControllerState<C> {
        self.controller.at_rest()
    }

    /// The estimates that the controllers used at the last sample.
    #[inline(always)]
    pub(crate) fn estimates(&self) -> &EstimatesInUse<S> {
        match &self.source {
            ControllerSource::Learning(learning) => &learning.estimates,
            _ => &self.estimates,
        }
    }

    /// Replaces the rig's controller by an external one; for a digital side of one rig.
    pub(crate) fn set_external_controller(&mut self, controller: ExternalController) {
        self.source = ControllerSource::External(controller);
    }

    /// Replaces the channels side by side by one channel and its learner; for a digital side of one rig.
    ///
    /// # Errors
    /// What `eft-core` refuses.
    pub(crate) fn set_channel(&mut self, rig: &RigConfig) -> Result<()> {
        let channel = RigChannel::new(&parameters(rig, self.sample_rate)?, None)?;
        self.source = ControllerSource::Channels(vec![channel], Box::default());
        Ok(())
    }

    /// Learned no-load flows (m³/s) of a lane's valve at these openings. `None` if the rig does not learn,
    /// empty if an external controller learns.
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        match &self.source {
            ControllerSource::SideBySide => None,
            ControllerSource::Learning(learning) => learning.found_flows(openings, lane),
            ControllerSource::Channels(channels, _) => channels.get(lane)?.found_flows(openings),
            ControllerSource::External(_) => self.adapts.then(Vec::new),
        }
    }

    /// The learned calibration of a lane, if its learner runs here.
    pub(crate) fn saved(&self, lane: usize) -> Option<SavedCalibration> {
        match &self.source {
            ControllerSource::Learning(learning) => learning.saved(lane),
            ControllerSource::Channels(channels, _) => channels.get(lane)?.saved(),
            ControllerSource::SideBySide | ControllerSource::External(_) => None,
        }
    }

    /// Starts the soft end of the protections, if there are any.
    pub(crate) fn end(&mut self) {
        self.source.channels().iter_mut().for_each(RigChannel::end);
    }

    /// Trips the protections of some lanes, if there are any, on request.
    pub(crate) fn trip(&mut self, at: S::Mask) {
        let channels = self.source.channels().iter_mut().enumerate();
        channels.filter(|(lane, _)| at.lane(*lane)).for_each(|(_, channel)| channel.trip());
    }

    /// The sensors' readings of the true signals, and the load cell's output to an analog controller.
    #[inline(always)]
    fn measure(&mut self, truth: Signals<S>) -> (Signals<S>, AnalogOutput<S>) {
        match &mut self.sensors {
            None => (truth, AnalogOutput::ideal()),
            Some(sensors) => sensors.read(&truth),
        }
    }
}

/// One tick of a digital side.
struct GeneralSample<'a, S: Num, C: Scalar<Element: Precision>, F> {
    side: &'a mut DigitalSide<S, C>,
    state: &'a mut ControllerState<C>,
    commands: &'a [S; 2],
    truth: &'a Signals<S>,
    plant: &'a F,
}

impl<S: Num, C: Scalar<Element: Precision>, F: Feedback<S>> Work for GeneralSample<'_, S, C, F> {
    type Output = DigitalOutput<S>;

    #[inline(always)]
    fn run(self) -> DigitalOutput<S> {
        let Self { side, state, commands, truth, plant } = self;
        let commands = match (&mut side.command_delay, side.realization) {
            (None, _) => *commands,
            (Some(delay), Realization::Analog) => delay.delay(*commands),
            // The force loop compares with a late reading, but the feedforward acts on the true force.
            (Some(delay), Realization::Digital) => [delay.delay(*commands)[0], commands[1]],
        };
        let (mut measured, cell) = side.measure(*truth);
        let voltage = match side.source {
            ControllerSource::Learning(_) | ControllerSource::Channels(..) => {
                side.analog_command::<false>(commands[0], cell, plant)
            }
            _ => S::splat(0.0),
        };
        let computation = &mut side.computation;
        let out = match &mut side.source {
            ControllerSource::SideBySide => side.control::<false>(state, commands, &measured),
            ControllerSource::Learning(learning) => {
                learn::<false, S, C>(learning, computation, commands, &mut measured, voltage)
            }
            ControllerSource::Channels(channels, outputs) => {
                let measured = &mut measured;
                let out =
                    run_channels(channels, outputs, side.kind, computation, commands, measured, voltage);
                if side.adapts {
                    side.estimates.update(side.estimates.estimates.or(|i| channels[i].calibration()));
                }
                out
            }
            ControllerSource::External(_) => return side.run_external(commands, measured),
        };
        side.drive::<false, true>(out, &measured, cell, plant)
    }
}
