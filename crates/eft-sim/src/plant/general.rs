//! The plant: servovalves and actuators on one structure, fed by one supply, with every effect.
//!
//! An effect that is switched off changes no bit. A single rig is a building of one story.

use eft_core::{Mask, Scalar};

use crate::lanes::Num;
use crate::plant::structure::{Motion, Structure, is_plain};
use crate::plant::{
    ActuatorState, AnyDrive, EnergyBalance, Equations, POWERS, STATES, ServoActuator, Signals, Spool, Stages,
    Supply, TimeGrid, runge_kutta,
};
use crate::{Result, RigConfig};

/// Servovalves, actuators, structure and supply with their state, one rig or several side by side.
#[derive(Debug, Clone)]
pub(crate) struct Plant<S: Num> {
    parts: Parts<S>,
    /// [`NUMBERS`] numbers per actuator, then [`SHARED`] numbers and the energies (J) of an account.
    state: Vec<S>,
    stages: Stages<Vec<S>>,
    /// Forces on the floors in this state (N).
    forces: Vec<S>,
    /// Accelerations of the floors in this state (m/s²).
    accelerations: Vec<S>,
}

/// The parts with equations; all actuators have the same parts.
#[derive(Debug, Clone)]
struct Parts<S: Num> {
    /// The spool opening (1) at rest, which the controller takes for null, whatever the true one is.
    /// One per actuator.
    opening_at_rest: Vec<S>,
    servo_actuator: ServoActuator<S>,
    supply: Supply<S>,
    structure: Structure<S>,
    /// Whether the plant computes its energy balance. Otherwise its state has no energies, and nothing else
    /// changes.
    computes_energy: bool,
}

/// Numbers of an actuator: those of [`ActuatorState`] with the filling in place of the load pressure, the load
/// cell's state (N), the hysteresis of its story, the flow of its torque motor (m³/s) and the rate of that flow.
const NUMBERS: usize = STATES + 4;

/// Shared numbers: the accumulator's pressure (Pa) and the time of the test (s).
const SHARED: usize = 2;

/// A view of the numbers of a state.
struct View<'a, S> {
    actuators: &'a [[S; NUMBERS]],
    accumulator: S,
    time: S,
    /// Empty without an account.
    energies: &'a [S],
}

impl<S: Num> View<'_, S> {
    /// The motion of a floor.
    #[inline(always)]
    fn motion(&self, i: usize) -> Motion<S> {
        let [_, _, _, displacement, velocity, _, hysteresis, ..] = self.actuators[i];
        Motion { displacement, velocity, hysteresis }
    }
}

impl<S: Num> Parts<S> {
    #[inline(always)]
    fn view<'a>(&self, state: &'a [S]) -> View<'a, S> {
        let (actuators, shared) = state.split_at(self.structure.len() * NUMBERS);
        let (shared, energies) = shared.split_at(SHARED);
        let [accumulator, time]: [S; SHARED] = shared.first_chunk().copied().unwrap_or_default();
        View { actuators: actuators.as_chunks().0, accumulator, time, energies }
    }

    fn at_rest(&self) -> Vec<S> {
        let actuators = self.structure.len() * NUMBERS;
        let energies = if self.computes_energy { POWERS } else { 0 };
        let mut state = vec![S::splat(0.0); actuators + SHARED + energies];
        let spools = state[..actuators].as_chunks_mut::<NUMBERS>().0.iter_mut();
        for ([_, spool, ..], opening) in spools.zip(&self.opening_at_rest) {
            *spool = *opening;
        }
        state[actuators] = self.supply.setting(S::splat(0.0));
        state
    }

    /// Forces (N) on the floors, and their accelerations (m/s²).
    #[inline(always)]
    fn accelerate(&self, view: &View<'_, S>, forces: &mut [S], accelerations: &mut [S]) {
        for (i, actuator) in view.actuators.iter().enumerate() {
            forces[i] = self.servo_actuator.force(&self.servo_actuator.state(actuator));
        }
        self.structure.accelerations(
            |i| forces[i],
            |i| view.motion(i),
            |i, acceleration| accelerations[i] = acceleration,
        );
    }

    /// Energy (J) in oil, stops, structure and accumulator.
    fn stored(&self, state: &[S]) -> S {
        let view = self.view(state);
        let stored =
            |actuator: &[S; NUMBERS]| self.servo_actuator.stored(&self.servo_actuator.state(actuator));
        let oil = view.actuators.iter().map(stored).fold(S::splat(0.0), |sum, stored| sum + stored);
        oil + self.structure.stored(|i| view.motion(i)) + self.supply.stored(view.accumulator)
    }
}

/// The plant's equations between two ticks.
struct Dynamics<'a, S: Num> {
    parts: &'a Parts<S>,
    drivers: &'a [AnyDrive<S>],
    /// Accelerations (m/s²) of an external structure; `None` for the rig's own structure.
    imposed: Option<&'a [S]>,
    forces: &'a mut [S],
    accelerations: &'a mut [S],
}

impl<S: Num> Equations<S> for Dynamics<'_, S> {
    #[inline(always)]
    fn rate(&mut self, state: &[S], time: S, rate: &mut [S]) {
        let view = self.parts.view(state);
        let Parts { servo_actuator, supply, structure, .. } = self.parts;
        self.parts.accelerate(&view, self.forces, self.accelerations);
        if let Some(imposed) = self.imposed {
            self.accelerations.copy_from_slice(imposed);
        }
        let setting = supply.setting(view.time);
        let pressure = supply.pressure(setting, view.accumulator);
        let mut drawn = S::splat(0.0);
        let mut powers = EnergyBalance::default();
        let (rates, shared) = rate.split_at_mut(structure.len() * NUMBERS);
        // By number: zipped iterators are calls in builds without optimization across units.
        for (i, rate) in rates.as_chunks_mut::<NUMBERS>().0.iter_mut().enumerate() {
            let (numbers, driver) = (&view.actuators[i], &self.drivers[i]);
            let actuator = servo_actuator.state(numbers);
            let (forces, acceleration) = ([self.forces[i], numbers[STATES]], self.accelerations[i]);
            let hydraulics = servo_actuator.hydraulics(&actuator, pressure);
            drawn = drawn + hydraulics.drawn();
            if self.parts.computes_energy {
                servo_actuator.add_powers(&mut powers, &actuator, &hydraulics, pressure);
            }
            let valve_command =
                servo_actuator.valve_command(&actuator, forces, &hydraulics, acceleration, driver, time);
            let [.., motor, motor_rate] = *numbers;
            let (of_actuator, [motor, motor_rate]) =
                servo_actuator.rate(&actuator, [motor, motor_rate], &hydraulics, acceleration, valve_command);
            let [pilot_flow, spool, filling, displacement, velocity] = of_actuator.to_array();
            let cell = servo_actuator.cell_rate(forces, acceleration);
            let hysteresis = structure.hysteresis_rate(i, |i| view.motion(i));
            *rate = [pilot_flow, spool, filling, displacement, velocity, cell, hysteresis, motor, motor_rate];
        }
        let pump_flow = supply.pump_flow(setting, pressure, drawn);
        if self.parts.computes_energy {
            structure.add_powers(&mut powers, |i| view.motion(i));
            powers.supplied = setting * pump_flow;
            powers.droop = (setting - pressure) * pump_flow;
            shared[SHARED..].copy_from_slice(&powers.to_array());
        }
        shared[0] = supply.rate(pump_flow, drawn);
        shared[1] = S::splat(1.0);
    }
}

impl<S: Num> Plant<S> {
    /// The true plants of `rig(0)`, `rig(1)`, … at rest side by side, one per lane, with the same number of
    /// stories.
    ///
    /// # Errors
    /// A flow curve that the core refuses.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let opening_at_rest = |actuator| S::from_lanes(|i| rig(i).opening_at_rest(actuator));
        let opening_at_rest = (0..rig(0).structure.floors()).map(opening_at_rest).collect();
        let rig: &dyn Fn(usize) -> _ = &|i| rig(i).plant();
        let parts = Parts {
            opening_at_rest,
            servo_actuator: ServoActuator::pack(rig)?,
            supply: Supply::pack(rig),
            structure: Structure::pack(rig),
            computes_energy: true,
        };
        let (state, none) = (parts.at_rest(), vec![S::splat(0.0); parts.structure.len()]);
        Ok(Self { stages: Stages::new(&state), state, forces: none.clone(), accelerations: none, parts })
    }

    /// The same plant without an energy balance.
    pub(crate) fn without_energy(mut self) -> Self {
        self.parts.computes_energy = false;
        self.state = self.parts.at_rest();
        self.stages = Stages::new(&self.state);
        self
    }

    /// Number of actuators.
    pub(crate) fn actuators(&self) -> usize {
        self.parts.structure.len()
    }

    /// Back to rest.
    pub(crate) fn reset(&mut self) {
        self.state = self.parts.at_rest();
        self.parts.servo_actuator.bypass_valve.close(S::Mask::splat(true));
        self.update_forces();
    }

    /// Returns the plants of some lanes to rest.
    pub(crate) fn restart(&mut self, at: S::Mask) {
        self.parts.servo_actuator.bypass_valve.close(at);
        for (number, rest) in self.state.iter_mut().zip(self.parts.at_rest()) {
            *number = S::select(at, rest, *number);
        }
        self.update_forces();
    }

    /// Sets displacements (m) and velocities (m/s) of the floors.
    pub(crate) fn set_motion(&mut self, displacements: &[S], velocities: &[S]) {
        let motions = displacements.iter().zip(velocities);
        for ([.., x, v, _, _, _, _], motion) in
            self.state.as_chunks_mut::<NUMBERS>().0.iter_mut().zip(motions)
        {
            (*x, *v) = (*motion.0, *motion.1);
        }
        self.update_forces();
    }

    /// The energy balance of one lane since rest; zero without an account.
    pub(crate) fn balance(&self, lane: usize) -> EnergyBalance {
        let integrals = self.view().energies.first_chunk().copied().unwrap_or_default();
        let stored = self.parts.stored(&self.state) - self.parts.stored(&self.parts.at_rest());
        EnergyBalance::new(integrals.map(|integral: S| integral.lane(lane)), stored.lane(lane))
    }

    /// Valve, oil and piston of an actuator.
    #[inline(always)]
    pub(crate) fn actuator(&self, i: usize) -> ActuatorState<S> {
        self.parts.servo_actuator.state(&self.state[i * NUMBERS..])
    }

    /// Force (N) on a floor.
    #[inline(always)]
    pub(crate) fn force(&self, i: usize) -> S {
        self.forces[i]
    }

    /// The true signals of an actuator's sensors.
    #[inline(always)]
    pub(crate) fn signals(&self, i: usize) -> Signals<S> {
        let actuator = self.actuator(i);
        let supply_pressure = self.supply_pressure();
        let filling = ActuatorState::from_slice(&self.state[i * NUMBERS..]).load_pressure;
        let [displacement, velocity] =
            self.parts.servo_actuator.measured_motion(&actuator, filling, supply_pressure);
        Signals {
            displacement,
            velocity,
            force: self.parts.servo_actuator.shown(self.cell_forces(i)),
            spool: actuator.spool,
            supply_pressure,
            acceleration: self.accelerations[i],
            load_pressure: actuator.load_pressure,
        }
    }

    /// Lanes with a spool at a stop, and lanes with a piston beyond its stroke.
    #[inline(always)]
    pub(crate) fn at_limits(&self, i: usize) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        self.parts.servo_actuator.at_limits(&self.actuator(i))
    }

    /// The present valve command (V) of a driver for an actuator.
    #[inline(always)]
    pub(crate) fn valve_command(&self, i: usize, driver: &AnyDrive<S>) -> S {
        let (actuator, servo_actuator) = (self.actuator(i), &self.parts.servo_actuator);
        let hydraulics = servo_actuator.hydraulics(&actuator, self.supply_pressure());
        let (forces, now) = (self.cell_forces(i), S::splat(0.0));
        servo_actuator.valve_command(&actuator, forces, &hydraulics, self.accelerations[i], driver, now)
    }

    /// Opens the bypass valves further for a tick, as after a trip.
    pub(crate) fn open_bypass(&mut self, grid: TimeGrid, at: S::Mask) {
        self.parts.servo_actuator.bypass_valve.open(1.0 / grid.sample_rate, at);
    }

    /// Advances the plant by a tick, with one driver per actuator.
    #[inline(always)]
    pub(crate) fn advance(&mut self, drivers: &[AnyDrive<S>], grid: TimeGrid) {
        for n in 0..grid.steps {
            self.step(drivers, f64::from(n) * grid.step, grid.step, None);
        }
        self.update_forces();
    }

    /// One integration step (s) from a time (s) after the tick. With given accelerations (m/s²) the pistons
    /// follow them instead of the structure.
    #[inline(always)]
    pub(crate) fn step(&mut self, drivers: &[AnyDrive<S>], from: f64, step: f64, imposed: Option<&[S]>) {
        let Self { parts, state, stages, forces, accelerations } = self;
        let mut equations = Dynamics { parts, drivers, imposed, forces, accelerations };
        runge_kutta(state, stages, from, step, &mut equations);
        let actuators = parts.structure.len() * NUMBERS;
        for actuator in state[..actuators].as_chunks_mut::<NUMBERS>().0 {
            Spool::stop_in(actuator);
        }
    }

    /// Updates forces and accelerations from the state.
    #[inline(always)]
    pub(crate) fn update_forces(&mut self) {
        let Self { parts, state, forces, accelerations, .. } = self;
        parts.accelerate(&parts.view(state), forces, accelerations);
    }

    #[inline(always)]
    fn view(&self) -> View<'_, S> {
        self.parts.view(&self.state)
    }

    /// Force on a floor, and the load cell's state (N).
    #[inline(always)]
    fn cell_forces(&self, i: usize) -> [S; 2] {
        [self.forces[i], self.state[i * NUMBERS + STATES]]
    }

    #[inline(always)]
    fn supply_pressure(&self) -> S {
        let (supply, view) = (&self.parts.supply, self.view());
        supply.pressure(supply.setting(view.time), view.accumulator)
    }
}

impl Plant<f64> {
    /// Visits every number of the state, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.state.iter_mut().for_each(&mut *visit);
        visit(&mut self.parts.servo_actuator.bypass_valve.opening);
        self.update_forces();
    }
}

/// Whether a rig's true plant has an effect beyond the paper's model, or several actuators.
pub(crate) fn needs_detail(rig: &RigConfig) -> bool {
    let rig = rig.plant();
    let (valve, actuator, supply) = (&rig.servovalve, &rig.actuator, &rig.supply);
    let leakage = &valve.leakage;
    let plain_valve = valve.overlap == 0.0
        && valve.null_bias == 0.0
        && valve.pilot_flow_limit.is_none()
        && valve.torque_motor_frequency.is_none()
        && leakage.proportional == 0.0
        && leakage.constant == 0.0;
    let plain_actuator =
        actuator.friction == 0.0 && actuator.stop_stiffness.is_none() && actuator.dead_length.is_none();
    let plain_actuator = plain_actuator
        && actuator.bypass_flow == 0.0
        && actuator.area_ratio == 1.0
        && actuator.attachment_play == 0.0
        && !rig.piston_moves_alone();
    let plain_supply = supply.schedule.is_none() && supply.accumulator.is_none();
    let plain_cell = rig.sensors.force.bandwidth.is_none();
    !(plain_valve && plain_actuator && plain_supply && plain_cell && is_plain(rig))
}
