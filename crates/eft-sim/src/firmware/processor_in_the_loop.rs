//! A real or emulated processor runs the controller; this program runs the plant.

mod qemu;

use std::sync::{Arc, Mutex, PoisonError};

pub use crate::closed_loop::ExternalOutput;
use crate::closed_loop::{SimulateOptions, Specimen, TestRun, simulate_controlled};
use crate::config::{Realization, RigConfig};
use crate::firmware::export::exportable;
use crate::ground_motion::excitation::Command;
use crate::{Result, checks};
pub use qemu::run_in_qemu;

/// Runs `command` on the plant of `rig` with an external controller. The arguments of `tick` are the force
/// command (N), the readings of velocity (m/s), force (N), spool opening (1), displacement (m), supply
/// pressure (Pa) and acceleration (m/s²), and the next tick's command (N), each rounded to `f32`. Velocity
/// estimate, adaptation and protection are tasks of the controller. Everything else is as in
/// [`simulate`](crate::simulate): a controller with the answers of the rig's own in `f32` gives the traces of
/// `simulate::<f32>` bit for bit. The learned flows stay in the controller. An external structure may replace
/// the rig's own.
///
/// # Errors
/// An invalid command, an analog controller, a computation delay, a soft end, an error of `tick`, or an
/// interruption as in [`simulate`](crate::simulate).
pub fn run_with(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    mut tick: impl FnMut([f32; 8]) -> Result<ExternalOutput> + Send + 'static,
    specimen: Option<Specimen>,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    check(rig)?;
    let failure = Arc::new(Mutex::new(None));
    let seen = Arc::clone(&failure);
    let mut last = ExternalOutput::default();
    let outside = Box::new(move |signals| {
        let mut failure = seen.lock().unwrap_or_else(PoisonError::into_inner);
        // After a failure `tick` is not called again; the run ends at its next check.
        if failure.is_none() {
            match tick(signals) {
                Ok(answer) => last = answer,
                Err(error) => *failure = Some(error),
            }
        }
        last
    });
    let failed = || failure.lock().unwrap_or_else(PoisonError::into_inner).is_some();
    let run = simulate_controlled(rig, command, options, outside, specimen, |done, total| {
        !failed() && go_on(done, total)
    });
    match failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(error) => Err(error),
        None => run,
    }
}

/// Refuses a rig whose controller cannot run in firmware.
fn check(rig: &RigConfig) -> Result<()> {
    exportable(rig)?;
    let ends_softly = rig.protection.enabled && rig.protection.soft_end;
    let allowed = "must be false with the processor in the loop, which does not know the end";
    checks::require(!ends_softly, "protection.soft_end", true, allowed)?;
    let is_digital = rig.controller.realization == Realization::Digital;
    let allowed = "must be \"digital\" with the processor in the loop";
    checks::require(is_digital, "controller.realization", "\"analog\"", allowed)
}
