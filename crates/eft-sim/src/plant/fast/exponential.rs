//! The integration step of ordinary tests: the linear part is exact, and the load flow is evaluated once per
//! step.
//!
//! An exponential multistep method (predict, evaluate, correct). With the propagators of [`Propagator`] the
//! linear part is exact. Load flow and softening are parabolas through their values at the ends of the step
//! and one step before. The value at the end is computed at a predicted state, without the jump of the demand
//! at the sample and its growth after it. Both are corrected to first order afterwards. The flow is therefore
//! evaluated once per step, in parallel with the controller.
//!
//! Steps with a spool at a stop, a demand at its limit or a faulty load cell use Runge–Kutta.

use eft_core::Mask;

use crate::Result;
use crate::config::{Realization, RigConfig};
use crate::lanes::{Num, Work};
use crate::plant::fast::plain::PlainPlant;
use crate::plant::fast::propagator::Propagator;
use crate::plant::{ActuatorState, Analog, Drive, Held, Spool, TimeGrid};

/// Runge–Kutta steps instead of one step in which the spool reaches or leaves a stop.
const SUBSTEPS: u32 = 2;

/// The plant with the method's coefficients, one rig or several side by side.
#[derive(Debug, Clone)]
pub(crate) struct Exponential<S: Num> {
    /// The blocks of the plant.
    pub(crate) plant: PlainPlant<S>,
    propagator: Propagator<S>,
    /// Gain (1) of the working load cell that the propagator assumes.
    cell_gain: S,
    /// The spool's opening (1) at rest, and the valve command (V) that holds it.
    at_rest: [S; 2],
}

/// The state of the plant and of the method.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FastState<S> {
    /// Valve, oil and piston.
    pub(crate) plant: ActuatorState<S>,
    history: History<S>,
}

/// Values of the previous steps that the method needs.
#[derive(Debug, Clone, Copy, Default)]
struct History<S> {
    /// Load flow (m³/s) now and one step before.
    flow: [S; 2],
    /// Softening force (N) now and one step before.
    softening: [S; 2],
    /// Demand (V) at constant force at the end of the last step.
    demand: S,
}

/// A predicted step, before the drive of the valve is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prediction<S> {
    plant: ActuatorState<S>,
    /// Load flow (m³/s) there, and its slope over the spool opening (m³/s per unit opening).
    flow: S,
    gain: S,
    /// Softening force (N) there, and whether it was ever nonzero.
    softening: S,
    softens: bool,
}

impl<S: Num> Exponential<S> {
    /// The true plants of `rig(0)`, `rig(1)`, … side by side, one per lane.
    ///
    /// # Errors
    /// A flow curve that the core refuses.
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig, grid: TimeGrid) -> Result<Self> {
        let cell_gain = |i| rig(i).plant().sensors.force.gain;
        let propagators = (0..S::LANES)
            .map(|i| {
                let plant = PlainPlant::<f64>::pack(&|_| rig(i))?;
                Ok(match rig(i).controller.realization {
                    Realization::Analog => {
                        let analog = Analog::pack(&|_| rig(i)).with_cell((cell_gain(i), 0.0));
                        Propagator::new(&plant, &analog, grid.step)
                    }
                    Realization::Digital => Propagator::new(&plant, &Held(0.0), grid.step),
                })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            plant: PlainPlant::pack(rig)?,
            propagator: Propagator::pack(|i| &propagators[i]),
            cell_gain: S::from_lanes(cell_gain),
            at_rest: [
                S::from_lanes(|i| rig(i).opening_at_rest(0)),
                S::from_lanes(|i| rig(i).null_command(0)),
            ],
        })
    }

    /// The state at rest.
    pub(crate) fn at_rest(&self) -> FastState<S> {
        let [spool, demand] = self.at_rest;
        let plant = ActuatorState { spool, ..ActuatorState::default() };
        let flow = [self.plant.flow_and_gain(&plant).0; 2];
        FastState { plant, history: History { flow, demand, ..History::default() } }
    }

    /// The valve command (V) that `drive` gives at the start of its interval.
    #[inline(always)]
    pub(crate) fn driven_command(&self, state: &FastState<S>, drive: &impl Drive<S>) -> S {
        self.plant.driven_command(&state.plant, state.history.flow[0], drive)
    }

    /// The state one tick later, from the prediction of its first step.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &FastState<S>,
        prediction: &Prediction<S>,
        drive: &impl Drive<S>,
        grid: TimeGrid,
    ) -> FastState<S> {
        if grid.steps == 1 {
            return self.step(state, prediction, drive, 0.0, grid.step);
        }
        let mut copies = (*state, *prediction, *drive);
        self.many_steps(&mut copies, grid);
        copies.0
    }

    /// The state one tick later by Runge–Kutta.
    #[inline(always)]
    pub(crate) fn advance_by_runge_kutta(
        &self,
        state: &FastState<S>,
        drive: &impl Drive<S>,
        grid: TimeGrid,
    ) -> FastState<S> {
        let plant = self.plant.advance(state.plant, drive, 0.0, 1.0 / grid.sample_rate, grid.steps);
        let history = History { flow: [self.plant.flow_and_gain(&plant).0; 2], ..state.history };
        FastState { plant, history }
    }

    /// Advances the state by all steps of a tick that has several.
    // A separate function, because beside a loop the values of a single step would not stay in registers.
    #[inline(never)]
    fn many_steps<D: Drive<S>>(&self, from: &mut (FastState<S>, Prediction<S>, D), grid: TimeGrid) {
        let (state, prediction, drive) = *from;
        from.0 = S::dispatch(ManySteps { integrator: self, state, prediction, drive, grid });
    }

    #[inline(always)]
    fn step(
        &self,
        state: &FastState<S>,
        prediction: &Prediction<S>,
        drive: &impl Drive<S>,
        from: f64,
        step: f64,
    ) -> FastState<S> {
        let mut next = self.correct(state, prediction, drive, from, step);
        let linear = self.is_linear([state, &next], drive, from, step);
        if !linear.all() {
            // Copies, because values behind a reference cannot stay in registers.
            let mut copies = (*state, *drive);
            self.step_by_runge_kutta(&mut copies, from, step);
            next = FastState::select(linear, next, copies.0);
        }
        next
    }

    /// The state one step ahead for a constant demand and an unchanged trend of the flow. This part of a step
    /// can be computed before the drive of the valve is known.
    #[inline(always)]
    pub(crate) fn predict(&self, state: &FastState<S>) -> Prediction<S> {
        let (p, m) = (&self.propagator, &state.history);
        let zero = S::splat(0.0);
        let change = |values: &[S; 2]| values[0] - values[1];
        let mut plant = ActuatorState::default()
            .plus(p.flow.constant, m.flow[0])
            .plus(p.flow.ramp, change(&m.flow))
            .plus(p.demand.constant, m.demand);
        for (number, column) in state.plant.to_array().into_iter().zip(&p.state) {
            plant = plant.plus(*column, number);
        }
        // In most of a test the motion is too small for softening, and this term is zero.
        let softens = !(m.softening[0].abs().le(zero) & m.softening[1].abs().le(zero)).all();
        if softens {
            let (constant, ramp) = (p.softening.constant, p.softening.ramp);
            plant = plant.plus(constant, m.softening[0]).plus(ramp, change(&m.softening));
        }
        let (flow, gain) = self.plant.flow_and_gain(&plant);
        Prediction { plant, flow, gain, softening: self.plant.softening_force(&plant), softens }
    }

    /// The corrected step, with the drive of the valve.
    #[inline(always)]
    fn correct(
        &self,
        state: &FastState<S>,
        prediction: &Prediction<S>,
        drive: &impl Drive<S>,
        from: f64,
        step: f64,
    ) -> FastState<S> {
        let (p, m) = (&self.propagator, &state.history);
        let zero = S::splat(0.0);
        let growth = drive.slope() * S::splat(step);
        let per_jump = prediction.gain * p.demand.constant.spool;
        let per_growth = prediction.gain * p.demand.ramp.spool;
        // Few operations depend on the jump, which is known last.
        let extrapolated = |values: &[S; 2]| values[0] + (values[0] - values[1]);
        let extrapolated_flow = extrapolated(&m.flow);
        let flow_change = (prediction.flow - extrapolated_flow).plus(per_growth, growth);
        let mut plant = prediction.plant.plus(p.demand.ramp, growth);
        if prediction.softens || !prediction.softening.abs().le(zero).all() {
            plant = plant.plus(p.softening.bend, prediction.softening - extrapolated(&m.softening));
        }

        let jump = drive.demand_difference(m.demand, S::splat(from));
        let flow_change = flow_change.plus(per_jump, jump);
        let history = History {
            flow: [extrapolated_flow + flow_change, m.flow[0]],
            softening: [prediction.softening, m.softening[0]],
            demand: m.demand + (jump + growth),
        };
        let plant = plant.plus(p.demand.constant, jump).plus(p.flow.bend, flow_change);
        FastState { plant, history }
    }

    /// Lanes in which the equations were linear over the whole step.
    #[inline(always)]
    fn is_linear(&self, ends: [&FastState<S>; 2], drive: &impl Drive<S>, from: f64, step: f64) -> S::Mask {
        let mut linear = drive.has_nominal_cell(self.cell_gain);
        for (end, time) in ends.into_iter().zip([from, from + step]) {
            linear = linear & end.plant.spool.abs().lt(S::splat(1.0));
            if drive.has_limit() {
                let demand = self.plant.driven_demand(&end.plant, end.history.flow[0], drive, S::splat(time));
                linear = linear & drive.is_unlimited(demand);
            }
        }
        linear
    }

    /// Advances the state by one Runge–Kutta step.
    #[cold]
    #[inline(never)]
    fn step_by_runge_kutta<D: Drive<S>>(&self, at: &mut (FastState<S>, D), from: f64, step: f64) {
        let (state, drive) = *at;
        at.0 = S::dispatch(RungeKuttaStep { integrator: self, state, drive, from, step });
    }
}

/// All steps of a tick that has several.
struct ManySteps<'a, S: Num, D> {
    integrator: &'a Exponential<S>,
    state: FastState<S>,
    prediction: Prediction<S>,
    drive: D,
    grid: TimeGrid,
}

impl<S: Num, D: Drive<S>> Work for ManySteps<'_, S, D> {
    type Output = FastState<S>;

    #[inline(always)]
    fn run(self) -> FastState<S> {
        let Self { integrator, mut state, mut prediction, drive, grid } = self;
        let step = grid.step;
        for n in 0..grid.steps {
            if n > 0 {
                prediction = integrator.predict(&state);
            }
            state = integrator.step(&state, &prediction, &drive, f64::from(n) * step, step);
        }
        state
    }
}

/// One step by Runge–Kutta.
struct RungeKuttaStep<'a, S: Num, D> {
    integrator: &'a Exponential<S>,
    state: FastState<S>,
    drive: D,
    from: f64,
    step: f64,
}

impl<S: Num, D: Drive<S>> Work for RungeKuttaStep<'_, S, D> {
    type Output = FastState<S>;

    #[inline(always)]
    fn run(self) -> FastState<S> {
        let Self { integrator, state, drive, from, step } = self;
        let before = Spool::at_stop(state.plant.spool);
        let (mut plant, mut open) = (state.plant, S::Mask::splat(true));
        for steps in [1, SUBSTEPS] {
            let advanced = integrator.plant.advance(state.plant, &drive, from, step, steps);
            plant = ActuatorState::select(open, advanced, plant);
            // Reaching or leaving a stop is a kink, at which a long step is inaccurate.
            let after = Spool::at_stop(plant.spool);
            open = (before | after) & !(before & after);
            if !open.any() {
                break;
            }
        }
        let zero = S::splat(0.0);
        let history = History {
            flow: [integrator.plant.flow_and_gain(&plant).0, state.history.flow[0]],
            softening: [integrator.plant.softening_force(&plant), state.history.softening[0]],
            demand: drive.demand(S::splat(from + step), zero, zero),
        };
        FastState { plant, history }
    }
}

impl<S: Num> FastState<S> {
    /// Every number of the state.
    pub(crate) fn numbers(&mut self) -> impl Iterator<Item = &mut S> {
        let ActuatorState { pilot_flow, spool, load_pressure, displacement, velocity } = &mut self.plant;
        let History { flow, softening, demand } = &mut self.history;
        let plant = [pilot_flow, spool, load_pressure, displacement, velocity];
        plant.into_iter().chain(flow).chain(softening).chain([demand])
    }

    // Field by field, because the compiler does not inline closures in code that it considers rare.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        let (a, b) = (yes.history, no.history);
        Self {
            plant: ActuatorState::select(mask, yes.plant, no.plant),
            history: History {
                flow: [S::select(mask, a.flow[0], b.flow[0]), S::select(mask, a.flow[1], b.flow[1])],
                softening: [
                    S::select(mask, a.softening[0], b.softening[0]),
                    S::select(mask, a.softening[1], b.softening[1]),
                ],
                demand: S::select(mask, a.demand, b.demand),
            },
        }
    }
}
