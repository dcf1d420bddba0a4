//! Servovalve, actuator and structure put together (Fig. 1), and the step through time.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::Num;
use crate::rig::actuator::Actuator;
use crate::rig::drive::{At, Drive, Held, Valve};
use crate::rig::load_flow::LoadFlow;
use crate::rig::pilot_valve::PilotValve;
use crate::rig::spool::Spool;
use crate::rig::state::PlantState;
use crate::rig::structure::Structure;

/// What the plant's equations are not linear in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terms<S> {
    /// Load flow (m³/s).
    pub(crate) flow: S,
    /// What softening adds to the spring's force (N).
    pub(crate) softening: S,
}

/// The whole plant, one rig or several side by side.
#[derive(Debug, Clone, Copy)]
pub struct Plant<S: Num> {
    pilot_valve: PilotValve<S>,
    spool: Spool<S>,
    load_flow: LoadFlow<S>,
    actuator: Actuator<S>,
    structure: Structure<S>,
    supply_pressure: S,
}

impl<S: Num> Plant<S> {
    /// The true plants of `rig(0)`, `rig(1)`, … side by side, one a lane.
    ///
    /// # Errors
    /// A flow curve that the core refuses.
    pub fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let rig = |i| rig(i).plant();
        Ok(Self {
            pilot_valve: PilotValve::pack(rig),
            spool: Spool::pack(rig),
            load_flow: LoadFlow::pack(rig)?,
            actuator: Actuator::pack(rig),
            structure: Structure::pack(rig),
            supply_pressure: S::from_lanes(|i| rig(i).supply.pressure),
        })
    }

    /// Force (N) on the structure in this state.
    #[inline(always)]
    pub fn force(&self, state: &PlantState<S>) -> S {
        self.actuator.force(state.load_pressure)
    }

    /// Supply pressure (Pa).
    #[inline(always)]
    pub(crate) fn supply_pressure(&self) -> S {
        self.supply_pressure
    }

    /// Acceleration (m/s²) in this state.
    #[inline(always)]
    pub(crate) fn acceleration(&self, state: &PlantState<S>) -> S {
        self.structure.acceleration(self.force(state), state.displacement, state.velocity)
    }

    /// Where the spool stands at a stop, and where the piston is beyond its stroke.
    #[inline(always)]
    pub(crate) fn at_limits(&self, state: &PlantState<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        (Spool::at_stop(state.spool), self.actuator.beyond_stroke(state.displacement))
    }

    /// The load flow (m³/s) in this state, and its slope over the spool opening (m³/s per unit opening).
    #[inline(always)]
    pub(crate) fn flow_and_gain(&self, state: &PlantState<S>) -> (S, S) {
        self.load_flow.flow_and_gain(Spool::stop(state.spool), state.load_pressure)
    }

    /// What softening adds to the spring's force (N) in this state.
    #[inline(always)]
    pub(crate) fn softening_force(&self, state: &PlantState<S>) -> S {
        self.structure.softening_force(state.displacement)
    }

    /// The valve command (V) that `drive` gives at the start of its interval, where the load flow is `flow` (m³/s).
    #[inline(always)]
    pub(crate) fn driven_command(&self, state: &PlantState<S>, flow: S, drive: &impl Drive<S>) -> S {
        drive.limit(self.driven_demand(state, flow, drive, S::splat(0.0)))
    }

    /// What `drive` would give a time (s) after its sample without its limit (V).
    #[inline(always)]
    pub(crate) fn driven_demand(&self, state: &PlantState<S>, flow: S, drive: &impl Drive<S>, time: S) -> S {
        let pressure_rate = self.actuator.rate(flow, state.load_pressure, state.velocity);
        drive.demand(time, self.force(state), self.actuator.force(pressure_rate))
    }

    /// The state a time `period` (s) later under a held valve command (V), in `steps` steps.
    pub fn advance(&self, state: PlantState<S>, valve_command: S, period: f64, steps: u32) -> PlantState<S> {
        self.advance_driven(state, &Held(valve_command), 0.0, period, steps)
    }

    /// The state a time `period` (s) later, in `steps` classical Runge–Kutta steps, the first of which starts a time
    /// `from` (s) after the sample.
    ///
    /// The table's kinks, the sign in the load pressure's root and the spool's stops are stepped over: they
    /// bound the order locally, and the default step is chosen with them counted in.
    #[inline(always)]
    pub(crate) fn advance_driven(
        &self,
        mut state: PlantState<S>,
        drive: &impl Drive<S>,
        from: f64,
        period: f64,
        steps: u32,
    ) -> PlantState<S> {
        let step = period / f64::from(steps);
        let (h, half, sixth) = (S::splat(step), S::splat(step / 2.0), S::splat(step / 6.0));
        let two = S::splat(2.0);
        for n in 0..steps {
            let start = from + f64::from(n) * step;
            let (t, t_half, t_end) = (S::splat(start), S::splat(start + step / 2.0), S::splat(start + step));
            let k1 = self.rate(&state, drive, t);
            let k2 = self.rate(&state.after(k1, half), drive, t_half);
            let k3 = self.rate(&state.after(k2, half), drive, t_half);
            let k4 = self.rate(&state.after(k3, h), drive, t_end);
            let middle = k2.zip(k3, |a, b| a + b);
            let sum = k1.zip(k4, |a, b| a + b).zip(middle, |ends, mid| ends + two * mid);
            state = state.after(sum, sixth);
            state.spool = Spool::stop(state.spool);
        }
        state
    }

    #[inline(always)]
    fn rate(&self, state: &PlantState<S>, drive: &impl Drive<S>, time: S) -> PlantState<S> {
        let terms = Terms { flow: self.flow_and_gain(state).0, softening: self.softening_force(state) };
        self.rate_under(state, &terms, &At { drive, time })
    }

    /// The state's rate where the terms are given and `valve` makes the valve command (V) of force (N) and force
    /// rate (N/s). Off the spool's stops it is linear in state, terms and command.
    #[inline(always)]
    pub(crate) fn rate_under(
        &self,
        state: &PlantState<S>,
        terms: &Terms<S>,
        valve: &impl Valve<S>,
    ) -> PlantState<S> {
        let force = self.actuator.force(state.load_pressure);
        let pressure_rate = self.actuator.rate(terms.flow, state.load_pressure, state.velocity);
        let valve_command = valve.command(force, self.actuator.force(pressure_rate));
        PlantState {
            pilot_flow: self.pilot_valve.rate(valve_command, state.spool, state.pilot_flow),
            spool: self.spool.rate(state.pilot_flow, state.spool),
            load_pressure: pressure_rate,
            displacement: state.velocity,
            velocity: self.structure.linear_acceleration(
                force - terms.softening,
                state.displacement,
                state.velocity,
            ),
        }
    }
}
