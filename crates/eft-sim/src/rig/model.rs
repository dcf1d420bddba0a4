//! What the closed loop asks of a plant, whichever effects it has.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::drive::Drive;
use crate::rig::{Num, Plant, PlantState};
use crate::sensors::Signals;

/// How time is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Ticks per second (Hz).
    pub(crate) sample_rate: f64,
    /// Integration steps a tick.
    pub(crate) steps: u32,
    step: f64,
}

impl Pace {
    /// Ticks per second (Hz), and integration steps a tick.
    pub(crate) fn new(sample_rate: f64, steps: u32) -> Self {
        Self { sample_rate, steps, step: 1.0 / sample_rate / f64::from(steps) }
    }
    /// Length of a tick (s).
    #[inline(always)]
    pub(crate) fn period(&self) -> f64 {
        1.0 / self.sample_rate
    }
    /// Length of an integration step (s).
    #[inline(always)]
    pub(crate) fn step(&self) -> f64 {
        self.step
    }
}

/// One actuator and its structure, one rig or several side by side.
pub(crate) trait PlantModel<S: Num>: Sized {
    /// Everything that the plant remembers.
    type State: Copy;
    /// What of a tick's step can be computed before it is known what drives the valve.
    type Ahead: Copy;
    /// Whether a loop for plain rigs is compiled beside the one for all; it is where most tests run.
    const FAST: bool = false;

    /// The true plants of `rig(0)`, `rig(1)`, … side by side, one a lane.
    fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig, pace: Pace) -> Result<Self>;
    /// The state at rest.
    fn at_rest(&self) -> Self::State;
    /// The state at rest where the mask is true, as it was elsewhere.
    fn restarted(&self, state: Self::State, at: <S as Scalar>::Mask) -> Self::State;
    /// Valve, pressure and motion.
    fn core(state: &Self::State) -> &PlantState<S>;
    /// Force (N) on the structure.
    fn force(&self, state: &Self::State) -> S;
    /// What the sensors look at.
    fn signals(&self, state: &Self::State) -> Signals<S>;
    /// Where the spool stands at a stop, and where the piston is beyond its stroke.
    fn at_limits(&self, state: &Self::State) -> (<S as Scalar>::Mask, <S as Scalar>::Mask);
    /// The valve command (V) that `drive` gives at the start of its interval.
    fn driven_command(&self, state: &Self::State, drive: &impl Drive<S>) -> S;
    /// The first part of a tick's step.
    fn look_ahead(&self, state: &Self::State) -> Self::Ahead;
    /// The rest of it: the state one tick later.
    fn advance_driven(
        &self,
        state: Self::State,
        ahead: Self::Ahead,
        drive: &impl Drive<S>,
        pace: Pace,
    ) -> Self::State;
}

impl<S: Num> PlantModel<S> for Plant<S> {
    type State = PlantState<S>;
    type Ahead = ();

    fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig, _: Pace) -> Result<Self> {
        Self::pack(rig)
    }
    #[inline(always)]
    fn at_rest(&self) -> PlantState<S> {
        PlantState::default()
    }
    fn restarted(&self, state: PlantState<S>, at: <S as Scalar>::Mask) -> PlantState<S> {
        PlantState::select(at, self.at_rest(), state)
    }
    #[inline(always)]
    fn core(state: &PlantState<S>) -> &PlantState<S> {
        state
    }
    #[inline(always)]
    fn force(&self, state: &PlantState<S>) -> S {
        self.force(state)
    }
    #[inline(always)]
    fn signals(&self, state: &PlantState<S>) -> Signals<S> {
        Signals {
            displacement: state.displacement,
            velocity: state.velocity,
            force: self.force(state),
            spool: state.spool,
            supply_pressure: self.supply_pressure(),
            acceleration: self.acceleration(state),
        }
    }
    #[inline(always)]
    fn at_limits(&self, state: &PlantState<S>) -> (<S as Scalar>::Mask, <S as Scalar>::Mask) {
        self.at_limits(state)
    }
    #[inline(always)]
    fn driven_command(&self, state: &PlantState<S>, drive: &impl Drive<S>) -> S {
        self.driven_command(state, self.flow_and_gain(state).0, drive)
    }
    #[inline(always)]
    fn look_ahead(&self, _: &PlantState<S>) {}
    #[inline(always)]
    fn advance_driven(
        &self,
        state: PlantState<S>,
        _: (),
        drive: &impl Drive<S>,
        pace: Pace,
    ) -> PlantState<S> {
        self.advance_driven(state, drive, 0.0, pace.period(), pace.steps)
    }
}
