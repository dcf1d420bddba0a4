//! A whole test, from the first sample of the command to the last.

use std::iter;

use eft_core::{Cause, Scalar, status};

use crate::closed_loop::{
    BLOCK_TICKS, Block, ClosedLoop, ExternalController, FastLoop, GeneralLoop, Method, Precision, Specimen,
    TestRun, Width,
};
use crate::config::{RigConfig, StructureKind};
use crate::ground_motion::excitation::Command;
use crate::plant::{EnergyBalance, TimeGrid, longest_step, needs_detail};
use crate::{Error, Result, checks, interruption};

/// The default of the largest integration step (s). For the paper's tests the force then differs from the
/// converged solution by less than 1e-4 of its peak, at any sample rate.
pub const DEFAULT_STEP: f64 = 1.0 / 4096.0;

/// The largest integration step (s) of a converged run.
pub const CONVERGED_STEP: f64 = 1.0 / 65_536.0;

/// How a test is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulateOptions {
    /// Largest integration step (s); a tick is divided into equal steps no longer than this.
    pub largest_step: f64,
    /// The integration method.
    pub method: Method,
}

impl SimulateOptions {
    /// Settings of a converged run: Runge–Kutta steps of a sixteenth of the default step.
    pub const CONVERGED: Self = Self { largest_step: CONVERGED_STEP, method: Method::RungeKutta };

    /// Steps per tick at a sample rate (Hz).
    ///
    /// # Errors
    /// A step that is not positive and finite, or so small that a tick would need more than a million steps.
    pub(crate) fn steps(&self, sample_rate: f64) -> Result<u32> {
        let allowed = "must be positive, and no less than a millionth of the sample period";
        let sound = self.largest_step > 0.0 && self.largest_step.is_finite();
        checks::require(sound, "largest_step", self.largest_step, allowed)?;
        // By rounding, the quotient may be slightly above a whole number.
        let steps = (1.0 / (sample_rate * self.largest_step) - 1e-9).ceil().max(1.0);
        checks::require(steps <= 1e6, "largest_step", self.largest_step, allowed)?;
        Ok(steps as u32)
    }

    /// The ticks and integration steps for a rig, whose effects may need shorter steps.
    ///
    /// # Errors
    /// As [`steps`](Self::steps).
    pub(crate) fn grid(&self, rig: &RigConfig, sample_rate: f64) -> Result<TimeGrid> {
        let requested = self.steps(sample_rate)?;
        let required = Self { largest_step: longest_step(rig).min(self.largest_step), ..*self };
        Ok(TimeGrid::new(sample_rate, required.steps(sample_rate)?.max(requested)))
    }
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self { largest_step: DEFAULT_STEP, method: Method::Exponential }
    }
}

/// A test, with an external controller and an external structure if they replace the rig's own.
struct TestRequest<'a> {
    rig: &'a RigConfig,
    commands: &'a [Command],
    options: &'a SimulateOptions,
    controller: Option<ExternalController>,
    specimen: Option<Specimen>,
    /// Whether the digital side is the firmware's channel and learner.
    by_channel: bool,
}

impl<'a> TestRequest<'a> {
    fn new(rig: &'a RigConfig, commands: &'a [Command], options: &'a SimulateOptions) -> Self {
        Self { rig, commands, options, controller: None, specimen: None, by_channel: false }
    }
}

/// Whether to go on, from the ticks done and all.
type Progress<'a> = &'a mut dyn FnMut(usize, usize) -> bool;

/// Runs `command` on `rig` with the controller in the precision `P`. The digital side runs at the command's
/// sample rate.
///
/// `progress(done, total)` is called many times a second. If it returns `false`, the run ends with
/// [`Error::Interrupted`].
///
/// A run ends if its state grows beyond 1e100 or becomes NaN. Its last tick has the flag
/// [`status::DIVERGED`]. Every trace is finite, except lost measurements, which are NaN.
///
/// # Errors
/// An invalid command, an interruption, or a building, which needs one command per story.
pub fn simulate<P: Precision>(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    progress: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    one_actuator(rig)?;
    let commands = std::slice::from_ref(command);
    Ok(simulate_actuators::<P>(rig, commands, options, progress)?.swap_remove(0))
}

/// As [`simulate`], under one command per actuator. It returns one [`TestRun`] per actuator, the ground
/// floor's first. Each floor of a building has the rig's actuator and its own noise; all floors share the
/// supply. If the protection of one trips, the others trip at the next sample.
///
/// # Errors
/// As [`simulate`]; a wrong number of commands, or commands of different lengths or rates.
pub fn simulate_actuators<P: Precision>(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
    progress: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<TestRun>> {
    simulate_specimen::<P>(rig, commands, None, options, progress)
}

/// As [`simulate_actuators`], and an external structure may replace the rig's own. If it cannot continue, the
/// test ends as tripped, and [`TestRun::stopped`] has the reason.
///
/// # Errors
/// As [`simulate_actuators`].
pub fn simulate_specimen<P: Precision>(
    rig: &RigConfig,
    commands: &[Command],
    specimen: Option<Specimen>,
    options: &SimulateOptions,
    mut progress: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<TestRun>> {
    let request = TestRequest { specimen, ..TestRequest::new(rig, commands, options) };
    run_in_width(P::WIDTH, request, &mut progress)
}

/// As [`simulate`] in single precision, with an external controller instead of the rig's own, and optionally
/// an external structure.
pub(crate) fn simulate_controlled(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    controller: ExternalController,
    specimen: Option<Specimen>,
    mut progress: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    one_actuator(rig)?;
    let commands = std::slice::from_ref(command);
    let base = TestRequest::new(rig, commands, options);
    let request = TestRequest { controller: Some(controller), specimen, ..base };
    Ok(run_in_width(Width::Single, request, &mut progress)?.swap_remove(0))
}

// Inlined, so that a program with one precision contains one. The test in each is compiled here once.
#[inline(always)]
fn run_in_width(width: Width, request: TestRequest<'_>, progress: Progress<'_>) -> Result<Vec<TestRun>> {
    match width {
        Width::Single => run_in_single(request, progress),
        Width::Double => run_in_double(request, progress),
    }
}

fn run_in_single(request: TestRequest<'_>, progress: Progress<'_>) -> Result<Vec<TestRun>> {
    run_request::<f32>(request, progress)
}

fn run_in_double(request: TestRequest<'_>, progress: Progress<'_>) -> Result<Vec<TestRun>> {
    run_request::<f64>(request, progress)
}

/// A test of the paper's plant whose digital side is the channel and the learner of the firmware: what tests hold
/// the digital side of [`simulate`] to, which is written for several rigs side by side.
///
/// # Errors
/// As [`simulate`].
#[doc(hidden)]
pub fn simulate_by_channel(rig: &RigConfig, command: &Command, width: Width) -> Result<TestRun> {
    one_actuator(rig)?;
    let (commands, options) = (std::slice::from_ref(command), SimulateOptions::default());
    let request = TestRequest { by_channel: true, ..TestRequest::new(rig, commands, &options) };
    Ok(run_in_width(width, request, &mut |_, _| true)?.swap_remove(0))
}

/// The energy balance of such a test, for all actuators together.
///
/// # Errors
/// As [`simulate_actuators`].
pub fn energy_balance(
    rig: &RigConfig,
    commands: &[Command],
    options: &SimulateOptions,
) -> Result<EnergyBalance> {
    let (sample_rate, _) = check_commands(rig, commands)?;
    let grid = options.grid(rig, sample_rate)?;
    let mut test = GeneralLoop::<f64, f64>::new(&|_| rig, grid)?;
    run_test(&mut test, rig, grid, commands, &mut |_, _| true)?;
    Ok(test.balance(0).unwrap_or_default())
}

/// Refuses a building, which needs one command per story.
///
/// # Errors
/// The structure is a building.
pub(crate) fn one_actuator(rig: &RigConfig) -> Result<()> {
    let is_building = rig.structure.kind == StructureKind::ShearBuilding;
    let allowed = "must not be a building, which needs one command per story";
    checks::require(!is_building, "structure.kind", "\"shear_building\"", allowed)
}

/// Sample rate (Hz) and length of valid commands, one per actuator.
///
/// # Errors
/// An invalid command, a wrong number of commands, or commands of different lengths or rates.
pub(crate) fn check_commands(rig: &RigConfig, commands: &[Command]) -> Result<(f64, usize)> {
    let actuators = rig.structure.floors();
    let first = commands.first().filter(|_| commands.len() == actuators);
    let first = first.ok_or_else(|| Error::value("commands", commands.len(), one_each(actuators)))?;
    for command in commands {
        command.validate()?;
        let same = command.sample_rate == first.sample_rate && command.values.len() == first.values.len();
        let found = format!("{} samples at {} Hz", command.values.len(), command.sample_rate);
        let allowed = format!("must all have {} samples at {} Hz", first.values.len(), first.sample_rate);
        checks::require(same, "commands", found, allowed)?;
    }
    Ok((first.sample_rate, first.values.len()))
}

/// Refuses values other than one finite number for each actuator.
///
/// # Errors
/// A wrong number of values, or one that is not finite.
pub(crate) fn check_each(name: &str, unit: &str, values: &[f64], actuators: usize) -> Result<()> {
    if values.len() != actuators {
        return Err(Error::value(name, format!("{} values", values.len()), one_each(actuators)));
    }
    values.iter().try_for_each(|value| checks::finite(name, *value, unit))
}

/// The required number of values for a number of actuators, as a phrase for messages.
fn one_each(actuators: usize) -> String {
    let stories = if actuators == 1 { "story" } else { "stories" };
    format!("must be one for each of {actuators} {stories}")
}

/// Number of ticks of the soft end, and one at rest.
pub(crate) fn soft_end_ticks(rig: &RigConfig, sample_rate: f64) -> usize {
    ((rig.protection.ramp_time * sample_rate).ceil() as usize).saturating_add(1)
}

/// The tick at which the soft end begins.
pub(crate) fn soft_end(rig: &RigConfig, sample_rate: f64, total: usize) -> Option<usize> {
    let protection = &rig.protection;
    (protection.enabled && protection.soft_end)
        .then(|| total.saturating_sub(soft_end_ticks(rig, sample_rate)))
}

fn run_request<P: Precision>(request: TestRequest<'_>, progress: Progress<'_>) -> Result<Vec<TestRun>> {
    let TestRequest { rig, commands, options, controller, specimen, by_channel } = request;
    let (sample_rate, _) = check_commands(rig, commands)?;
    let grid = options.grid(rig, sample_rate)?;
    let detailed = needs_detail(rig) || commands.len() > 1;
    if !detailed && specimen.is_none() {
        let mut test = FastLoop::<f64, P::Lanes<f64>>::new(&|_| rig, grid, options.method)?;
        if let Some(controller) = controller {
            test.digital.set_external_controller(controller);
        }
        if by_channel {
            test.digital.set_channel(rig)?;
        }
        return run_test(&mut test, rig, grid, commands, progress);
    }
    let mut test = GeneralLoop::<f64, P::Lanes<f64>>::new(&|_| rig, grid)?;
    if let (Some(controller), Some(side)) = (controller, test.digital.first_mut()) {
        side.set_external_controller(controller);
    }
    if let Some(specimen) = specimen {
        test.set_external_structure(specimen);
    }
    run_test(&mut test, rig, grid, commands, progress)
}

/// Runs a loop through a test under checked commands.
fn run_test<C: Scalar<Element: Precision>>(
    test: &mut impl ClosedLoop<f64, C>,
    rig: &RigConfig,
    grid: TimeGrid,
    commands: &[Command],
    progress: Progress<'_>,
) -> Result<Vec<TestRun>> {
    let Command { values, sample_rate } = &commands[0];
    let (sample_rate, total) = (*sample_rate, values.len());
    let soft_end = soft_end(rig, sample_rate, total);
    let mut runs: Vec<_> = commands.iter().map(|_| TestRun::with_capacity(rig, sample_rate, total)).collect();
    let mut blocks: Vec<_> = commands.iter().map(|_| Block::<f64>::new(iter::once(rig))).collect();
    let mut start = 0;
    while start < total {
        if !progress(start, total) {
            return Err(Error::Interrupted);
        }
        interruption::check()?;
        if Some(start) == soft_end {
            test.end();
        }
        let end = soft_end.filter(|&end| end > start).unwrap_or(total);
        let ticks = BLOCK_TICKS.min(grid.ticks_per_check()).min(end - start);
        let values: Vec<_> = commands.iter().map(|command| &command.values[start..]).collect();
        let done = test.run(&values, ticks, &mut blocks);
        for (block, run) in blocks.iter().zip(&mut runs) {
            block.append_to(done, &mut [(0, &mut run.traces)]);
        }
        if done < ticks {
            if test.failure().is_none() {
                runs.iter_mut().for_each(|run| run.flag_end(status::DIVERGED));
            }
            break;
        }
        start += ticks;
    }
    if let Some(reason) = test.failure() {
        for run in &mut runs {
            run.stopped = Some(reason.to_owned());
            if run.status.last().is_some_and(|last| last & status::CAUSE == 0) {
                run.flag_end(status::TRIPPED | ((Cause::Request as u32) << status::CAUSE_SHIFT));
            }
        }
    }
    for (actuator, run) in runs.iter_mut().enumerate() {
        test.complete(run, actuator, 0);
    }
    progress(total, total);
    Ok(runs)
}
