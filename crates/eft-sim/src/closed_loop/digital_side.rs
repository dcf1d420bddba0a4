//! Everything between the plant's signals and what drives its valve: sensors, controller, converter.

use eft_core::{ControllerState, Feedforward, FeedforwardState, Mask, Real, Scalar};

use crate::closed_loop::adaptive::{Adaptive, Calibration};
use crate::closed_loop::controller::{Precision, RigAdaptiveController, RigController, adapts};
use crate::closed_loop::dac::Dac;
use crate::closed_loop::delay_line::DelayLine;
use crate::closed_loop::guarded::Guarded;
use crate::closed_loop::outside::{Answer, Outside};
use crate::closed_loop::signals::convert;
use crate::closed_loop::velocity_estimate::VelocityEstimate;
use crate::config::{Realization, RigConfig};
use crate::error::Result;
use crate::rig::{Analog, Driver, Num};
use crate::sensors::{Sensors, Signals, Wire};

/// A plant as it stands now.
// A trait and not a closure: a closure that is called twice is not inlined, and loses the processor's instructions.
pub(crate) trait Driven<S: Num> {
    /// The valve command (V) that a drive makes of the plant's state now.
    fn command(&self, driver: &Driver<S>) -> S;
}

/// What the digital side made of one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decision<S: Num> {
    /// What the sensors reported; the truth where they are ideal.
    pub(crate) measured: Signals<S>,
    pub(crate) valve_command: S,
    pub(crate) compensation: S,
    pub(crate) calibration: Calibration<S>,
    pub(crate) status: S::Flags,
    /// What drives the valve until the next tick.
    pub(crate) driver: Driver<S>,
}

/// The load cell as an analog controller sees it: `gain·force + offset` (N).
#[derive(Debug, Clone, Copy)]
struct Sensed<S> {
    gain: S,
    offset: S,
    ideal: bool,
}

impl<S: Num> Sensed<S> {
    #[inline(always)]
    fn ideal() -> Self {
        Self { gain: S::splat(1.0), offset: S::splat(0.0), ideal: true }
    }
}

/// What the controller remembers from tick to tick, apart from all that is too large to stay in registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DigitalState<C: Scalar> {
    controller: ControllerState<C>,
    feedforward: FeedforwardState<C>,
}

impl<C: Scalar> Default for DigitalState<C> {
    fn default() -> Self {
        Self { controller: ControllerState::default(), feedforward: FeedforwardState::default() }
    }
}

/// Sensors, controller and converter of one actuator, or of several rigs' side by side; `C` is the controller's
/// number.
pub(crate) struct DigitalSide<S: Num, C: Scalar> {
    controller: RigController<C>,
    feedforward: Feedforward<C>,
    /// Whether any lane has a feedforward at all.
    feeds_forward: bool,
    /// Where it is fed the next tick's command.
    looks_ahead: S::Mask,
    /// In place of the two above where the rig adapts.
    adaptive: Option<Box<Adaptive<S, C>>>,
    /// In place of them all, where the controller runs elsewhere.
    outside: Option<Outside>,
    nominal: Calibration<S>,
    /// The configured supply pressure (Pa), where the controller has no transducer.
    unmeasured_supply: Option<S>,
    computation: DelayLine<S>,
    realization: Realization,
    analog: Analog<S>,
    /// One lane each; empty where every lane's are ideal.
    sensors: Vec<Option<Sensors>>,
    /// One lane each; empty where every lane's velocity is measured.
    estimates: Vec<Option<VelocityEstimate<C::Element>>>,
    dac: Dac<S>,
    protection: Option<Box<Guarded<C>>>,
    sample_rate: f64,
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
        let controllers =
            (0..S::LANES).map(|i| C::Element::controller(rig(i), sample_rate)).collect::<Result<Vec<_>>>()?;
        let mut sensors: Vec<_> =
            (0..S::LANES).map(|i| Sensors::new(rig(i), sample_rate, actuator)).collect();
        if sensors.iter().all(Option::is_none) {
            sensors.clear();
        }
        let feedforwards = (0..S::LANES)
            .map(|i| C::Element::feedforward(rig(i), sample_rate))
            .collect::<Result<Vec<_>>>()?;
        let adaptives =
            (0..S::LANES).map(|i| C::Element::adaptive(rig(i), sample_rate)).collect::<Result<Vec<_>>>()?;
        let adaptive = adapts(rig(0)).then(|| {
            let controller = RigAdaptiveController::pack(|i| &adaptives[i]);
            let state = controller.at_rest();
            Box::new(Adaptive { controller, state, before: None })
        });
        let mut estimates =
            (0..S::LANES).map(|i| VelocityEstimate::new(rig(i), sample_rate)).collect::<Result<Vec<_>>>()?;
        if estimates.iter().all(Option::is_none) {
            estimates.clear();
        }
        Ok(Self {
            adaptive,
            estimates,
            outside: None,
            unmeasured_supply: (!rig(0).compensation.supply_correction)
                .then(|| S::from_lanes(|i| rig(i).supply.pressure)),
            nominal: Calibration {
                flow_gain: S::splat(1.0),
                response_delay: S::from_lanes(|i| rig(i).compensation.response_delay),
                valve_gain: S::splat(1.0),
                level: S::splat(1.0),
            },
            controller: RigController::pack(|i| &controllers[i]),
            feedforward: Feedforward::pack(|i| &feedforwards[i]),
            feeds_forward: (0..S::LANES).any(|i| rig(i).compensation.feedforward),
            looks_ahead: S::Mask::from_lanes(|i| rig(i).compensation.look_ahead),
            computation: DelayLine::new(|i| rig(i).compensation.computation_delay as usize),
            realization: rig(0).controller.realization,
            analog: Analog::pack(&rig),
            sensors,
            dac: Dac::new(|i| rig(i).dac.as_ref()),
            protection: Guarded::new(&rig, sample_rate)?.map(Box::new),
            sample_rate,
        })
    }

    /// Whether there is nothing but the paper's compensation in front of its analog controller.
    pub(crate) fn is_plain(&self) -> bool {
        self.realization == Realization::Analog
            && !self.feeds_forward
            && self.sensors.is_empty()
            && self.estimates.is_empty()
            && self.protection.is_none()
            && self.adaptive.is_none()
            && self.outside.is_none()
            && self.computation.is_none()
            && self.dac.is_ideal()
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    /// `PLAIN` is what [`is_plain`](Self::is_plain) says, for a path without any of the rest.
    #[inline(always)]
    pub(crate) fn sample<const PLAIN: bool>(
        &mut self,
        state: &mut DigitalState<C>,
        command: S,
        next_command: S,
        truth: Signals<S>,
        plant: &impl Driven<S>,
    ) -> Decision<S> {
        if PLAIN {
            let commands = [command, next_command, command];
            return self.sample_analog::<true>(state, commands, truth, Sensed::ideal(), plant);
        }
        let (mut measured, wire) = self.measure(truth);
        if self.outside.is_some() {
            return self.ask(command, next_command, measured);
        }
        if !self.estimates.is_empty() {
            self.estimate(&mut measured);
        }
        let (command, next_command, protection) = match &mut self.protection {
            None => (command, next_command, S::Flags::default()),
            Some(guarded) => {
                let (now, next, flags) = guarded.protect(command, next_command, &measured);
                (convert(now), convert(next), flags)
            }
        };
        let fed = S::select(self.looks_ahead, next_command, command);
        let mut decision = match self.realization {
            Realization::Analog => {
                let commands = [command, next_command, fed];
                self.sample_analog::<false>(state, commands, measured, wire, plant)
            }
            Realization::Digital => self.sample_digital(state, command, fed, measured),
        };
        decision.status = decision.status | protection;
        if let Some(adaptive) = &mut self.adaptive {
            decision.calibration = adaptive.calibration();
            adaptive.before = Some(decision.driver);
        }
        decision
    }

    /// Lets the controller from outside decide.
    #[inline(never)]
    fn ask(&mut self, command: S, next_command: S, mut measured: Signals<S>) -> Decision<S> {
        let Signals { velocity, force, spool, displacement, supply_pressure, acceleration } = measured;
        let signals =
            [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command];
        let answer = match &mut self.outside {
            Some(outside) => outside(signals.map(|signal| signal.lane(0).to_f64() as f32)),
            None => Answer::default(),
        };
        if !self.estimates.is_empty() {
            measured.velocity = convert(answer.velocity);
        }
        let calibration = match self.adaptive {
            None => self.nominal,
            Some(_) => Calibration {
                flow_gain: convert(answer.flow_gain),
                response_delay: convert(answer.response_delay),
                valve_gain: convert(answer.valve_gain),
                level: convert(answer.level),
            },
        };
        let (valve_command, clipped) = self.dac.convert(convert(answer.valve_command));
        Decision {
            measured,
            valve_command,
            compensation: convert(answer.compensation),
            calibration,
            status: S::flag(S::Mask::splat(true), answer.status) | clipped,
            driver: Driver::held(valve_command),
        }
    }

    /// In place of the velocity, what is made of the displacement.
    #[inline(never)]
    fn estimate(&mut self, measured: &mut Signals<S>) {
        let estimates = &mut self.estimates;
        measured.velocity = S::from_lanes(|i| {
            let one = measured.lane(i);
            let velocity = match estimates.get_mut(i) {
                Some(Some(estimate)) => estimate.velocity(one.displacement, one.force, one.acceleration),
                _ => one.velocity,
            };
            S::Element::from_f64(velocity)
        });
    }

    /// Puts a controller from outside in the place of the rig's own; of a digital side, one rig.
    pub(crate) fn controlled_by(&mut self, outside: Outside) {
        self.outside = Some(outside);
    }

    /// No-load flows (m³/s) that the valve of a lane was found to pass at these openings; none where nothing is
    /// learned, empty where it is learned outside.
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        let adaptive = self.adaptive.as_ref()?;
        let here = self.outside.is_none();
        Some(if here { adaptive.found_flows(openings, lane) } else { Vec::new() })
    }

    /// Asks the protection, where there is one, for the soft end.
    pub(crate) fn end(&mut self) {
        if let Some(guarded) = &mut self.protection {
            guarded.end();
        }
    }

    /// Trips the protection, where there is one, from outside.
    pub(crate) fn trip(&mut self) {
        if let Some(guarded) = &mut self.protection {
            guarded.trip();
        }
    }

    /// What the sensors make of the truth, and the load cell (gain and offset in N) as an analog controller sees it,
    /// where it is not ideal.
    #[inline(always)]
    fn measure(&mut self, truth: Signals<S>) -> (Signals<S>, Sensed<S>) {
        if self.sensors.is_empty() { (truth, Sensed::ideal()) } else { self.read_sensors(truth) }
    }

    #[inline(never)]
    fn read_sensors(&mut self, truth: Signals<S>) -> (Signals<S>, Sensed<S>) {
        let read = |(i, sensors): (usize, &mut Option<Sensors>)| {
            let ideal = Wire { gain: 1.0, offset: 0.0 };
            sensors.as_mut().map_or((truth.lane(i), ideal), |sensors| sensors.read(&truth.lane(i)))
        };
        let readings: Vec<_> = self.sensors.iter_mut().enumerate().map(read).collect();
        let wire = Sensed {
            gain: S::from_lanes(|i| readings[i].1.gain),
            offset: S::from_lanes(|i| readings[i].1.offset),
            ideal: false,
        };
        (Signals::from_lanes(|i| readings[i].0), wire)
    }

    #[inline(always)]
    fn sample_analog<const PLAIN: bool>(
        &mut self,
        state: &mut DigitalState<C>,
        [command, next_command, fed]: [S; 3],
        measured: Signals<S>,
        wire: Sensed<S>,
        plant: &impl Driven<S>,
    ) -> Decision<S> {
        let computed = if !PLAIN && let Some(adaptive) = &mut self.adaptive {
            let before = adaptive.before.map_or(self.analog, |driver| driver.cell.analog());
            let before = before.arrived(command).through((wire.gain, wire.offset));
            let before = Driver::analog(before, wire.ideal);
            let measurements = measured.measurements(plant.command(&before), self.unmeasured_supply);
            let (controller, state) = (&adaptive.controller.compensation, &mut adaptive.state.compensation);
            controller.step_ahead(state, convert(command), convert(fed), &measurements)
        } else {
            let (velocity, force, spool) = measured.rounded::<C>();
            let further_flow = if PLAIN {
                C::splat(0.0)
            } else {
                self.feedforward.step(&mut state.feedforward, convert(fed))
            };
            self.controller.compensation.step(
                &mut state.controller.compensation,
                velocity,
                force,
                spool,
                further_flow,
            )
        };
        let (compensation, clipped) = if PLAIN {
            (convert(computed.value), S::Flags::default())
        } else {
            self.dac.convert(self.computation.pass(convert(computed.value)))
        };
        if let Some(guarded) = &mut self.protection {
            guarded.watch(computed.status);
        }
        let rate = (next_command - command) * S::splat(self.sample_rate);
        let analog = self.analog.at(command, rate, compensation);
        let behind = analog.through((wire.gain, wire.offset));
        let driver = match &self.protection {
            Some(guarded) if !PLAIN => Driver::analog(behind.limited_to(convert(guarded.authority())), false),
            _ => Driver::analog(behind, PLAIN || wire.ideal),
        };
        let valve_command = plant.command(&driver);
        Decision {
            measured,
            valve_command,
            compensation,
            calibration: self.nominal,
            status: computed.status | clipped,
            driver,
        }
    }

    #[inline(always)]
    fn sample_digital(
        &mut self,
        state: &mut DigitalState<C>,
        command: S,
        fed: S,
        measured: Signals<S>,
    ) -> Decision<S> {
        let computation = &mut self.computation;
        let path = |compensation: C| convert(computation.pass(convert(compensation)));
        let output = if let Some(adaptive) = &mut self.adaptive {
            // The controller knows its own valve command.
            let measurements = measured.measurements(S::splat(0.0), self.unmeasured_supply);
            let (command, fed) = (convert(command), convert(fed));
            adaptive.controller.step_via(&mut adaptive.state, command, fed, &measurements, path)
        } else {
            let (velocity, force, spool) = measured.rounded::<C>();
            let further_flow = self.feedforward.step(&mut state.feedforward, convert(fed));
            self.controller.step_via(
                &mut state.controller,
                convert(command),
                velocity,
                force,
                spool,
                further_flow,
                path,
            )
        };
        let output = match &mut self.protection {
            Some(guarded) => guarded.apply(output),
            None => output,
        };
        let (valve_command, clipped) = self.dac.convert(convert(output.valve_command));
        Decision {
            measured,
            valve_command,
            compensation: convert(output.compensation),
            calibration: self.nominal,
            status: output.status | clipped,
            driver: Driver::held(valve_command),
        }
    }
}
