//! The input checks of every metric.

use crate::{Result, checks};

/// Rejects a command and a measured signal for which the metrics are undefined.
pub(super) fn check(command: &[f64], measured: &[f64]) -> Result<()> {
    checks::signal("command", command)?;
    same_length("measured", measured, command)?;
    checks::signal("measured", measured)?;
    not_silent(command)
}

/// Rejects a signal of another length than the command.
pub(super) fn same_length(name: &str, signal: &[f64], command: &[f64]) -> Result<()> {
    let allowed = format!("must have the command's {} samples", command.len());
    checks::require(signal.len() == command.len(), name, format!("{} samples", signal.len()), allowed)
}

/// Rejects a command of zeros, for which a relative error is undefined.
pub(super) fn not_silent(command: &[f64]) -> Result<()> {
    let moves = command.iter().any(|c| *c != 0.0);
    checks::require(moves, "command", "zero at every sample", "must differ from zero somewhere")
}

/// Rejects a quotient outside the range of `f64` (the signals were too large or too small to square).
pub(super) fn in_range(name: &str, value: f64) -> Result<f64> {
    let allowed = "the signals are too large or too small to compare in double precision";
    checks::require(value.is_finite(), name, value, allowed)?;
    Ok(value)
}
