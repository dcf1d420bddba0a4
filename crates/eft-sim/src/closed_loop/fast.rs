//! Plant and digital side of the paper's rig on the fast path, one tick at a time.

use eft_core::{ControllerState, Scalar};

use crate::closed_loop::{DigitalOutput, DigitalSide, Feedback, InUse, Precision, Tick};
use crate::lanes::Num;
use crate::plant::{Driver, DriverKind, Exponential, FastState, Prediction, Signals, TimeGrid};
use crate::{Result, RigConfig};

/// The integration method of the plant between ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Integrates the linear part exactly and evaluates the load flow once per step. Compared with a
    /// Runge–Kutta step of the same length it has two to three times the error and a quarter of the flow
    /// evaluations.
    Exponential,
    /// The classical Runge–Kutta method of fourth order.
    RungeKutta,
}

/// The sampled closed loop of one rig, or of several side by side; `C` is the controller's number.
pub(crate) struct FastLoop<S: Num, C: Scalar<Element: Precision>> {
    plant: Exponential<S>,
    /// Sensors and controller.
    pub(super) digital: DigitalSide<S, C>,
    grid: TimeGrid,
    /// The integration method between ticks.
    pub(super) method: Method,
    pub(super) state: LoopState<S, C>,
}

/// Force and pressure of a plant in a state, as inputs of its drive.
struct FastFeedback<'a, S: Num> {
    plant: &'a Exponential<S>,
    state: &'a FastState<S>,
}

impl<S: Num> Feedback<S> for FastFeedback<'_, S> {
    #[inline(always)]
    fn command(&self, driver: &Driver<S>) -> S {
        match driver.kind {
            DriverKind::Held => self.plant.driven_command(self.state, &driver.held),
            DriverKind::Analog => self.plant.driven_command(self.state, &driver.cell.analog),
            DriverKind::ThroughCell => self.plant.driven_command(self.state, &driver.cell),
        }
    }
}

/// The state of the loop, small enough for registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoopState<S, C: Scalar> {
    plant: FastState<S>,
    digital: ControllerState<C>,
}

impl<S: Num, C: Scalar> LoopState<S, C> {
    /// Where the plant's state is finite and bounded.
    #[inline(always)]
    pub(crate) fn is_bounded(&self) -> S::Mask {
        self.plant.plant.is_bounded()
    }

    /// Puts the plants back to rest where the mask is true.
    pub(super) fn restart(&mut self, at: S::Mask) {
        self.plant = FastState::select(at, FastState::default(), self.plant);
    }
}

impl<S: Num, C: Scalar<Element: Precision>> FastLoop<S, C> {
    /// The loops of `rig(0)`, `rig(1)`, … at rest, one per lane, all with the same realization.
    pub(crate) fn new<'a>(
        rig: &dyn Fn(usize) -> &'a RigConfig,
        grid: TimeGrid,
        method: Method,
    ) -> Result<Self> {
        let plant = Exponential::pack(rig, grid)?;
        let digital = DigitalSide::new(&rig, grid.sample_rate, 0)?;
        let state = LoopState { plant: plant.at_rest(), digital: digital.at_rest() };
        Ok(Self { plant, digital, grid, method, state })
    }

    /// The same loop for metrics alone.
    pub(crate) fn without_traces(self) -> Self {
        Self { digital: self.digital.without_traces(), ..self }
    }

    /// The learners' estimates at the last sample.
    #[inline(always)]
    pub(crate) fn estimates(&self) -> &InUse<S> {
        self.digital.estimates()
    }

    /// The true signals in a state. `IDEAL` must match the [`path`](Self::path).
    #[inline(always)]
    pub(crate) fn signals<const IDEAL: bool>(&self, state: &LoopState<S, C>) -> Signals<S> {
        let mut signals = self.plant.plant.signals(&state.plant.plant);
        if IDEAL {
            // Nothing reads it, because these rigs have no accelerometer.
            signals.acceleration = S::splat(0.0);
        }
        signals
    }

    /// Samples the true signals, and decides on the drive of the valve until the next tick. `next_command` is
    /// the command at that tick. `IDEAL` and `LEARNS` must match the [`path`](Self::path).
    #[inline(always)]
    pub(crate) fn sample<const IDEAL: bool, const LEARNS: bool>(
        &mut self,
        state: &mut LoopState<S, C>,
        [command, next_command]: [S; 2],
        truth: &Signals<S>,
    ) -> DigitalOutput<S> {
        let feedback = FastFeedback { plant: &self.plant, state: &state.plant };
        self.digital.sample::<IDEAL, LEARNS>(&mut state.digital, command, next_command, truth, &feedback)
    }

    /// The tick of a sample.
    #[inline(always)]
    pub(crate) fn tick<'a>(
        &self,
        state: &LoopState<S, C>,
        command: S,
        truth: &Signals<S>,
        output: &'a DigitalOutput<S>,
    ) -> Tick<'a, S> {
        let (blocks, plant) = (&self.plant.plant, &state.plant.plant);
        Tick::new(command, *plant, blocks.force(plant), truth, blocks.at_limits(plant), output)
    }

    /// The part of the step to the next tick that does not depend on the sample.
    #[inline(always)]
    pub(crate) fn look_ahead(&self, state: &LoopState<S, C>) -> Prediction<S> {
        self.plant.predict(&state.plant)
    }

    /// Advances the plant to the next tick under the drive of the last sample.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut LoopState<S, C>, ahead: &Prediction<S>, driver: &Driver<S>) {
        let (plant, now, grid) = (&self.plant, &state.plant, self.grid);
        match driver.kind {
            DriverKind::Held => state.plant = plant.advance(now, ahead, &driver.held, grid),
            DriverKind::Analog => state.plant = plant.advance(now, ahead, &driver.cell.analog, grid),
            DriverKind::ThroughCell => state.plant = plant.advance(now, ahead, &driver.cell, grid),
        }
    }

    /// The same by Runge–Kutta.
    #[inline(always)]
    pub(crate) fn advance_by_runge_kutta(&self, state: &mut LoopState<S, C>, driver: &Driver<S>) {
        let (plant, now, grid) = (&self.plant, &state.plant, self.grid);
        state.plant = match driver.kind {
            DriverKind::Held => plant.advance_by_runge_kutta(now, &driver.held, grid),
            DriverKind::Analog => plant.advance_by_runge_kutta(now, &driver.cell.analog, grid),
            DriverKind::ThroughCell => plant.advance_by_runge_kutta(now, &driver.cell, grid),
        };
    }
}
