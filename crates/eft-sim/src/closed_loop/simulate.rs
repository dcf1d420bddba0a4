//! A whole test, from the first sample of the command to the last.

use eft_core::status;

use crate::closed_loop::chunk;
use crate::closed_loop::controller::Precision;
use crate::closed_loop::outside::Outside;
use crate::closed_loop::single::{ClosedLoop, LoopState};
use crate::closed_loop::test_run::TestRun;
use crate::config::{RigConfig, StructureKind};
use crate::error::{Error, Result};
use crate::excitation::Command;
use crate::rig::{
    DetailedPlant, EnergyBalance, Exponential, Pace, Plant, PlantModel, longest_step, needs_detail,
};

/// The largest integration step by default (s): with it the force is within 1e-4 of its peak of the converged
/// answer for the paper's tests, at any sample rate.
pub const DEFAULT_STEP: f64 = 1.0 / 4096.0;

/// The largest integration step (s) of a converged run.
pub const CONVERGED_STEP: f64 = 1.0 / 65_536.0;

/// Ticks between two looks at whether to go on.
const CHUNK: usize = 1024;

/// How the plant is carried from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The linear part exactly, the load flow once a step: two to three times the error of a Runge–Kutta step of
    /// the same length, from a quarter of its flow evaluations.
    Exponential,
    /// Classical Runge–Kutta of fourth order.
    RungeKutta,
}

/// How a test is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulateOptions {
    /// Largest integration step (s); a tick is cut into equal steps no longer than this.
    pub largest_step: f64,
    /// The integration method.
    pub method: Method,
}

impl SimulateOptions {
    /// A converged run: Runge–Kutta steps a sixteenth of the default step.
    pub const CONVERGED: Self = Self { largest_step: CONVERGED_STEP, method: Method::RungeKutta };
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self { largest_step: DEFAULT_STEP, method: Method::Exponential }
    }
}

impl SimulateOptions {
    /// Steps per tick at a sample rate (Hz).
    ///
    /// # Errors
    /// A step that is not positive and finite, or so small that a tick would take more than a million.
    pub(crate) fn steps(&self, sample_rate: f64) -> Result<u32> {
        let allowed = "must be positive, and no less than a millionth of the sample period";
        if !(self.largest_step > 0.0 && self.largest_step.is_finite()) {
            return Err(Error::value("largest_step", self.largest_step, allowed));
        }
        // The quotient of two rounded rates may lie a hair above a whole number.
        let steps = (1.0 / (sample_rate * self.largest_step) - 1e-9).ceil().max(1.0);
        if steps > 1e6 {
            return Err(Error::value("largest_step", self.largest_step, allowed));
        }
        Ok(steps as u32)
    }
}

impl SimulateOptions {
    /// How time is cut for a rig, whose effects may need shorter steps.
    ///
    /// # Errors
    /// As [`steps`](Self::steps).
    pub(crate) fn pace(&self, rig: &RigConfig, sample_rate: f64) -> Result<Pace> {
        let asked = self.steps(sample_rate)?;
        let needed = Self { largest_step: longest_step(rig).min(self.largest_step), ..*self };
        Ok(Pace::new(sample_rate, needed.steps(sample_rate)?.max(asked)))
    }
}

/// Runs `command` on `rig`, the controller in the precision `P`; the digital side runs at the command's sample rate.
///
/// `go_on(done, total)` is asked every few thousand ticks; when it says no, the run ends with
/// [`Error::Interrupted`].
///
/// A run whose state grows beyond 1e100, or stops being a number, ends there, its last tick flagged
/// [`status::DIVERGED`]: every trace is finite up to it.
///
/// # Errors
/// An invalid command, or an interruption.
pub fn simulate<P: Precision>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    P::test(rig, command, options, &mut go_on)
}

/// As [`simulate`]; a controller from outside, if there is one, takes the place of the rig's own.
pub(crate) fn simulate_controlled<P: Precision>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    outside: Option<Outside>,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    one_actuator(rig)?;
    command.validate()?;
    if needs_detail(rig) {
        let (mut run, test, state) =
            run_through::<P, DetailedPlant<f64>>(rig, command, options, outside, go_on)?;
        run.energy = Some(test.balance(&state));
        return Ok(run);
    }
    match options.method {
        Method::Exponential => {
            Ok(run_through::<P, Exponential<f64>>(rig, command, options, outside, go_on)?.0)
        }
        Method::RungeKutta => Ok(run_through::<P, Plant<f64>>(rig, command, options, outside, go_on)?.0),
    }
}

/// As [`simulate`], with the books of the energy: a rig without effects is run with them at nothing.
///
/// # Errors
/// As [`simulate`].
pub fn energy_balance(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
) -> Result<EnergyBalance> {
    one_actuator(rig)?;
    command.validate()?;
    let (_, test, state) = run_through::<f64, DetailedPlant<f64>>(rig, command, options, None, |_, _| true)?;
    Ok(test.balance(&state))
}

/// Refuses a building, which takes one command a story.
///
/// # Errors
/// A structure of that kind.
pub(crate) fn one_actuator(rig: &RigConfig) -> Result<()> {
    if rig.structure.kind != StructureKind::ShearBuilding {
        return Ok(());
    }
    let allowed = "must be of another kind for one command: a building takes one a story";
    Err(Error::value("structure.kind", "\"shear_building\"", allowed))
}

/// Ticks that the soft end takes, and one to be at rest in.
pub(crate) fn soft_end_ticks(rig: &RigConfig, sample_rate: f64) -> usize {
    ((rig.protection.ramp_time * sample_rate).ceil() as usize).saturating_add(1)
}

/// The tick at which the soft end begins.
pub(crate) fn soft_end(rig: &RigConfig, sample_rate: f64, total: usize) -> Option<usize> {
    let protection = &rig.protection;
    (protection.enabled && protection.soft_end)
        .then(|| total.saturating_sub(soft_end_ticks(rig, sample_rate)))
}

/// A test's traces, and how it was left.
type Finished<P, M> = (TestRun, ClosedLoop<f64, P, M>, LoopState<P, <M as PlantModel<f64>>::State>);

fn run_through<P: Precision, M: PlantModel<f64>>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    outside: Option<Outside>,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Finished<P, M>> {
    let total = command.values.len();
    let pace = options.pace(rig, command.sample_rate)?;
    let mut test = ClosedLoop::<f64, P, M>::new(|_| rig, pace)?;
    if let Some(outside) = outside {
        test.controlled_by(outside);
    }
    let mut state = test.at_rest();
    let soft_end = soft_end(rig, command.sample_rate, total);
    let mut run = TestRun::with_capacity(rig, command.sample_rate, total);
    let mut start = 0;
    while start < total {
        if !go_on(start, total) {
            return Err(Error::Interrupted);
        }
        if Some(start) == soft_end {
            test.end();
        }
        let end = soft_end.filter(|&end| end > start).unwrap_or(total);
        let ticks = CHUNK.min(end - start);
        let commands = &command.values[start..];
        let done = chunk::run(&mut test, &mut state, commands, ticks, run.extend(&commands[..ticks]));
        if done < ticks {
            run.truncate(start + done);
            if let Some(last) = run.status.last_mut() {
                *last |= status::DIVERGED;
            }
            break;
        }
        start += ticks;
    }
    run.learn(|openings| test.found_flows(openings, 0));
    go_on(total, total);
    Ok((run, test, state))
}
