//! The step through time that tests run on: the linear part exactly, the load flow once a step.
//!
//! An exponential multistep method (predict, evaluate, correct). With the propagators of [`Propagator`] the linear
//! part costs no accuracy; load flow and softening enter as parabolas through their values at the step's ends and
//! one step before. The value ahead is taken at a state predicted without the jump that the demand makes at the
//! sample, and the jump is made good to first order afterwards. So the flow is evaluated once a step, beside the
//! controller instead of behind it.
//!
//! Steps that the method is not made for (spool at a stop, demand at its limit, a faulty load cell) are taken by
//! Runge–Kutta.

use eft_core::{Mask, Scalar};

use crate::config::{Realization, RigConfig};
use crate::dispatch::{Work, dispatch};
use crate::error::Result;
use crate::rig::drive::{Analog, Drive, Held};
use crate::rig::propagator::Propagator;
use crate::rig::{Num, Pace, Plant, PlantModel, PlantState};
use crate::sensors::Signals;

/// Runge–Kutta steps in place of one step of the method.
const SUBSTEPS: u32 = 2;

/// The plant with the method's coefficients, one rig or several side by side.
#[derive(Debug, Clone)]
pub(crate) struct Exponential<S: Num> {
    plant: Plant<S>,
    propagator: Propagator<S>,
}

/// The plant's state, and the memory of the method.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Carried<S> {
    plant: PlantState<S>,
    memory: Memory<S>,
}

/// What the method remembers of the steps before.
#[derive(Debug, Clone, Copy, Default)]
struct Memory<S> {
    /// Load flow (m³/s) now and one step before.
    flow: [S; 2],
    /// Softening force (N) now and one step before.
    softening: [S; 2],
    /// Demand (V) at constant force that the last step ended with.
    demand: S,
}

impl<S: Num> PlantModel<S> for Exponential<S> {
    type State = Carried<S>;
    const FAST: bool = true;

    fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig, pace: Pace) -> Result<Self> {
        let propagators = (0..S::LANES)
            .map(|i| {
                let plant = Plant::<f64>::pack(|_| rig(i))?;
                Ok(match rig(i).controller.realization {
                    Realization::Analog => Propagator::new(&plant, &Analog::pack(|_| rig(i)), pace.step()),
                    Realization::Digital => Propagator::new(&plant, &Held(0.0), pace.step()),
                })
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { plant: Plant::pack(&rig)?, propagator: Propagator::pack(|i| &propagators[i]) })
    }
    #[inline(always)]
    fn at_rest(&self) -> Carried<S> {
        Carried::default()
    }
    fn restarted(&self, state: Carried<S>, at: <S as Scalar>::Mask) -> Carried<S> {
        Carried::select(at, self.at_rest(), state)
    }
    #[inline(always)]
    fn core(state: &Carried<S>) -> &PlantState<S> {
        &state.plant
    }
    #[inline(always)]
    fn force(&self, state: &Carried<S>) -> S {
        self.plant.force(&state.plant)
    }
    #[inline(always)]
    fn signals(&self, state: &Carried<S>) -> Signals<S> {
        self.plant.signals(&state.plant)
    }
    #[inline(always)]
    fn at_limits(&self, state: &Carried<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        self.plant.at_limits(&state.plant)
    }
    #[inline(always)]
    fn driven_command(&self, state: &Carried<S>, drive: &impl Drive<S>) -> S {
        self.plant.driven_command(&state.plant, state.memory.flow[0], drive)
    }
    #[inline(always)]
    fn advance_driven(&self, mut state: Carried<S>, drive: &impl Drive<S>, pace: Pace) -> Carried<S> {
        let step = pace.step();
        for n in 0..pace.steps {
            let from = f64::from(n) * step;
            let next = self.propagate(&state, drive, from, step);
            let regular = self.is_regular([&state, &next], drive, from, step);
            state = if regular.all() {
                next
            } else {
                Carried::select(regular, next, self.fall_back(&state, drive, from, step))
            };
        }
        state
    }
}

impl<S: Num> Exponential<S> {
    #[inline(always)]
    fn propagate(&self, state: &Carried<S>, drive: &impl Drive<S>, from: f64, step: f64) -> Carried<S> {
        let (p, m) = (&self.propagator, &state.memory);
        let zero = S::splat(0.0);
        let growth = drive.slope() * S::splat(step);
        let change = |values: &[S; 2]| values[0] - values[1];
        let (flow_change, softening_change) = (change(&m.flow), change(&m.softening));

        let mut ahead = PlantState::default();
        for (number, column) in state.plant.to_array().into_iter().zip(&p.state) {
            ahead = ahead.after(*column, number);
        }
        ahead = ahead.after(p.flow.constant, m.flow[0]).after(p.flow.ramp, flow_change);
        ahead = ahead.after(p.demand.constant, m.demand).after(p.demand.ramp, growth);
        // Small motions leave the spring straight for most of a test, and then this is nothing.
        let soft = !(m.softening[0].abs().le(zero) & m.softening[1].abs().le(zero)).all();
        if soft {
            ahead =
                ahead.after(p.softening.constant, m.softening[0]).after(p.softening.ramp, softening_change);
        }

        let (flow_ahead, gain) = self.plant.flow_and_gain(&ahead);
        let softening = self.plant.softening_force(&ahead);

        let start = drive.demand(S::splat(from), zero, zero);
        let jump = start - m.demand;
        let flow = flow_ahead + gain * (p.demand.constant.spool * jump);
        let mut plant =
            ahead.after(p.flow.bend, flow - m.flow[0] - flow_change).after(p.demand.constant, jump);
        if soft || !softening.abs().le(zero).all() {
            plant = plant.after(p.softening.bend, softening - m.softening[0] - softening_change);
        }
        let memory = Memory {
            flow: [flow, m.flow[0]],
            softening: [softening, m.softening[0]],
            demand: start + growth,
        };
        Carried { plant, memory }
    }

    /// Where the equations were linear over the whole step.
    #[inline(always)]
    fn is_regular(&self, ends: [&Carried<S>; 2], drive: &impl Drive<S>, from: f64, step: f64) -> S::Mask {
        let mut regular = drive.is_sound();
        for (end, time) in ends.into_iter().zip([from, from + step]) {
            regular = regular & end.plant.spool.abs().lt(S::splat(1.0));
            if drive.limits() {
                let demand = self.plant.driven_demand(&end.plant, end.memory.flow[0], drive, S::splat(time));
                let limited = drive.limit(demand);
                regular = regular & limited.le(demand) & limited.ge(demand);
            }
        }
        regular
    }

    #[cold]
    #[inline(never)]
    fn fall_back<D: Drive<S>>(&self, state: &Carried<S>, drive: &D, from: f64, step: f64) -> Carried<S> {
        dispatch::<S, _>(FallBack { integrator: self, state, drive, from, step })
    }
}

/// One step by Runge–Kutta.
struct FallBack<'a, S: Num, D> {
    integrator: &'a Exponential<S>,
    state: &'a Carried<S>,
    drive: &'a D,
    from: f64,
    step: f64,
}

impl<S: Num, D: Drive<S>> Work for FallBack<'_, S, D> {
    type Output = Carried<S>;

    #[inline(always)]
    fn run(self) -> Carried<S> {
        let Self { integrator, state, drive, from, step } = self;
        let plant = integrator.plant.advance_driven(state.plant, drive, from, step, SUBSTEPS);
        let zero = S::splat(0.0);
        let memory = Memory {
            flow: [integrator.plant.flow_and_gain(&plant).0, state.memory.flow[0]],
            softening: [integrator.plant.softening_force(&plant), state.memory.softening[0]],
            demand: drive.demand(S::splat(from + step), zero, zero),
        };
        Carried { plant, memory }
    }
}

impl<S: Num> Carried<S> {
    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        let pair = |a: [S; 2], b: [S; 2]| [S::select(mask, a[0], b[0]), S::select(mask, a[1], b[1])];
        let (a, b) = (yes.memory, no.memory);
        Self {
            plant: PlantState::select(mask, yes.plant, no.plant),
            memory: Memory {
                flow: pair(a.flow, b.flow),
                softening: pair(a.softening, b.softening),
                demand: S::select(mask, a.demand, b.demand),
            },
        }
    }
}
