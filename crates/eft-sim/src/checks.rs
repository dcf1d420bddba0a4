//! Argument checks of excitations, records, metrics and identifications.

use eft_core::Short;

use crate::{Error, Result};

/// Rejects a value that is not sound.
pub(crate) fn require(
    sound: bool,
    parameter: &str,
    value: impl ToString,
    allowed: impl Into<String>,
) -> Result<()> {
    if sound { Ok(()) } else { Err(Error::value(parameter, value, allowed)) }
}

/// Rejects a number that is not finite; `unit` is used in the message only.
pub(crate) fn finite(parameter: &str, value: f64, unit: &str) -> Result<()> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(Error::value(parameter, Short(value), format!("must be finite{}", in_unit(unit))))
    }
}

/// Rejects a number that is not positive and finite; `unit` is used in the message only.
pub(crate) fn positive(parameter: &str, value: f64, unit: &str) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(Error::value(parameter, Short(value), format!("must be positive and finite{}", in_unit(unit))))
    }
}

/// Rejects a sample rate (Hz) outside the range of real measurements, which could overflow.
pub(crate) fn sample_rate(parameter: &str, value: f64) -> Result<()> {
    within(parameter, value, 1e-6, 1e9, "Hz")
}

/// Rejects a value outside a range.
pub(crate) fn within(parameter: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<()> {
    let allowed = format!("must lie within {} and {} {unit}", Short(low), Short(high));
    require((low..=high).contains(&value), parameter, Short(value), allowed)
}

/// Rejects a signal that is empty or has a sample that is not finite.
pub(crate) fn signal(parameter: &str, values: &[f64]) -> Result<()> {
    require(!values.is_empty(), parameter, "no samples", "must have at least one")?;
    // Counting comes first, because the compiler vectorizes it.
    if values.iter().filter(|v| !v.is_finite()).count() == 0 {
        return Ok(());
    }
    let Some(i) = values.iter().position(|v| !v.is_finite()) else { return Ok(()) };
    let found = format!("{} at sample {i}", Short(values[i]));
    Err(Error::value(parameter, found, "every sample must be finite"))
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(", in {unit}") }
}

/// Rejects a band (Hz) that is not within half the sample rate (Hz).
pub(crate) fn band((low, high): (f64, f64), sample_rate: f64) -> Result<()> {
    let sound = low >= 0.0 && low < high && high <= 0.5 * sample_rate;
    let allowed =
        format!("must be two frequencies within 0 and {} Hz, the lower first", Short(0.5 * sample_rate));
    require(sound, "band", format!("({}, {})", Short(low), Short(high)), allowed)
}

/// Rejects a frequency (Hz) that is not within half the sample rate (Hz).
pub(crate) fn within_nyquist(parameter: &str, frequency: f64, rate: f64) -> Result<()> {
    sample_rate("sample_rate", rate)?;
    let nyquist = 0.5 * rate;
    let allowed = format!("must lie within 0 and half the sample rate, {} Hz", Short(nyquist));
    require((0.0..=nyquist).contains(&frequency), parameter, Short(frequency), allowed)
}
