//! Plant and digital side of the paper's rig on the fast path, for one rig or several side by side.

use std::slice;

use eft_core::{ControllerState, Mask, Scalar};

use crate::closed_loop::digital_side::{DigitalSide, Feedback, SamplePath};
use crate::closed_loop::{ClosedLoop, DigitalOutput, Precision, Recorder, Tick};
use crate::lanes::{Num, Work};
use crate::plant::{AnyDrive, DriveKind, Exponential, FastState, Prediction, Signals, TimeGrid};
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
    method: Method,
    state: LoopState<S, C>,
}

/// Force and pressure of a plant in a state, as inputs of its drive.
struct FastFeedback<'a, S: Num> {
    plant: &'a Exponential<S>,
    state: &'a FastState<S>,
}

impl<S: Num> Feedback<S> for FastFeedback<'_, S> {
    #[inline(always)]
    fn command(&self, driver: &AnyDrive<S>) -> S {
        match driver.kind {
            DriveKind::Held => self.plant.driven_command(self.state, &driver.held),
            DriveKind::Analog => self.plant.driven_command(self.state, &driver.cell.analog),
            DriveKind::AnalogWithCell => self.plant.driven_command(self.state, &driver.cell),
        }
    }
}

/// The state of the loop, small enough for registers.
#[derive(Debug, Clone, Copy)]
struct LoopState<S, C: Scalar> {
    plant: FastState<S>,
    digital: ControllerState<C>,
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

    /// The true signals in a state. `IDEAL` must match the [`path`](DigitalSide::path).
    #[inline(always)]
    fn signals<const IDEAL: bool>(&self, state: &LoopState<S, C>) -> Signals<S> {
        let mut signals = self.plant.plant.signals(&state.plant.plant);
        if IDEAL {
            // Nothing reads it, because these rigs have no accelerometer.
            signals.acceleration = S::splat(0.0);
        }
        signals
    }

    /// Samples the true signals, and decides on the drive of the valve until the next tick. `next_command` is
    /// the command at that tick. `IDEAL` and `LEARNS` must match the [`path`](DigitalSide::path).
    #[inline(always)]
    fn sample<const IDEAL: bool, const LEARNS: bool>(
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
    fn tick<'a>(
        &self,
        state: &LoopState<S, C>,
        command: S,
        truth: &Signals<S>,
        output: &'a DigitalOutput<S>,
    ) -> Tick<'a, S> {
        let (blocks, plant) = (&self.plant.plant, &state.plant.plant);
        Tick::new(command, *plant, blocks.force(plant), truth, blocks.at_limits(plant), output)
    }

    /// Advances the plant to the next tick under the drive of the last sample.
    #[inline(always)]
    fn advance(&self, state: &mut LoopState<S, C>, prediction: &Prediction<S>, driver: &AnyDrive<S>) {
        let (plant, now, grid) = (&self.plant, &state.plant, self.grid);
        match driver.kind {
            DriveKind::Held => state.plant = plant.advance(now, prediction, &driver.held, grid),
            DriveKind::Analog => state.plant = plant.advance(now, prediction, &driver.cell.analog, grid),
            DriveKind::AnalogWithCell => state.plant = plant.advance(now, prediction, &driver.cell, grid),
        }
    }

    /// The same by Runge–Kutta.
    #[inline(always)]
    fn advance_by_runge_kutta(&self, state: &mut LoopState<S, C>, driver: &AnyDrive<S>) {
        let (plant, now, grid) = (&self.plant, &state.plant, self.grid);
        state.plant = match driver.kind {
            DriveKind::Held => plant.advance_by_runge_kutta(now, &driver.held, grid),
            DriveKind::Analog => plant.advance_by_runge_kutta(now, &driver.cell.analog, grid),
            DriveKind::AnalogWithCell => plant.advance_by_runge_kutta(now, &driver.cell, grid),
        };
    }
}

impl<S: Num, C: Scalar<Element: Precision>> ClosedLoop<S, C> for FastLoop<S, C> {
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize {
        let path = match self.method {
            Method::RungeKutta => SamplePath::General,
            Method::Exponential => self.digital.path(),
        };
        let (Some(commands), Some(recorder)) = (commands.first(), recorders.first_mut()) else { return 0 };
        match path {
            SamplePath::Ideal => {
                S::dispatch(FastTicks::<S, C, _, true, false> { test: self, commands, ticks, recorder })
            }
            SamplePath::IdealLearning => {
                S::dispatch(FastTicks::<S, C, _, true, true> { test: self, commands, ticks, recorder })
            }
            SamplePath::General => {
                S::dispatch(FastTicks::<S, C, _, false, false> { test: self, commands, ticks, recorder })
            }
        }
    }
    fn is_bounded(&self) -> S::Mask {
        self.state.plant.plant.is_bounded()
    }
    fn restart(&mut self, at: S::Mask) {
        let state = &mut self.state.plant;
        *state = FastState::select(at, FastState::default(), *state);
    }
    fn digital_sides(&mut self) -> &mut [DigitalSide<S, C>] {
        slice::from_mut(&mut self.digital)
    }
}

/// Some ticks of a test.
struct FastTicks<'a, S: Num, C: Scalar<Element: Precision>, K, const IDEAL: bool, const LEARNS: bool> {
    test: &'a mut FastLoop<S, C>,
    commands: &'a [S],
    ticks: usize,
    recorder: &'a mut K,
}

impl<S: Num, C: Scalar<Element: Precision>, K: Recorder<S>, const IDEAL: bool, const LEARNS: bool> Work
    for FastTicks<'_, S, C, K, IDEAL, LEARNS>
{
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let mut state = self.test.state;
        let mut done = 0;
        while done < self.ticks && state.plant.plant.is_bounded().all() {
            let command = self.commands[done];
            let next = self.commands.get(done + 1).copied().unwrap_or(command);
            let by_runge_kutta = !IDEAL && self.test.method == Method::RungeKutta;
            let mut prediction = None;
            if S::LANES == 1 && !by_runge_kutta {
                // Only a short chain of operations waits for the controller's root and division; the other
                // work runs meanwhile.
                prediction = Some(self.test.plant.predict(&state.plant));
            }
            let truth = self.test.signals::<IDEAL>(&state);
            let output = self.test.sample::<IDEAL, LEARNS>(&mut state, [command, next], &truth);
            let tick = self.test.tick(&state, command, &truth, &output);
            self.recorder.record(done, &tick, self.test.digital.estimates());
            if by_runge_kutta {
                self.test.advance_by_runge_kutta(&mut state, &output.driver);
            } else {
                // Several rigs side by side fill that time anyway; in this order they need fewer registers.
                let prediction = match prediction {
                    Some(prediction) => prediction,
                    None => self.test.plant.predict(&state.plant),
                };
                self.test.advance(&mut state, &prediction, &output.driver);
            }
            done += 1;
        }
        self.test.state = state;
        done
    }
}
