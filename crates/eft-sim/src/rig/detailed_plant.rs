//! The plant with every effect that the paper's model leaves out, and its energy.

use eft_core::Scalar;

use crate::config::{RigConfig, StructureKind};
use crate::error::Result;
use crate::rig::drive::Drive;
use crate::rig::energy::{Energy, EnergyBalance};
use crate::rig::model::{Pace, PlantModel};
use crate::rig::runge_kutta::{Vector, runge_kutta};
use crate::rig::servo_actuator::ServoActuator;
use crate::rig::specimen::{self, Specimen};
use crate::rig::spool::Spool;
use crate::rig::supply::Supply;
use crate::rig::{Num, PlantState};
use crate::sensors::Signals;

/// Servovalve, supply, actuator and structure with every effect, one rig or several side by side.
///
/// Effects that are off cost time and change the result by rounding only; [`Plant`](crate::rig::Plant) is the
/// same without them.
#[derive(Debug, Clone)]
pub(crate) struct DetailedPlant<S: Num> {
    servo_actuator: ServoActuator<S>,
    supply: Supply<S>,
    specimen: Specimen<S>,
}

/// Everything that a detailed plant remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DetailedState<S> {
    core: PlantState<S>,
    /// Pressure of the accumulator (Pa).
    accumulator: S,
    /// What the load cell shows (N).
    cell: S,
    /// The structure's hysteresis.
    hysteresis: S,
    /// Time of the test (s).
    time: S,
    energy: Energy<S>,
}

impl<S: Num> Vector<S> for DetailedState<S> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(S, S) -> S) -> Self {
        Self {
            core: self.core.zip(other.core, &f),
            accumulator: f(self.accumulator, other.accumulator),
            cell: f(self.cell, other.cell),
            hysteresis: f(self.hysteresis, other.hysteresis),
            time: f(self.time, other.time),
            energy: self.energy.zip(other.energy, f),
        }
    }
}

impl<S> DetailedState<S> {
    /// Puts the piston to a displacement (m) and velocity (m/s).
    pub(crate) fn set_motion(&mut self, displacement: S, velocity: S) {
        self.core.displacement = displacement;
        self.core.velocity = velocity;
    }
}

impl<S: Num> DetailedPlant<S> {
    /// The balance of one lane's energies since `start`.
    pub(crate) fn balance(
        &self,
        start: &DetailedState<S>,
        now: &DetailedState<S>,
        lane: usize,
    ) -> EnergyBalance {
        let change = now.energy.zip(start.energy, |now, start| now - start);
        let energy = Energy {
            supplied: change.supplied.lane(lane),
            swept: change.swept.lane(lane),
            droop: change.droop.lane(lane),
            valve: change.valve.lane(lane),
            leakage: change.leakage.lane(lane),
            friction: change.friction.lane(lane),
            stops: change.stops.lane(lane),
            damping: change.damping.lane(lane),
            hysteresis: change.hysteresis.lane(lane),
        };
        EnergyBalance::new(&energy, (self.stored(now) - self.stored(start)).lane(lane))
    }

    fn stored(&self, state: &DetailedState<S>) -> S {
        self.servo_actuator.stored(&state.core)
            + self.specimen.stored(state.core.displacement, state.core.velocity)
            + self.supply.stored(state.accumulator)
    }

    #[inline(always)]
    fn supply_pressure(&self, state: &DetailedState<S>) -> S {
        self.supply.pressure(self.supply.setting(state.time), state.accumulator)
    }

    #[inline(always)]
    fn acceleration(&self, state: &DetailedState<S>) -> S {
        let PlantState { displacement, velocity, .. } = state.core;
        let force = self.servo_actuator.force(&state.core);
        self.specimen.acceleration(force, displacement, velocity, state.hysteresis)
    }

    /// One step (s) under a held command, the piston led at a constant acceleration (m/s²).
    pub(crate) fn advance_led(
        &self,
        state: DetailedState<S>,
        drive: &impl Drive<S>,
        acceleration: S,
        step: f64,
    ) -> DetailedState<S> {
        let mut state =
            runge_kutta(state, 0.0, step, |state, time| self.rate_led(state, drive, acceleration, time));
        state.core.spool = Spool::stop(state.core.spool);
        state
    }

    #[inline(always)]
    fn rate(&self, state: &DetailedState<S>, drive: &impl Drive<S>, time: S) -> DetailedState<S> {
        self.rate_led(state, drive, self.acceleration(state), time)
    }

    #[inline(always)]
    fn rate_led(
        &self,
        state: &DetailedState<S>,
        drive: &impl Drive<S>,
        acceleration: S,
        time: S,
    ) -> DetailedState<S> {
        let core = &state.core;
        let setting = self.supply.setting(state.time);
        let pressure = self.supply.pressure(setting, state.accumulator);
        let hydraulics = self.servo_actuator.hydraulics(core, pressure);
        let valve_command =
            self.servo_actuator.driven_command(core, state.cell, &hydraulics, acceleration, drive, time);
        let pump_flow = self.supply.pump_flow(setting, pressure, hydraulics.drawn());
        let energy = Energy {
            supplied: setting * pump_flow,
            droop: (setting - pressure) * pump_flow,
            damping: self.specimen.damping_loss(core.velocity),
            hysteresis: self.specimen.hysteresis_power(core.velocity, state.hysteresis),
            ..self.servo_actuator.powers(core, &hydraulics, pressure)
        };
        DetailedState {
            core: self.servo_actuator.rate(core, &hydraulics, acceleration, valve_command),
            accumulator: self.supply.rate(pump_flow, hydraulics.drawn()),
            cell: self.servo_actuator.cell_rate(core, acceleration, state.cell),
            hysteresis: self.specimen.hysteresis_rate(core.velocity, state.hysteresis),
            time: S::splat(1.0),
            energy,
        }
    }
}

impl<S: Num> PlantModel<S> for DetailedPlant<S> {
    type State = DetailedState<S>;
    type Ahead = ();

    fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig, _: Pace) -> Result<Self> {
        let rig = |i| rig(i).plant();
        Ok(Self {
            servo_actuator: ServoActuator::pack(rig)?,
            supply: Supply::pack(rig),
            specimen: Specimen::pack(rig),
        })
    }

    fn at_rest(&self) -> DetailedState<S> {
        let zero = S::splat(0.0);
        DetailedState {
            core: PlantState::default(),
            accumulator: self.supply.setting(zero),
            cell: zero,
            hysteresis: zero,
            time: zero,
            energy: Energy::default(),
        }
    }

    fn restarted(&self, state: DetailedState<S>, at: <S as Scalar>::Mask) -> DetailedState<S> {
        self.at_rest().zip(state, |rest, now| S::select(at, rest, now))
    }

    #[inline(always)]
    fn core(state: &DetailedState<S>) -> &PlantState<S> {
        &state.core
    }

    #[inline(always)]
    fn force(&self, state: &DetailedState<S>) -> S {
        self.servo_actuator.force(&state.core)
    }

    #[inline(always)]
    fn signals(&self, state: &DetailedState<S>) -> Signals<S> {
        Signals {
            displacement: state.core.displacement,
            velocity: state.core.velocity,
            force: self.servo_actuator.shown(&state.core, state.cell),
            spool: state.core.spool,
            supply_pressure: self.supply_pressure(state),
            acceleration: self.acceleration(state),
        }
    }

    #[inline(always)]
    fn at_limits(&self, state: &DetailedState<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        self.servo_actuator.at_limits(&state.core)
    }

    fn driven_command(&self, state: &DetailedState<S>, drive: &impl Drive<S>) -> S {
        let hydraulics = self.servo_actuator.hydraulics(&state.core, self.supply_pressure(state));
        let acceleration = self.acceleration(state);
        let now = S::splat(0.0);
        self.servo_actuator.driven_command(&state.core, state.cell, &hydraulics, acceleration, drive, now)
    }

    #[inline(always)]
    fn look_ahead(&self, _: &DetailedState<S>) {}

    /// In classical Runge–Kutta steps.
    fn advance_driven(
        &self,
        mut state: DetailedState<S>,
        _: (),
        drive: &impl Drive<S>,
        pace: Pace,
    ) -> DetailedState<S> {
        let step = pace.step();
        for n in 0..pace.steps {
            let start = f64::from(n) * step;
            state = runge_kutta(state, start, step, |state, time| self.rate(state, drive, time));
            state.core.spool = Spool::stop(state.core.spool);
        }
        state
    }
}

/// Whether a rig's true plant has an effect that only the detailed plant knows.
pub(crate) fn needs_detail(rig: &RigConfig) -> bool {
    let rig = rig.plant();
    let (valve, actuator, supply) = (&rig.servovalve, &rig.actuator, &rig.supply);
    let leakage = &valve.leakage;
    let plain_valve = valve.overlap == 0.0
        && valve.pilot_flow_limit.is_none()
        && leakage.proportional == 0.0
        && leakage.constant == 0.0;
    let plain_actuator =
        actuator.friction == 0.0 && actuator.stop_stiffness.is_none() && actuator.dead_length.is_none();
    let plain_supply = supply.schedule.is_none() && supply.accumulator.is_none();
    let plain_cell = rig.sensors.force.bandwidth.is_none();
    !(plain_valve && plain_actuator && plain_supply && plain_cell && specimen::is_plain(rig))
}

/// The longest step (s) that the effects beyond the paper's model allow.
pub(crate) fn longest_step(rig: &RigConfig) -> f64 {
    let rig = rig.plant();
    let (actuator, supply) = (&rig.actuator, &rig.supply);
    let stories =
        rig.structure.stories.as_ref().filter(|_| rig.structure.kind == StructureKind::ShearBuilding);
    let mass = stories.map_or(rig.structure.mass, |s| s.masses.iter().copied().fold(f64::INFINITY, f64::min));
    let friction = actuator.friction / (mass * actuator.friction_velocity);
    let stop = actuator.stop_stiffness.map_or(0.0, |k| (k / mass).sqrt());
    let accumulator = supply.droop.zip(supply.accumulator).map_or(0.0, |(r, c)| 1.0 / (r * c));
    let cell = rig.sensors.force.bandwidth.map_or(0.0, |f| std::f64::consts::TAU * f);
    let fastest = [friction, stop, accumulator, cell, specimen::fastest_rate(rig)];
    // A fifth of the fastest time constant: well inside the stability limit of 2.8, and accurate to 1e-5 a step.
    0.2 / fastest.into_iter().fold(0.0, f64::max)
}
