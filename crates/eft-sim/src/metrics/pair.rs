//! The input checks of every metric.

use crate::checks;
use crate::error::{Error, Result};

/// Rejects a command and a measured signal for which the metrics are undefined.
pub(super) fn check(command: &[f64], measured: &[f64]) -> Result<()> {
    checks::signal("command", command)?;
    if measured.len() != command.len() {
        let allowed = format!("must have the command's {} samples", command.len());
        return Err(Error::value("measured", format!("{} samples", measured.len()), allowed));
    }
    checks::signal("measured", measured)?;
    not_silent(command)
}

/// Rejects a command of zeros, for which a relative error is undefined.
pub(super) fn not_silent(command: &[f64]) -> Result<()> {
    if command.iter().all(|c| *c == 0.0) {
        return Err(Error::value("command", "zero at every sample", "must differ from zero somewhere"));
    }
    Ok(())
}

/// Rejects a quotient outside the range of `f64` (the signals were too large or too small to square).
pub(super) fn in_range(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::value(
            name,
            value,
            "the signals are too large or too small to compare in double precision",
        ))
    }
}
