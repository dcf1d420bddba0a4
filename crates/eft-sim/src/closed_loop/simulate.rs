//! A whole test, from the first sample of the command to the last.

use eft_core::{Mask, Scalar, status};

use crate::closed_loop::controller::Precision;
use crate::closed_loop::single::ClosedLoop;
use crate::closed_loop::test_run::TestRun;
use crate::config::{RigConfig, StructureKind};
use crate::error::{Error, Result};
use crate::excitation::Command;
use crate::rig::{DetailedPlant, EnergyBalance, Plant, PlantModel, longest_step, needs_detail};

/// The largest integration step by default (s): with it the force is within 1e-4 of its peak of the converged
/// answer for the paper's tests, at any sample rate.
pub const DEFAULT_STEP: f64 = 1.0 / 8192.0;

/// Ticks between two looks at whether to go on.
const CHUNK: usize = 4096;

/// How a test is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulateOptions {
    /// Largest integration step (s); a tick is cut into equal steps no longer than this.
    pub largest_step: f64,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self { largest_step: DEFAULT_STEP }
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

/// Runs `command` on `rig`, the controller in the precision `P`; the digital side runs at the command's sample rate.
///
/// `go_on(done, total)` is asked every few thousand ticks; when it says no, the run ends with
/// [`Error::Interrupted`].
///
/// A run whose state stops being finite ends there, its last tick flagged [`status::DIVERGED`].
///
/// # Errors
/// An invalid command or configuration, or an interruption.
pub fn simulate<P: Precision>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    rig.validate()?;
    one_actuator(rig)?;
    command.validate()?;
    if needs_detail(rig) {
        let (mut run, test) = run_through::<P, DetailedPlant<f64>>(rig, command, options, go_on)?;
        run.energy = Some(test.balance());
        Ok(run)
    } else {
        Ok(run_through::<P, Plant<f64>>(rig, command, options, go_on)?.0)
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
    rig.validate()?;
    one_actuator(rig)?;
    command.validate()?;
    let (_, test) = run_through::<f64, DetailedPlant<f64>>(rig, command, options, |_, _| true)?;
    Ok(test.balance())
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

/// The tick at which the soft end begins.
pub(crate) fn soft_end(rig: &RigConfig, sample_rate: f64, total: usize) -> Option<usize> {
    let protection = &rig.protection;
    let ramp = (protection.ramp_time * sample_rate).ceil() as usize;
    (protection.enabled && protection.soft_end).then(|| total.saturating_sub(ramp.saturating_add(1)))
}

fn run_through<P: Precision, M: PlantModel<f64>>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<(TestRun, ClosedLoop<f64, P, M>)> {
    let values = &command.values;
    let total = values.len();
    let asked = options.steps(command.sample_rate)?;
    let needed = SimulateOptions { largest_step: longest_step(rig).min(options.largest_step) };
    let steps = needed.steps(command.sample_rate)?.max(asked);
    let mut test = ClosedLoop::<f64, P, M>::new(|_| rig, command.sample_rate, steps)?;
    let soft_end = soft_end(rig, command.sample_rate, total);
    let mut run = TestRun::with_capacity(rig, command.sample_rate, total);
    for (i, &now) in values.iter().enumerate() {
        if i % CHUNK == 0 && !go_on(i, total) {
            return Err(Error::Interrupted);
        }
        let next = values.get(i + 1).copied().unwrap_or(now);
        if Some(i) == soft_end {
            test.end();
        }
        let tick = test.sample(now, next);
        if !tick.plant.magnitude().le(f64::MAX).all() {
            if let Some(last) = run.status.last_mut() {
                *last |= status::DIVERGED;
            }
            break;
        }
        run.push(&tick, 0, now);
        test.advance();
    }
    go_on(total, total);
    Ok((run, test))
}
