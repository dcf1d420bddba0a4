//! The paper's rig, Fig. 1, without further effects: one valve, one actuator, one structure.

use eft_core::Scalar;

use crate::lanes::Num;
use crate::plant::{
    Actuator, ActuatorState, Drive, Equations, LoadFlow, PilotValve, Signals, Spool, Stages, Story,
    runge_kutta,
};
use crate::{Result, RigConfig};

/// The nonlinear terms of the plant's equations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terms<S> {
    /// Load flow (m³/s).
    pub(crate) flow: S,
    /// Change of the spring's force by softening (N).
    pub(crate) softening: S,
}

/// The blocks of the paper's model, one rig or several side by side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlainPlant<S: Num> {
    pilot_valve: PilotValve<S>,
    spool: Spool<S>,
    load_flow: LoadFlow<S>,
    actuator: Actuator<S>,
    story: Story<S>,
    supply_pressure: S,
}

impl<S: Num> PlainPlant<S> {
    /// The true plants of `rig(0)`, `rig(1)`, … side by side, one per lane.
    ///
    /// # Errors
    /// A flow curve that the core refuses.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let rig: &dyn Fn(usize) -> _ = &|i| rig(i).plant();
        Ok(Self {
            pilot_valve: PilotValve::pack(rig),
            spool: Spool::pack(rig),
            load_flow: LoadFlow::pack(rig)?,
            actuator: Actuator::pack(rig),
            story: Story::pack(rig, 0),
            supply_pressure: S::from_lanes(|i| rig(i).supply.pressure),
        })
    }

    /// Force (N) on the structure in this state.
    #[inline(always)]
    pub(crate) fn force(&self, state: &ActuatorState<S>) -> S {
        self.actuator.force(state.load_pressure)
    }

    /// The true signals of the sensors.
    #[inline(always)]
    pub(crate) fn signals(&self, state: &ActuatorState<S>) -> Signals<S> {
        let ActuatorState { spool, load_pressure, displacement, velocity, .. } = *state;
        let force = self.force(state);
        let acceleration = self.story.acceleration(force, displacement, velocity);
        let supply_pressure = self.supply_pressure;
        Signals { displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure }
    }

    /// Lanes with the spool at a stop, and lanes with the piston beyond its stroke.
    #[inline(always)]
    pub(crate) fn at_limits(&self, state: &ActuatorState<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        (Spool::at_stop(state.spool), self.actuator.beyond_stroke(state.displacement))
    }

    /// The load flow (m³/s) in this state, and its slope over the spool opening (m³/s per unit opening).
    #[inline(always)]
    pub(crate) fn flow_and_gain(&self, state: &ActuatorState<S>) -> (S, S) {
        self.load_flow.flow_and_gain(Spool::stop(state.spool), state.load_pressure, S::splat(1.0))
    }

    /// Change of the spring's force (N) by softening in this state.
    #[inline(always)]
    pub(crate) fn softening_force(&self, state: &ActuatorState<S>) -> S {
        self.story.softening_force(state.displacement)
    }

    /// The valve command (V) of `drive` at the start of its interval, for a load flow `flow` (m³/s).
    #[inline(always)]
    pub(crate) fn driven_command(&self, state: &ActuatorState<S>, flow: S, drive: &impl Drive<S>) -> S {
        drive.limit(self.driven_demand(state, flow, drive, S::splat(0.0)))
    }

    /// The valve command (V) of `drive` without its limit, a time (s) after its sample.
    #[inline(always)]
    pub(crate) fn driven_demand(
        &self,
        state: &ActuatorState<S>,
        flow: S,
        drive: &impl Drive<S>,
        time: S,
    ) -> S {
        let pressure_rate = self.actuator.rate(flow, state.load_pressure, state.velocity);
        drive.demand(time, self.force(state), self.actuator.force(pressure_rate))
    }

    /// The state a time `period` (s) later, by `steps` Runge–Kutta steps. The first step starts a time `from`
    /// (s) after the sample.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: ActuatorState<S>,
        drive: &impl Drive<S>,
        from: f64,
        period: f64,
        steps: u32,
    ) -> ActuatorState<S> {
        let step = period / f64::from(steps);
        let mut numbers = state.to_array();
        let mut stages = Stages::new(&numbers);
        for n in 0..steps {
            let start = from + f64::from(n) * step;
            runge_kutta(&mut numbers, &mut stages, start, step, &mut Dynamics { plant: self, drive });
            Spool::stop_in(&mut numbers);
        }
        ActuatorState::from_array(numbers)
    }

    /// The rate of the state for given terms and a valve command (V). It is linear in them if the spool is not at a
    /// stop.
    #[inline(always)]
    pub(crate) fn rate_under(
        &self,
        state: &ActuatorState<S>,
        terms: &Terms<S>,
        valve_command: S,
    ) -> ActuatorState<S> {
        let left = self.force(state) - terms.softening;
        ActuatorState {
            pilot_flow: self.pilot_valve.rate(valve_command, state.spool, state.pilot_flow),
            spool: self.spool.rate(state.pilot_flow, state.spool),
            load_pressure: self.actuator.rate(terms.flow, state.load_pressure, state.velocity),
            displacement: state.velocity,
            velocity: self.story.linear_acceleration(left, state.displacement, state.velocity),
        }
    }
}

/// The equations under a drive.
struct Dynamics<'a, S: Num, D> {
    plant: &'a PlainPlant<S>,
    drive: &'a D,
}

impl<S: Num, D: Drive<S>> Equations<S> for Dynamics<'_, S, D> {
    #[inline(always)]
    fn rate(&mut self, state: &[S], time: S, rate: &mut [S]) {
        let Self { plant, drive } = *self;
        let state = ActuatorState::from_slice(state);
        let terms = Terms { flow: plant.flow_and_gain(&state).0, softening: plant.softening_force(&state) };
        let valve_command = drive.limit(plant.driven_demand(&state, terms.flow, drive, time));
        if let Some(rate) = rate.first_chunk_mut() {
            *rate = plant.rate_under(&state, &terms, valve_command).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;
    use crate::plant::drive::{AnyDrive, Held};
    use crate::plant::{Plant, TimeGrid};

    #[test]
    fn the_plain_plant_has_the_bits_of_the_plant_without_effects() {
        let rig = changed(&[]);
        let (plain, mut plant) =
            (PlainPlant::<f64>::pack(&|_| &rig).unwrap(), Plant::pack(&|_| &rig).unwrap());
        let mut state = ActuatorState::default();
        // The motion reaches a stop of the spool and the softening of the spring, and returns.
        for n in 0..2048 {
            let command = 5.0 * (0.01 * f64::from(n)).sin();
            state = plain.advance(state, &Held(command), 0.0, 1.0 / 1024.0, 2);
            plant.advance(&[AnyDrive::held(command)], TimeGrid::new(1024.0, 2));
            assert_eq!((state, plain.force(&state)), (plant.actuator(0), plant.force(0)), "tick {n}");
        }
        assert!(state.displacement.abs() > 1e-3);
    }
}
