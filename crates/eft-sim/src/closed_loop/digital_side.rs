//! Everything between the plant's signals and what drives its valve: sensors, controller, converter.

use eft_core::{Calibration, ControllerInput, ControllerState, Flags, Mask, Real, Scalar, status};

use crate::closed_loop::channel::RigChannel;
use crate::closed_loop::channels::{Answers, ChannelKind, step_channels};
use crate::closed_loop::controller::{Precision, RigController, adapts, parameters};
use crate::closed_loop::estimates::Estimates;
use crate::closed_loop::learning::LearningLanes;
use crate::closed_loop::outside::{Answer, Outside};
use crate::closed_loop::signals::{convert, convert_flags};
use crate::closed_loop::tick::Decision;
use crate::config::{Realization, RigConfig, VelocitySource};
use crate::error::Result;
use crate::instruments::Dac;
use crate::instruments::DelayLines;
use crate::instruments::{AnalogOutput, Sensors, Signals};
use crate::lanes::{Num, WIDEST, Work, dispatch};
use crate::plant::{Analog, Driver};

/// A plant as it stands now.
// A trait and not a closure: a closure that is called twice is not inlined, and loses the processor's instructions.
pub(crate) trait Feedback<S: Num> {
    /// The valve command (V) that a drive makes of the plant's state now.
    fn command(&self, driver: &Driver<S>) -> S;
}

/// The load cell as an analog controller sees it: `gain·force + offset` (N).
#[derive(Debug, Clone, Copy)]
struct CellReading<S> {
    gain: S,
    offset: S,
    ideal: bool,
}

impl<S: Num> CellReading<S> {
    #[inline(always)]
    fn ideal() -> Self {
        Self { gain: S::splat(1.0), offset: S::splat(0.0), ideal: true }
    }
}

/// What the controllers put out.
#[derive(Debug, Clone, Copy)]
struct Voltages<S: Num> {
    /// To the converter (V).
    output: S,
    /// The compensation signal (V).
    compensation: S,
    /// Factor (1) that protections put on an analog controller's valve command.
    authority: S,
    status: S::Flags,
}

/// What decides on the valve command.
enum Decides<S: Num, C: Scalar>
where
    C::Element: Precision,
{
    /// Controllers side by side with ideal instruments: nothing but the paper's compensation in front of its analog
    /// controller.
    Plain,
    /// Controllers side by side, of rigs of which nothing is learned, protected or estimated.
    SideBySide,
    /// Channels side by side that learn.
    Learning(Box<LearningLanes<S, C>>),
    /// A channel a lane.
    Channels(Vec<RigChannel<C::Element>>, Box<Answers>),
    /// A controller that runs elsewhere, for one rig.
    Outside(Outside),
}

impl<S: Num, C: Scalar> Decides<S, C>
where
    C::Element: Precision,
{
    /// The channels, where they decide.
    fn channels(&mut self) -> &mut [RigChannel<C::Element>] {
        if let Self::Channels(channels, _) = self { channels } else { &mut [] }
    }
}

/// Sensors, controller and converter of one actuator, or of several rigs' side by side; `C` is the controller's
/// number.
pub(crate) struct DigitalSide<S: Num, C: Scalar>
where
    C::Element: Precision,
{
    kind: ChannelKind,
    decides: Decides<S, C>,
    /// The controllers side by side.
    controller: RigController<C>,
    /// What their configuration gives them.
    calibration: Box<Calibration<C>>,
    estimates: Estimates<S>,
    /// Command (N) that the analog controllers arrive at, its rate (N/s) and their compensation (V) since the last tick.
    before: Option<[S; 3]>,
    estimates_velocity: bool,
    adapts: bool,
    computation: DelayLines,
    realization: Realization,
    analog: Analog<S>,
    /// None where every lane's are ideal.
    sensors: Option<Sensors<S>>,
    dac: Dac<S>,
    sample_rate: f64,
}

impl<S: Num, C: Scalar> DigitalSide<S, C>
where
    C::Element: Precision,
{
    /// Those of `rig(0)`, `rig(1)`, … at rest, one a lane; all of one realization and [`ChannelKind`]. `actuator` numbers the actuator
    /// in its rig, whose noise is its own.
    pub(crate) fn new<'a>(
        rig: impl Fn(usize) -> &'a RigConfig,
        sample_rate: f64,
        actuator: u64,
    ) -> Result<Self> {
        let lanes = 0..S::LANES;
        let parameters: Vec<_> =
            lanes.clone().map(|i| parameters(rig(i), sample_rate)).collect::<Result<_>>()?;
        let controllers: Vec<_> = parameters.iter().map(C::Element::controller).collect::<Result<_>>()?;
        let sensors = Sensors::new(&rig, sample_rate, actuator);
        let computation = DelayLines::new(S::LANES, |i| rig(i).compensation.computation_delay as usize);
        let dac = Dac::new(|i| &rig(i).plant().dac);
        let is_plain = |i: usize| {
            rig(i).controller.realization == Realization::Analog && !rig(i).compensation.feedforward
        };
        let has_ideal_instruments = sensors.is_none() && computation.is_none() && dac.is_ideal();
        let controller = RigController::<C>::pack(|i| &controllers[i]);
        let kind = ChannelKind::of(rig(0));
        let decides = if S::LANES == C::LANES && S::LANES > 1 && kind == ChannelKind::Learning {
            Decides::Learning(Box::new(LearningLanes::new(&parameters, &controllers)?))
        } else if S::LANES != C::LANES || kind != ChannelKind::Controller {
            let channels = parameters.iter().map(RigChannel::new).collect::<Result<_>>()?;
            Decides::Channels(channels, Box::default())
        } else if has_ideal_instruments && lanes.clone().all(is_plain) {
            Decides::Plain
        } else {
            Decides::SideBySide
        };
        Ok(Self {
            kind,
            decides,
            calibration: Box::new(controller.nominal()),
            controller,
            estimates: Estimates::nominal(&rig),
            before: None,
            estimates_velocity: rig(0).controller.velocity_source != VelocitySource::Sensor,
            adapts: lanes.into_iter().any(|i| adapts(rig(i))),
            computation,
            realization: rig(0).controller.realization,
            analog: Analog::pack(&rig),
            sensors,
            dac,
            sample_rate,
        })
    }

    /// Whether there is nothing but the paper's compensation in front of its analog controller.
    pub(crate) fn is_plain(&self) -> bool {
        matches!(self.decides, Decides::Plain)
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    /// `PLAIN` is what [`is_plain`](Self::is_plain) says, for a path without any of the rest.
    #[inline(always)]
    pub(crate) fn sample<const PLAIN: bool>(
        &mut self,
        state: &mut ControllerState<C>,
        command: S,
        next_command: S,
        truth: Signals<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        let commands = [command, next_command];
        if PLAIN {
            return self.control::<true>(state, commands, truth, CellReading::ideal(), plant);
        }
        self.sample_with_all(state, commands, truth, plant)
    }

    /// The same with every instrument and channel.
    // Apart, for it is much code, and would be compiled into every loop.
    #[inline(never)]
    fn sample_with_all(
        &mut self,
        state: &mut ControllerState<C>,
        commands: [S; 2],
        truth: Signals<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        dispatch::<S, _>(Sample { side: self, state, commands, truth, plant })
    }

    #[inline(always)]
    fn sample_here(
        &mut self,
        state: &mut ControllerState<C>,
        commands: [S; 2],
        truth: Signals<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        let (measured, cell) = self.measure(truth);
        match self.decides {
            Decides::Plain | Decides::SideBySide => {
                self.control::<false>(state, commands, measured, cell, plant)
            }
            Decides::Learning(_) | Decides::Channels(..) => {
                self.run_channels(commands, measured, cell, plant)
            }
            Decides::Outside(_) => self.ask(commands, measured),
        }
    }

    /// Lets the controllers side by side decide, by the configuration.
    #[inline(always)]
    fn control<const PLAIN: bool>(
        &mut self,
        state: &mut ControllerState<C>,
        [command, next_command]: [S; 2],
        measured: Signals<S>,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        let input = ControllerInput {
            command: convert(command),
            next_command: convert(next_command),
            velocity: convert(measured.velocity),
            force: convert(measured.force),
            spool: convert(measured.spool),
            supply_pressure: convert(measured.supply_pressure),
        };
        let computation = &mut self.computation;
        let path = |compensation: C| if PLAIN { compensation } else { computation.pass(compensation) };
        let out = self.controller.step(state, &input, &self.calibration, path);
        let out = Voltages {
            output: convert(out.valve_command),
            compensation: convert(out.compensation),
            authority: S::splat(1.0),
            status: convert_flags(out.status),
        };
        self.drive::<PLAIN>([command, next_command], measured, cell, plant, out)
    }

    /// Lets channels decide.
    #[inline(always)]
    fn run_channels(
        &mut self,
        [command, next_command]: [S; 2],
        mut measured: Signals<S>,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        let mut stood = S::splat(0.0);
        if self.realization == Realization::Analog {
            // What the analog controller made of it until now.
            let before = match self.before {
                Some([command, rate, compensation]) => self.analog.at(command, rate, compensation),
                None => {
                    let (channels, zero) = (self.decides.channels(), S::splat(0.0));
                    let preview = |i: usize| {
                        channels.get(i).map_or(command.lane(i), |one| one.preview(command.lane(i)))
                    };
                    self.analog.at(S::from_lanes(preview), zero, zero)
                }
            };
            stood = plant.command(&Driver::analog(before.through((cell.gain, cell.offset)), cell.ideal));
        }
        let (commands, out);
        match &mut self.decides {
            Decides::Learning(learning) => {
                let rounded = |value: S| convert::<S, C>(value);
                let input = ControllerInput {
                    command: rounded(command),
                    next_command: rounded(next_command),
                    velocity: rounded(measured.velocity),
                    force: rounded(measured.force),
                    spool: rounded(measured.spool),
                    supply_pressure: rounded(measured.supply_pressure),
                };
                let computation = &mut self.computation;
                let answer = learning.step(&input, rounded(stood), |voltage| computation.pass(voltage));
                measured.velocity = convert(input.velocity);
                commands = [convert(input.command), convert(input.next_command)];
                out = Voltages {
                    output: convert(answer.valve_command),
                    compensation: convert(answer.compensation),
                    authority: S::splat(1.0),
                    status: convert_flags(answer.status),
                };
            }
            Decides::Channels(channels, answers) => {
                let inputs = [command, next_command, stood];
                step_channels(channels, answers, &measured, inputs, &mut self.computation);
                let of = |values: &[f64; WIDEST]| S::from_lanes(|i| values[i]);
                // A controller alone passes on what it was given, in double precision.
                commands = if self.kind == ChannelKind::Controller {
                    [command, next_command]
                } else {
                    measured.velocity = of(&answers.velocity);
                    [of(&answers.permitted[0]), of(&answers.permitted[1])]
                };
                out = Voltages {
                    output: of(&answers.voltage),
                    compensation: of(&answers.compensation),
                    authority: of(&answers.authority),
                    status: S::Flags::from_lanes(|i| answers.status[i]),
                };
            }
            _ => return self.ask([command, next_command], measured),
        }
        if let (Decides::Channels(channels, _), true) = (&self.decides, self.adapts) {
            self.estimates = self.estimates.or(|i| channels[i].calibration());
        }
        self.drive::<false>(commands, measured, cell, plant, out)
    }

    /// The converter, and what drives the valve until the next tick under the permitted commands (N).
    #[inline(always)]
    fn drive<const PLAIN: bool>(
        &mut self,
        [command, next_command]: [S; 2],
        measured: Signals<S>,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
        out: Voltages<S>,
    ) -> Decision<S> {
        let (output, clipped) =
            if PLAIN { (out.output, S::Flags::default()) } else { self.dac.convert(out.output) };
        let (driver, valve_command, compensation) = if PLAIN || self.realization == Realization::Analog {
            let mut rate = (next_command - command) * S::splat(self.sample_rate);
            // Only a protection opens the loop.
            let watched = !PLAIN && matches!(self.decides, Decides::Channels(..));
            let is_open = |i: usize| watched && out.status.lane(i) & status::FORCE_LOOP_OPEN != 0;
            let open = watched && (0..S::LANES).any(is_open);
            let behind = if !open {
                self.analog.at(command, rate, output).through((cell.gain, cell.offset))
            } else {
                // Its force error is switched off.
                let of = |value: S| S::from_lanes(|i| if is_open(i) { 0.0 } else { value.lane(i) });
                rate = of(rate);
                self.analog.at(of(command), rate, output).through((of(cell.gain), of(cell.offset)))
            };
            if watched || !PLAIN && matches!(self.decides, Decides::Learning(_)) {
                self.before = Some([next_command, rate, output]);
            }
            let driver = if PLAIN {
                Driver::analog(behind, true)
            } else {
                let whole = cell.ideal && out.authority.ge(S::splat(1.0)).all();
                Driver::analog(behind.limited_to(out.authority), whole && !open)
            };
            (driver, plant.command(&driver), output)
        } else {
            (Driver::held(output), output, out.compensation)
        };
        let status = out.status | clipped;
        Decision { measured, valve_command, compensation, status, driver }
    }

    /// Lets the controller from outside decide.
    #[inline(never)]
    fn ask(&mut self, [command, next_command]: [S; 2], mut measured: Signals<S>) -> Decision<S> {
        let Signals { velocity, force, spool, displacement, supply_pressure, acceleration } = measured;
        let signals =
            [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command];
        let answer = match &mut self.decides {
            Decides::Outside(outside) => outside(signals.map(|signal| signal.lane(0).to_f64() as f32)),
            _ => Answer::default(),
        };
        if self.estimates_velocity {
            measured.velocity = convert(answer.velocity);
        }
        if self.adapts {
            self.estimates = Estimates {
                flow_gain_estimate: convert(answer.flow_gain),
                response_delay_estimate: convert(answer.response_delay),
                valve_gain_estimate: convert(answer.valve_gain),
                level: convert(answer.level),
                ..Estimates::unknown()
            };
        }
        let (valve_command, clipped) = self.dac.convert(convert(answer.valve_command));
        Decision {
            measured,
            valve_command,
            compensation: convert(answer.compensation),
            status: S::flag(S::Mask::splat(true), answer.status) | clipped,
            driver: Driver::held(valve_command),
        }
    }

    /// What the learners have found by the last sample, as the controllers use it.
    #[inline(always)]
    pub(crate) fn estimates(&self) -> &Estimates<S> {
        match &self.decides {
            Decides::Learning(learning) => &learning.estimates,
            _ => &self.estimates,
        }
    }

    /// Puts a controller from outside in the place of the rig's own; of a digital side, one rig.
    pub(crate) fn controlled_by(&mut self, outside: Outside) {
        self.decides = Decides::Outside(outside);
    }

    /// No-load flows (m³/s) that the valve of a lane was found to pass at these openings; none where nothing is
    /// learned, empty where it is learned outside.
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        match &self.decides {
            Decides::Plain | Decides::SideBySide => None,
            Decides::Learning(learning) => learning.found_flows(openings, lane),
            Decides::Channels(channels, _) => channels.get(lane)?.found_flows(openings),
            Decides::Outside(_) => self.adapts.then(Vec::new),
        }
    }

    /// Asks the protections, where there are any, for the soft end.
    pub(crate) fn end(&mut self) {
        self.decides.channels().iter_mut().for_each(RigChannel::end);
    }

    /// Trips the protections of some lanes, where there are any, from outside.
    pub(crate) fn trip(&mut self, at: S::Mask) {
        let channels = self.decides.channels().iter_mut().enumerate();
        channels.filter(|(lane, _)| at.lane(*lane)).for_each(|(_, channel)| channel.trip());
    }

    /// What the sensors make of the truth, and the load cell (gain and offset in N) as an analog controller sees it,
    /// where it is not ideal.
    #[inline(always)]
    fn measure(&mut self, truth: Signals<S>) -> (Signals<S>, CellReading<S>) {
        match &mut self.sensors {
            None => (truth, CellReading::ideal()),
            Some(sensors) => {
                let (readings, AnalogOutput { gain, offset }) = sensors.read(&truth);
                (readings, CellReading { gain, offset, ideal: false })
            }
        }
    }
}

/// One tick of a digital side.
struct Sample<'a, S: Num, C: Scalar, F>
where
    C::Element: Precision,
{
    side: &'a mut DigitalSide<S, C>,
    state: &'a mut ControllerState<C>,
    commands: [S; 2],
    truth: Signals<S>,
    plant: &'a F,
}

impl<S: Num, C: Scalar, F: Feedback<S>> Work for Sample<'_, S, C, F>
where
    C::Element: Precision,
{
    type Output = Decision<S>;

    #[inline(always)]
    fn run(self) -> Decision<S> {
        self.side.sample_here(self.state, self.commands, self.truth, self.plant)
    }
}
