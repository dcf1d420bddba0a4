//! Everything between the plant's signals and what drives its valve: sensors, controller, converter.

use eft_core::{ControllerInput, ControllerState, Flags, Mask, Output, Real, Scalar, status};

use crate::closed_loop::channel::RigChannel;
use crate::closed_loop::controller::{Precision, RigController, adapts, parameters};
use crate::closed_loop::estimates::Estimates;
use crate::closed_loop::outside::{Answer, Outside};
use crate::closed_loop::signals::convert;
use crate::closed_loop::tick::Decision;
use crate::config::{Realization, RigConfig, VelocitySource};
use crate::error::Result;
use crate::instruments::Dac;
use crate::instruments::DelayLines;
use crate::instruments::{AnalogOutput, Sensors, Signals};
use crate::lanes::Num;
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
enum Decides<P: Precision> {
    /// Controllers side by side with ideal instruments: nothing but the paper's compensation in front of its analog
    /// controller.
    Plain,
    /// Controllers side by side, of rigs of which nothing is learned, protected or estimated.
    SideBySide,
    /// A channel a lane.
    Channels(Vec<RigChannel<P>>),
    /// A controller that runs elsewhere, for one rig.
    Outside(Outside),
}

impl<P: Precision> Decides<P> {
    /// The channels, where they decide.
    fn channels(&mut self) -> &mut [RigChannel<P>] {
        if let Self::Channels(channels) = self { channels } else { &mut [] }
    }
}

/// Sensors, controller and converter of one actuator, or of several rigs' side by side; `C` is the controller's
/// number.
pub(crate) struct DigitalSide<S: Num, C: Scalar>
where
    C::Element: Precision,
{
    decides: Decides<C::Element>,
    /// The controllers side by side.
    controller: RigController<C>,
    nominal: Estimates<S>,
    /// What drove the valves since the last tick, and the command (N) that it arrives at.
    before: Option<(Driver<S>, S)>,
    estimates_velocity: bool,
    adapts: bool,
    computation: DelayLines,
    realization: Realization,
    analog: Analog<S>,
    /// One lane each; empty where every lane's are ideal.
    sensors: Vec<Option<Sensors>>,
    dac: Dac<S>,
    sample_rate: f64,
}

/// Whether the controller alone is a rig's whole channel.
fn is_controller(rig: &RigConfig) -> bool {
    !adapts(rig) && !rig.protection.enabled && rig.controller.velocity_source == VelocitySource::Sensor
}

impl<S: Num, C: Scalar<Flags = S::Flags>> DigitalSide<S, C>
where
    C::Element: Precision,
{
    /// Those of `rig(0)`, `rig(1)`, … at rest, one a lane; all of one realization. `actuator` numbers the actuator
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
        let mut sensors: Vec<_> =
            lanes.clone().map(|i| Sensors::new(rig(i), sample_rate, actuator)).collect();
        if sensors.iter().all(Option::is_none) {
            sensors.clear();
        }
        let computation = DelayLines::new(S::LANES, |i| rig(i).compensation.computation_delay as usize);
        let dac = Dac::new(|i| &rig(i).plant().dac);
        let is_plain = |i: usize| {
            rig(i).controller.realization == Realization::Analog && !rig(i).compensation.feedforward
        };
        let has_ideal_instruments = sensors.is_empty() && computation.is_none() && dac.is_ideal();
        let decides = if !lanes.clone().all(|i| is_controller(rig(i))) {
            Decides::Channels(parameters.iter().map(RigChannel::new).collect::<Result<_>>()?)
        } else if has_ideal_instruments && lanes.clone().all(is_plain) {
            Decides::Plain
        } else {
            Decides::SideBySide
        };
        Ok(Self {
            decides,
            controller: RigController::pack(|i| &controllers[i]),
            nominal: Estimates::nominal(&rig),
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
        let (measured, cell) = self.measure(truth);
        match self.decides {
            Decides::Plain | Decides::SideBySide => {
                self.control::<false>(state, commands, measured, cell, plant)
            }
            Decides::Channels(_) => self.run_channels(commands, measured, cell, plant),
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
        let calibration = self.controller.nominal();
        let computation = &mut self.computation;
        let path = |compensation: C| if PLAIN { compensation } else { computation.pass(compensation) };
        let out = self.controller.step(state, &input, &calibration, path);
        let out = Voltages {
            output: convert(out.valve_command),
            compensation: convert(out.compensation),
            authority: S::splat(1.0),
            status: out.status,
        };
        self.drive::<PLAIN>([command, next_command], measured, cell, plant, out)
    }

    /// Lets a channel a lane decide.
    #[inline(never)]
    fn run_channels(
        &mut self,
        [command, next_command]: [S; 2],
        mut measured: Signals<S>,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
    ) -> Decision<S> {
        let valve_command = match self.realization {
            // What the analog controller made of it until now.
            Realization::Analog => {
                let (before, arrived) = match self.before {
                    Some((driver, arrived)) => (driver.cell.analog(), arrived),
                    None => {
                        let channels = self.decides.channels();
                        (self.analog, S::from_lanes(|i| channels[i].preview(command.lane(i))))
                    }
                };
                let before = before.arrived(arrived).through((cell.gain, cell.offset));
                plant.command(&Driver::analog(before, cell.ideal))
            }
            Realization::Digital => S::splat(0.0),
        };
        let (computation, channels) = (&mut self.computation, self.decides.channels());
        let mut step = |(i, channel): (usize, &mut RigChannel<C::Element>)| {
            let [now, next] = [command.lane(i), next_command.lane(i)];
            let input = measured.lane(i).input(now, next, valve_command.lane(i));
            let out =
                channel.step_via(&input, |v| C::Element::from_f64(computation.pass_lane(i, v.to_f64())));
            (out, channel.preview(next))
        };
        let outputs: Vec<_> = channels.iter_mut().enumerate().map(&mut step).collect();
        let of = |value: fn(&Output<f64>) -> f64| S::from_lanes(|i| value(&outputs[i].0));
        measured.velocity = of(|out| out.velocity);
        let out = Voltages {
            output: of(|out| out.voltage),
            compensation: of(|out| out.compensation),
            authority: of(|out| out.authority),
            status: S::Flags::from_lanes(|i| outputs[i].0.status),
        };
        let commands = [of(|out| out.permitted_command), S::from_lanes(|i| outputs[i].1)];
        let mut decision = self.drive::<false>(commands, measured, cell, plant, out);
        self.before = Some((decision.driver, commands[1]));
        if self.adapts {
            let channels = &*self.decides.channels();
            decision.estimates = self.nominal.or(|i| channels[i].calibration());
        }
        decision
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
            let rate = (next_command - command) * S::splat(self.sample_rate);
            let open = S::Flags::from_lanes(|i| out.status.lane(i) & status::FORCE_LOOP_OPEN);
            let behind = if PLAIN || open == S::Flags::default() {
                self.analog.at(command, rate, output).through((cell.gain, cell.offset))
            } else {
                // Its force error is switched off.
                let closed = |i: usize| open.lane(i) == 0;
                let of = |value: S| S::from_lanes(|i| if closed(i) { value.lane(i) } else { 0.0 });
                self.analog.at(of(command), of(rate), output).through((of(cell.gain), of(cell.offset)))
            };
            let driver = if PLAIN {
                Driver::analog(behind, true)
            } else {
                let whole = cell.ideal && out.authority.ge(S::splat(1.0)).all();
                Driver::analog(behind.limited_to(out.authority), whole && open == S::Flags::default())
            };
            (driver, plant.command(&driver), output)
        } else {
            (Driver::held(output), output, out.compensation)
        };
        let status = out.status | clipped;
        Decision { measured, valve_command, compensation, estimates: self.nominal, status, driver }
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
        let estimates = if self.adapts {
            Estimates {
                flow_gain_estimate: convert(answer.flow_gain),
                response_delay_estimate: convert(answer.response_delay),
                valve_gain_estimate: convert(answer.valve_gain),
                level: convert(answer.level),
                ..Estimates::unknown()
            }
        } else {
            self.nominal
        };
        let (valve_command, clipped) = self.dac.convert(convert(answer.valve_command));
        Decision {
            measured,
            valve_command,
            compensation: convert(answer.compensation),
            estimates,
            status: S::flag(S::Mask::splat(true), answer.status) | clipped,
            driver: Driver::held(valve_command),
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
            Decides::Channels(channels) => channels.get(lane)?.found_flows(openings),
            Decides::Outside(_) => self.adapts.then(Vec::new),
        }
    }

    /// Asks the protections, where there are any, for the soft end.
    pub(crate) fn end(&mut self) {
        self.decides.channels().iter_mut().for_each(RigChannel::end);
    }

    /// Trips the protections, where there are any, from outside.
    pub(crate) fn trip(&mut self) {
        self.decides.channels().iter_mut().for_each(RigChannel::trip);
    }

    /// What the sensors make of the truth, and the load cell (gain and offset in N) as an analog controller sees it,
    /// where it is not ideal.
    #[inline(always)]
    fn measure(&mut self, truth: Signals<S>) -> (Signals<S>, CellReading<S>) {
        if self.sensors.is_empty() { (truth, CellReading::ideal()) } else { self.read_sensors(truth) }
    }

    #[inline(never)]
    fn read_sensors(&mut self, truth: Signals<S>) -> (Signals<S>, CellReading<S>) {
        let read = |(i, sensors): (usize, &mut Option<Sensors>)| {
            let ideal = AnalogOutput { gain: 1.0, offset: 0.0 };
            sensors.as_mut().map_or((truth.lane(i), ideal), |sensors| sensors.read(&truth.lane(i)))
        };
        let readings: Vec<_> = self.sensors.iter_mut().enumerate().map(read).collect();
        let wire = CellReading {
            gain: S::from_lanes(|i| readings[i].1.gain),
            offset: S::from_lanes(|i| readings[i].1.offset),
            ideal: false,
        };
        (Signals::from_lanes(|i| readings[i].0), wire)
    }
}
