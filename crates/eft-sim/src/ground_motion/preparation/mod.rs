//! Preparation of records for a test; every function returns a new record.

mod filter;
mod resample;

pub use filter::band_passed;
pub use resample::resampled;

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use crate::ground_motion::records::Record;
use crate::{Error, Result, checks};

/// The record minus the polynomial of a degree that fits its acceleration best: an offset (0), a drift (1), …
///
/// # Errors
/// An invalid record; a degree above 5 or not below the number of points.
pub fn baseline_corrected(record: &Record, degree: usize) -> Result<Record> {
    record.validate()?;
    let count = record.acceleration.len();
    let allowed = "must be at most 5, and below the number of points";
    checks::require(degree <= 5 && degree < count, "degree", degree, allowed)?;
    let time = |i: usize| 2.0 * i as f64 / (count.max(2) - 1) as f64 - 1.0;
    let row =
        |i: usize| DVector::from_iterator(degree + 1, (0..=degree).map(|power| time(i).powi(power as i32)));
    let (mut normal, mut right) = (DMatrix::zeros(degree + 1, degree + 1), DVector::zeros(degree + 1));
    for (i, value) in record.acceleration.iter().enumerate() {
        let row = row(i);
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(*value, &row, 1.0);
    }
    let Some(factor) = normal.cholesky() else {
        return Err(Error::value("degree", degree, "must be lower for a record this short"));
    };
    let fitted = factor.solve(&right);
    let values =
        record.acceleration.iter().enumerate().map(|(i, value)| value - row(i).dot(&fitted)).collect();
    Record::new(record.name.clone(), values, record.dt)
}

/// The record with its acceleration and its time multiplied by factors (1).
///
/// A model at the length scale `S` with unchanged accelerations has the time factor `√S`.
///
/// # Errors
/// An invalid record; factors that are not finite, or a time factor that is not positive.
pub fn scaled(record: &Record, acceleration: f64, time: f64) -> Result<Record> {
    record.validate()?;
    checks::finite("acceleration", acceleration, "")?;
    checks::positive("time", time, "")?;
    let values = record.acceleration.iter().map(|value| acceleration * value).collect();
    Record::new(record.name.clone(), values, record.dt * time)
}

/// The record faded in over `start` and out over `end` (s) by raised cosines.
///
/// # Errors
/// An invalid record; lengths that are negative or together longer than it.
pub fn tapered(record: &Record, start: f64, end: f64) -> Result<Record> {
    record.validate()?;
    let last = record.acceleration.len() - 1;
    let duration = last as f64 * record.dt;
    for (name, length) in [("start", start), ("end", end)] {
        let allowed = format!("must not be negative; both together not longer than the record, {duration} s");
        checks::require(length >= 0.0 && start + end <= duration, name, length, allowed)?;
    }
    let fade =
        |time: f64, length: f64| if time < length { 0.5 - 0.5 * libm::cos(PI * time / length) } else { 1.0 };
    let weight = |i: usize| fade(i as f64 * record.dt, start) * fade((last - i) as f64 * record.dt, end);
    let values = record.acceleration.iter().enumerate().map(|(i, value)| value * weight(i)).collect();
    Record::new(record.name.clone(), values, record.dt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn sine(frequency: f64, dt: f64, count: usize) -> Record {
        let values = (0..count).map(|i| (TAU * frequency * i as f64 * dt).sin()).collect();
        Record::new("sine", values, dt).unwrap()
    }

    /// Largest difference of the middle half from a sine of an amplitude.
    fn off(record: &Record, frequency: f64, amplitude: f64) -> f64 {
        let count = record.acceleration.len();
        (count / 4..3 * count / 4)
            .map(|i| {
                (record.acceleration[i] - amplitude * (TAU * frequency * i as f64 * record.dt).sin()).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_polynomial_baseline_is_removed() {
        let mut record = sine(2.0, 0.01, 4000);
        let pure = record.clone();
        record.acceleration.iter_mut().enumerate().for_each(|(i, v)| *v += 0.3 - 1e-4 * i as f64);
        let corrected = baseline_corrected(&record, 1).unwrap();
        let worst = corrected
            .acceleration
            .iter()
            .zip(&pure.acceleration)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst}");
        assert!(baseline_corrected(&record, 6).is_err());
    }

    #[test]
    fn a_band_pass_keeps_only_its_band() {
        let passed = |frequency| band_passed(&sine(frequency, 0.01, 8000), 0.5, 20.0, 4).unwrap();
        assert!(off(&passed(3.0), 3.0, 1.0) < 2e-3);
        // Butterworth both ways: |H|² is 1/2 at the corners.
        assert!(off(&passed(0.5), 0.5, 0.5) < 0.01);
        assert!(off(&passed(20.0), 20.0, 0.5) < 0.01);
        assert!(off(&passed(0.05), 0.05, 0.0) < 0.01);
        assert!(off(&passed(45.0), 45.0, 0.0) < 0.01);
        for (low, high) in [(0.0, 20.0), (5.0, 2.0), (1.0, 50.0)] {
            assert!(band_passed(&sine(1.0, 0.01, 100), low, high, 4).is_err());
        }
    }

    #[test]
    fn resampling_keeps_the_band_without_aliasing() {
        for rate in [37.0, 100.0, 256.0] {
            let kept = resampled(&sine(5.0, 0.005, 8000), rate).unwrap();
            assert!((kept.dt - 1.0 / rate).abs() < 1e-15);
            assert!(off(&kept, 5.0, 1.0) < 2e-3, "{rate}: {}", off(&kept, 5.0, 1.0));
        }
        let folded = resampled(&sine(45.0, 0.005, 8000), 50.0).unwrap();
        assert!(off(&folded, 5.0, 0.0) < 2e-3, "45 Hz sampled at 50 Hz would look like 5 Hz");
    }

    #[test]
    fn scaling_and_taper() {
        let record = scaled(&sine(2.0, 0.01, 1000), 3.0, 0.5).unwrap();
        assert!(off(&record, 4.0, 3.0) < 1e-10 && record.dt == 0.005);
        let faded = tapered(&record, 1.0, 2.0).unwrap();
        assert_eq!((faded.acceleration[0], faded.acceleration[999]), (0.0, 0.0));
        assert_eq!(faded.acceleration[300], record.acceleration[300]);
        assert!((faded.acceleration[100] - 0.5 * record.acceleration[100]).abs() < 1e-12);
        assert!(tapered(&record, 4.0, 2.0).is_err() && scaled(&record, 1.0, 0.0).is_err());
    }
}
