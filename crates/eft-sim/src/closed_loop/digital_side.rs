//! Everything between the plant's signals and what drives its valve: sensors, controller, converter.

use eft_core::{
    AdaptiveControllerState, ControllerState, Feedforward, FeedforwardState, Measurements, Real, Scalar,
};

use crate::closed_loop::controller::{Precision, RigAdaptiveController, RigController, adapts};
use crate::closed_loop::dac::Dac;
use crate::closed_loop::delay_line::DelayLine;
use crate::closed_loop::guarded::Guarded;
use crate::config::{Realization, RigConfig};
use crate::error::Result;
use crate::rig::{Analog, Driver, Held, Num};
use crate::sensors::{Sensors, Signals, Wire};

/// What the digital side made of one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decision<S: Num> {
    /// What the sensors reported; the truth where they are ideal.
    pub(crate) measured: Signals<S>,
    pub(crate) valve_command: S,
    pub(crate) compensation: S,
    pub(crate) calibration: Calibration<S>,
    pub(crate) status: S::Flags,
}

/// What the controller believes of its rig.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calibration<S> {
    /// True flow over the table's (1).
    pub(crate) flow_gain: S,
    /// Delay that the lead network makes up for (s).
    pub(crate) response_delay: S,
    /// The guard's factor on the compensation level (1).
    pub(crate) level: S,
}

impl<S: Num> Signals<S> {
    /// What the controller reads, in its precision: velocity, force and spool opening.
    #[inline(always)]
    fn rounded<C: Scalar>(&self) -> (C, C, C) {
        (convert(self.velocity), convert(self.force), convert(self.spool))
    }

    /// What the adaptive controller reads besides, with the valve command (V), and the supply pressure (Pa) that it
    /// takes for granted where none is measured.
    #[inline(always)]
    fn measurements<C: Scalar>(&self, valve_command: S, unmeasured: Option<S>) -> Measurements<C> {
        Measurements {
            velocity: convert(self.velocity),
            force: convert(self.force),
            spool: convert(self.spool),
            valve_command: convert(valve_command),
            supply_pressure: convert(unmeasured.unwrap_or(self.supply_pressure)),
        }
    }

    /// One lane.
    fn lane(&self, lane: usize) -> Signals<f64> {
        Signals {
            displacement: self.displacement.lane(lane),
            velocity: self.velocity.lane(lane),
            force: self.force.lane(lane),
            spool: self.spool.lane(lane),
            supply_pressure: self.supply_pressure.lane(lane),
        }
    }

    /// Lanes put side by side.
    fn from_lanes(f: impl Fn(usize) -> Signals<f64>) -> Self {
        Self {
            displacement: S::from_lanes(|i| f(i).displacement),
            velocity: S::from_lanes(|i| f(i).velocity),
            force: S::from_lanes(|i| f(i).force),
            spool: S::from_lanes(|i| f(i).spool),
            supply_pressure: S::from_lanes(|i| f(i).supply_pressure),
        }
    }
}

/// The same numbers in another precision.
#[inline(always)]
fn convert<A: Scalar, B: Scalar>(from: A) -> B {
    B::from_lanes(|i| B::Element::from_f64(from.lane(i).to_f64()))
}

/// Sensors, controller and converter of one actuator, or of several rigs' side by side; `C` is the controller's
/// number.
pub(crate) struct DigitalSide<S: Num, C: Scalar> {
    controller: RigController<C>,
    controller_state: ControllerState<C>,
    feedforward: Feedforward<C>,
    feedforward_state: FeedforwardState<C>,
    /// In place of the two above where the rig adapts.
    adaptive: Option<Box<(RigAdaptiveController<C>, AdaptiveControllerState<C>)>>,
    nominal: Calibration<S>,
    /// The configured supply pressure (Pa), where the controller has no transducer.
    unmeasured_supply: Option<S>,
    computation: DelayLine<S>,
    realization: Realization,
    analog: Analog<S>,
    held: Held<S>,
    /// One lane each; empty where every lane's are ideal.
    sensors: Vec<Option<Sensors>>,
    /// The load cell as the analog controller sees it, where it is not ideal.
    wire: Option<(S, S)>,
    dac: Dac<S>,
    protection: Option<Box<Guarded<S>>>,
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
            Box::new((controller, state))
        });
        Ok(Self {
            adaptive,
            unmeasured_supply: (!rig(0).compensation.supply_correction)
                .then(|| S::from_lanes(|i| rig(i).supply.pressure)),
            nominal: Calibration {
                flow_gain: S::splat(1.0),
                response_delay: S::from_lanes(|i| rig(i).compensation.response_delay),
                level: S::splat(1.0),
            },
            controller: RigController::pack(|i| &controllers[i]),
            controller_state: ControllerState::default(),
            feedforward: Feedforward::pack(|i| &feedforwards[i]),
            feedforward_state: FeedforwardState::default(),
            computation: DelayLine::new(|i| rig(i).compensation.computation_delay as usize),
            realization: rig(0).controller.realization,
            analog: Analog::pack(&rig),
            held: Held(S::default()),
            sensors,
            wire: None,
            dac: Dac::new(|i| rig(i).dac.as_ref()),
            protection: Guarded::new(&rig, sample_rate)?.map(Box::new),
            sample_rate,
        })
    }

    /// Samples, and decides what drives the valve until the next tick; `next_command` is the command then.
    /// `driven` gives the valve command (V) that a drive makes of the plant's state now.
    #[inline(always)]
    pub(crate) fn sample(
        &mut self,
        command: S,
        next_command: S,
        truth: Signals<S>,
        driven: impl Fn(&Driver<S>) -> S,
    ) -> Decision<S> {
        let measured = self.measure(truth);
        let (command, next_command, protection) = match &mut self.protection {
            None => (command, next_command, S::Flags::default()),
            Some(guarded) => guarded.protect(command, next_command, &measured),
        };
        let (mut valve_command, compensation, status) = match self.realization {
            Realization::Analog => self.sample_analog(command, next_command, &measured, driven),
            Realization::Digital => self.sample_digital(command, &measured),
        };
        if let (Some(guarded), Realization::Digital) = (&self.protection, self.realization) {
            valve_command = valve_command * guarded.authority;
            self.held = Held(valve_command);
        }
        let status = status | protection;
        let calibration = self.adaptive.as_ref().map_or(self.nominal, |adaptive| {
            let state = &adaptive.1.compensation;
            Calibration {
                flow_gain: convert(state.flow_gain()),
                response_delay: convert(state.response_delay()),
                level: convert(state.level()),
            }
        });
        Decision { measured, valve_command, compensation, calibration, status }
    }

    /// What drives the valve until the next tick.
    #[inline(always)]
    pub(crate) fn driver(&self) -> Driver<S> {
        match (self.realization, self.wire) {
            (Realization::Digital, _) => Driver::Held(self.held),
            (Realization::Analog, wire) if self.protection.is_some() => {
                let authority = self.protection.as_ref().map_or(S::splat(1.0), |guarded| guarded.authority);
                let wire = wire.unwrap_or((S::splat(1.0), S::splat(0.0)));
                Driver::ThroughCell(self.analog.through(wire).limited_to(authority))
            }
            (Realization::Analog, None) => Driver::Analog(self.analog),
            (Realization::Analog, Some(wire)) => Driver::ThroughCell(self.analog.through(wire)),
        }
    }

    /// Asks the protection, where there is one, for the soft end.
    pub(crate) fn end(&mut self) {
        if let Some(guarded) = &mut self.protection {
            guarded.end();
        }
    }

    /// What the sensors make of the truth.
    #[inline(always)]
    fn measure(&mut self, truth: Signals<S>) -> Signals<S> {
        if self.sensors.is_empty() { truth } else { self.read_sensors(truth) }
    }

    #[inline(never)]
    fn read_sensors(&mut self, truth: Signals<S>) -> Signals<S> {
        let read = |(i, sensors): (usize, &mut Option<Sensors>)| {
            let ideal = Wire { gain: 1.0, offset: 0.0 };
            sensors.as_mut().map_or((truth.lane(i), ideal), |sensors| sensors.read(&truth.lane(i)))
        };
        let readings: Vec<_> = self.sensors.iter_mut().enumerate().map(read).collect();
        self.wire = Some((S::from_lanes(|i| readings[i].1.gain), S::from_lanes(|i| readings[i].1.offset)));
        Signals::from_lanes(|i| readings[i].0)
    }

    fn sample_analog(
        &mut self,
        command: S,
        next_command: S,
        measured: &Signals<S>,
        driven: impl Fn(&Driver<S>) -> S,
    ) -> (S, S, S::Flags) {
        let computed = if let Some(adaptive) = &mut self.adaptive {
            let arrived = self.analog.arrived(command);
            let before = match self.wire {
                None => Driver::Analog(arrived),
                Some(wire) => Driver::ThroughCell(arrived.through(wire)),
            };
            let (controller, state) = adaptive.as_mut();
            let measurements = measured.measurements(driven(&before), self.unmeasured_supply);
            controller.compensation.step(&mut state.compensation, convert(command), &measurements)
        } else {
            let (velocity, force, spool) = measured.rounded::<C>();
            let further_flow = self.feedforward.step(&mut self.feedforward_state, convert(command));
            self.controller.compensation.step(
                &mut self.controller_state.compensation,
                velocity,
                force,
                spool,
                further_flow,
            )
        };
        let (compensation, clipped) = self.dac.convert(self.computation.pass(convert(computed.value)));
        let rate = (next_command - command) * S::splat(self.sample_rate);
        self.analog = self.analog.at(command, rate, compensation);
        (driven(&self.driver()), compensation, computed.status | clipped)
    }

    fn sample_digital(&mut self, command: S, measured: &Signals<S>) -> (S, S, S::Flags) {
        let computation = &mut self.computation;
        let path = |compensation: C| convert(computation.pass(convert(compensation)));
        let output = if let Some(adaptive) = &mut self.adaptive {
            let (controller, state) = adaptive.as_mut();
            let measurements = measured.measurements(self.held.0, self.unmeasured_supply);
            controller.step_via(state, convert(command), &measurements, path)
        } else {
            let (velocity, force, spool) = measured.rounded::<C>();
            let further_flow = self.feedforward.step(&mut self.feedforward_state, convert(command));
            self.controller.step_via(
                &mut self.controller_state,
                convert(command),
                velocity,
                force,
                spool,
                further_flow,
                path,
            )
        };
        let (valve_command, clipped) = self.dac.convert(convert(output.valve_command));
        self.held = Held(valve_command);
        (valve_command, convert(output.compensation), output.status | clipped)
    }
}
