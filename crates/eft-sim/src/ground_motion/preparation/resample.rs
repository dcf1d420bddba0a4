//! Resampling without aliasing.

use std::f64::consts::PI;

use crate::ground_motion::excitation::MAX_SAMPLES;
use crate::ground_motion::records::Record;
use crate::{Result, checks};

/// Zero crossings of the kernel on each side.
const CROSSINGS: f64 = 32.0;
/// The kernel's corner over the lower of the two half rates; the transition band is above it.
const CORNER: f64 = 0.93;

/// The record at another rate (Hz): a windowed sinc passes frequencies below both half rates and stops the
/// others.
///
/// # Errors
/// An invalid record, a rate that is not positive and finite, or more samples than a command may have.
pub fn resampled(record: &Record, rate: f64) -> Result<Record> {
    record.validate()?;
    checks::sample_rate("rate", rate)?;
    let own = 1.0 / record.dt;
    let last = record.acceleration.len() - 1;
    let samples = (last as f64 * rate / own + 1e-6).floor() + 1.0;
    let allowed = format!("must give at most {MAX_SAMPLES} samples");
    checks::require(samples <= MAX_SAMPLES as f64, "rate", rate, allowed)?;
    // Cycles per sample of the record at the corner, times two.
    let corner = CORNER * (rate / own).min(1.0);
    let reach = CROSSINGS / corner;
    let kernel = |distance: f64| {
        let x = PI * corner * distance;
        let sinc = if x.abs() < 1e-9 { 1.0 } else { libm::sin(x) / x };
        // Blackman: side lobes 74 dB down.
        let phase = PI * distance / reach;
        corner * sinc * (0.42 + 0.5 * libm::cos(phase) + 0.08 * libm::cos(2.0 * phase))
    };
    let value = |i: usize| {
        let position = i as f64 * own / rate;
        let from = (position - reach).ceil().max(0.0) as usize;
        let to = ((position + reach).floor() as usize).min(last);
        (from..=to).map(|k| record.acceleration[k] * kernel(position - k as f64)).sum()
    };
    Record::new(record.name.clone(), (0..samples as usize).map(value).collect(), 1.0 / rate)
}
