//! The effective force of a ground motion: the force that gives a mass on a fixed base the same relative
//! motion.

use super::{Command, within_memory};
use crate::ground_motion::records::Record;
use crate::{Result, checks};

/// The effective force `−mass·scale·a_g` in N, of a record resampled linearly to `sample_rate` in Hz.
///
/// `mass` in kg; `scale` is a factor on the acceleration. The last sample of the command is the last one
/// within the record.
///
/// # Errors
/// If the record is empty or not finite, `mass` is not positive and finite, the `sample_rate` or the record's
/// step is outside its range, `scale` is not finite, the force overflows, or the command would exceed
/// [`super::MAX_SAMPLES`].
pub fn effective_force(record: &Record, mass: f64, sample_rate: f64, scale: f64) -> Result<Command> {
    record.validate()?;
    checks::positive("mass", mass, "kg")?;
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::finite("scale", scale, "")?;
    let ag = &record.acceleration;
    let last = ag.len() - 1;
    let steps_per_sample = 1.0 / (record.dt * sample_rate);
    // The margin keeps the record's last point if the rates divide evenly apart from rounding.
    let samples = within_memory((last as f64 / steps_per_sample + 1e-6).floor() + 1.0)?;
    let factor = -mass * scale;
    let value = |i: usize| {
        let position = i as f64 * steps_per_sample;
        let left = (position as usize).min(last);
        let right = (left + 1).min(last);
        let weight = (position - left as f64).min(1.0);
        factor * (ag[left] + weight * (ag[right] - ag[left]))
    };
    let values: Vec<f64> = (0..samples).map(value).collect();
    let finite = values.iter().all(|v| v.is_finite());
    checks::require(finite, "mass·scale", mass * scale, "must keep the effective force finite")?;
    Ok(Command { values, sample_rate })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(acceleration: &[f64], dt: f64) -> Record {
        Record::new("test", acceleration.to_vec(), dt).unwrap()
    }

    #[test]
    fn force_opposes_the_ground_and_is_linear_between_points() {
        let command = effective_force(&record(&[0.0, 1.0, -1.0], 0.02), 10.0, 100.0, 2.0).unwrap();
        let expected = [0.0, -10.0, -20.0, 0.0, 20.0];
        assert_eq!(command.values.len(), expected.len());
        for (value, expected) in command.values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{value} instead of {expected}");
        }
    }

    #[test]
    fn the_records_own_rate_gives_its_own_points() {
        let points: Vec<f64> = (0..1000).map(|i| ((i * i) % 97) as f64 - 48.0).collect();
        for dt in [0.005, 0.01, 0.02, 1.0 / 3.0] {
            let command = effective_force(&record(&points, dt), 1.0, 1.0 / dt, -1.0).unwrap();
            assert_eq!(command.values.len(), points.len(), "dt = {dt}");
            assert!(command.values.iter().zip(&points).all(|(v, p)| (v - p).abs() < 1e-9));
        }
    }

    #[test]
    fn a_resampled_record_ends_within_its_duration() {
        let command = effective_force(&record(&[1.0; 5372], 0.01), 1.0, 4096.0, 1.0).unwrap();
        assert_eq!(command.values.len(), 219_997, "53.71 s × 4096 Hz = 219,996.2 periods");
        assert!(command.values.iter().all(|v| *v == -1.0));
    }

    #[test]
    fn bad_arguments_are_named() {
        let good = record(&[1.0, 2.0], 0.01);
        let text = |m, fs, s| effective_force(&good, m, fs, s).unwrap_err().to_string();
        assert!(text(0.0, 100.0, 1.0).starts_with("mass = 0"));
        assert!(text(1.0, f64::NAN, 1.0).starts_with("sample_rate = NaN"));
        assert!(text(1.0, 100.0, f64::INFINITY).starts_with("scale = inf"));
        assert!(text(f64::MAX, 100.0, 10.0).starts_with("mass·scale"));
        let long = effective_force(&record(&[1.0, 2.0], 1.0), 1.0, 1e9, 1.0).unwrap_err().to_string();
        assert!(long.starts_with("number of samples = 1.000000001e9"), "{long}");
        let spoilt = Record { name: String::new(), acceleration: vec![f64::NAN], dt: 0.01 };
        assert!(effective_force(&spoilt, 1.0, 100.0, 1.0).is_err());
    }
}
