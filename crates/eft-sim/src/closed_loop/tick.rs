//! One tick of a closed loop, and its recording.

use eft_core::{Scalar, status};

use crate::closed_loop::EstimatesInUse;
use crate::lanes::Num;
use crate::plant::{ActuatorState, AnyDrive, Signals};

/// The result of the digital side at one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DigitalOutput<S: Num> {
    /// The sensors' readings; the true values if they are ideal.
    pub(crate) measured: Signals<S>,
    /// Zero where no trace is kept of it.
    pub(crate) valve_command: S,
    pub(crate) compensation: S,
    pub(crate) status: S::Flags,
    /// What drives the valve until the next tick.
    pub(crate) driver: AnyDrive<S>,
}

/// The true state at one tick, before the tick's output acts, and the result of the digital side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick<'a, S: Num> {
    pub(crate) command: S,
    pub(crate) plant: ActuatorState<S>,
    pub(crate) force: S,
    pub(crate) supply_pressure: S,
    pub(crate) acceleration: S,
    pub(crate) output: &'a DigitalOutput<S>,
    pub(crate) status: S::Flags,
}

impl<'a, S: Num> Tick<'a, S> {
    /// A tick from the command (N), the force (N) on the structure, and whether the spool is at a stop and
    /// the piston beyond its stroke.
    #[inline(always)]
    pub(crate) fn new(
        command: S,
        plant: ActuatorState<S>,
        force: S,
        truth: &Signals<S>,
        (at_stop, beyond_stroke): (<S as Scalar>::Mask, <S as Scalar>::Mask),
        output: &'a DigitalOutput<S>,
    ) -> Self {
        let limits = S::flag(at_stop, status::SPOOL_STOP) | S::flag(beyond_stroke, status::STROKE_EXCEEDED);
        Self {
            command,
            plant,
            force,
            supply_pressure: truth.supply_pressure,
            acceleration: truth.acceleration,
            status: output.status | limits,
            output,
        }
    }
}

/// Records the ticks of a test.
pub(crate) trait Recorder<S: Num> {
    /// Records the `i`-th tick of a chunk, and the learner's estimates at that tick.
    fn record(&mut self, i: usize, tick: &Tick<'_, S>, estimates: &EstimatesInUse<S>);
}

impl<S: Num, K: Recorder<S>> Recorder<S> for Box<K> {
    #[inline(always)]
    fn record(&mut self, i: usize, tick: &Tick<'_, S>, estimates: &EstimatesInUse<S>) {
        (**self).record(i, tick, estimates);
    }
}
