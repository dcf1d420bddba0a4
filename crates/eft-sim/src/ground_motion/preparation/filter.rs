//! Zero-phase band-pass: a Butterworth filter run forwards and backwards.

use crate::fourier::{padded_spectrum, signal_of};
use crate::ground_motion::records::Record;
use crate::{Result, checks};

/// Largest number of zeros appended to a record. More would take seconds, for a corner far below the
/// frequencies of any record.
const MOST_ZEROS: f64 = 1e7;

/// The record filtered to `low` to `high` (Hz) by a Butterworth filter of an order, applied forwards and
/// backwards. The phase is unchanged, and the gain is 1/2 at the corners.
///
/// # Errors
/// An invalid record, corners that are not ordered within 0 and half its rate, a lower corner below two millionths of its
/// rate, an order outside 1 to 10.
pub fn band_passed(record: &Record, low: f64, high: f64, order: i32) -> Result<Record> {
    record.validate()?;
    let nyquist = 0.5 / record.dt;
    let allowed = format!("must be two frequencies between 0 and {nyquist} Hz, the lower first");
    checks::require(low > 0.0 && low < high && high < nyquist, "band", format!("({low}, {high})"), allowed)?;
    checks::require((1..=10).contains(&order), "order", order, "must be from 1 to 10")?;
    // Zeros after the record hold the decay of the filter, so that it does not wrap around to the start.
    let zeros = 20.0 / (low * record.dt);
    let allowed = format!("must begin at {} Hz or above", 20.0 / (MOST_ZEROS * record.dt));
    checks::require(zeros <= MOST_ZEROS, "band", format!("({low}, {high})"), allowed)?;
    let count = record.acceleration.len();
    let length = (count + zeros as usize + count).next_power_of_two();
    let mut spectrum = padded_spectrum(&record.acceleration, length)?;
    let width = 1.0 / (length as f64 * record.dt);
    for (k, bin) in spectrum.iter_mut().enumerate() {
        let frequency = k as f64 * width;
        let below = if k == 0 { 0.0 } else { 1.0 / (1.0 + (low / frequency).powi(2 * order)) };
        let above = 1.0 / (1.0 + (frequency / high).powi(2 * order));
        *bin *= below * above / length as f64;
    }
    let mut signal = signal_of(spectrum, length)?;
    signal.truncate(count);
    Record::new(record.name.clone(), signal, record.dt)
}
