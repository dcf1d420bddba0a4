//! One tick of a closed loop, and what is kept of it.

use eft_core::{Scalar, status};

use crate::closed_loop::estimates::Estimates;
use crate::instruments::Signals;
use crate::lanes::Num;
use crate::plant::{ActuatorState, Driver};

/// What the digital side made of one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decision<S: Num> {
    /// What the sensors reported; the truth where they are ideal.
    pub(crate) measured: Signals<S>,
    pub(crate) valve_command: S,
    pub(crate) compensation: S,
    pub(crate) status: S::Flags,
    /// What drives the valve until the next tick.
    pub(crate) driver: Driver<S>,
}

/// The true state at one tick, before the tick's output acts, and what the digital side made of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick<S: Num> {
    pub(crate) command: S,
    pub(crate) plant: ActuatorState<S>,
    pub(crate) force: S,
    pub(crate) supply_pressure: S,
    pub(crate) acceleration: S,
    pub(crate) decision: Decision<S>,
    pub(crate) status: S::Flags,
}

impl<S: Num> Tick<S> {
    /// Of a command (N) and a force (N) on the structure, a spool that may be at a stop and a piston that may be beyond its stroke.
    #[inline(always)]
    pub(crate) fn new(
        command: S,
        plant: ActuatorState<S>,
        force: S,
        truth: &Signals<S>,
        (at_stop, beyond_stroke): (<S as Scalar>::Mask, <S as Scalar>::Mask),
        decision: Decision<S>,
    ) -> Self {
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Self {
            command,
            plant,
            force,
            supply_pressure: truth.supply_pressure,
            acceleration: truth.acceleration,
            status: decision.status | limits,
            decision,
        }
    }
}

/// Keeps what a test records of its ticks.
pub(crate) trait Recorder<S: Num> {
    /// Takes the `i`-th tick of a chunk, and what the learner has found by then.
    fn record(&mut self, i: usize, tick: &Tick<S>, estimates: &Estimates<S>);
}

impl<S: Num, K: Recorder<S>> Recorder<S> for Box<K> {
    #[inline(always)]
    fn record(&mut self, i: usize, tick: &Tick<S>, estimates: &Estimates<S>) {
        (**self).record(i, tick, estimates);
    }
}
