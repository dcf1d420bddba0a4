//! Response spectra of ground motions.

use std::f64::consts::TAU;

use crate::ground_motion::records::Record;
use crate::{Result, checks, interruption};

/// Least steps per period. With fewer, a peak between two steps could be underestimated by more than 0.5 %.
const STEPS_PER_PERIOD: f64 = 40.0;

/// The largest relative displacement (m) of oscillators of given periods (s) and damping ratio (1) on the ground motion.
///
/// The oscillator is integrated exactly for a ground acceleration that is linear between its points. The
/// displacement times `ω²` is the pseudo-acceleration.
///
/// # Errors
/// An invalid record. A period that is not positive and finite, is less than a 2500th of the record's step,
/// or needs more than 1e7 steps for half of it. A damping outside 0 to 0.99.
pub fn displacement_spectrum(record: &Record, periods: &[f64], damping: f64) -> Result<Vec<f64>> {
    record.validate()?;
    checks::require((0.0..=0.99).contains(&damping), "damping", damping, "must be a ratio from 0 to 0.99")?;
    periods.iter().map(|period| peak(record, *period, damping)).collect()
}

fn peak(record: &Record, period: f64, zeta: f64) -> Result<f64> {
    checks::positive("period", period, "s")?;
    let omega = TAU / period;
    let parts = (record.dt * STEPS_PER_PERIOD / period).ceil().max(1.0);
    checks::require(parts <= 1e5, "period", period, "must not be that short against the record's step")?;
    let step = record.dt / parts;
    let half_period = (0.5 * period / step).ceil() + 1.0;
    checks::require(half_period <= 1e7, "period", period, "must not be that long against the record's step")?;
    let root = (1.0 - zeta * zeta).sqrt();
    let (sin, cos) = libm::sincos(omega * root * step);
    let decay = libm::exp(-zeta * omega * step);
    // One step of u'' + 2ζω·u' + ω²·u = p0 + (p1 − p0)·t/h: a linear particular solution plus a free
    // vibration.
    let advance = |u: f64, v: f64, p0: f64, p1: f64| {
        let slope = (p1 - p0) / step / (omega * omega);
        let offset = p0 / (omega * omega) - 2.0 * zeta / omega * slope;
        let (a, b) = (u - offset, (v - slope + zeta * omega * (u - offset)) / (omega * root));
        let wave = decay * (a * cos + b * sin);
        let turned = decay * (b * cos - a * sin);
        (wave + offset + slope * step, -zeta * omega * wave + omega * root * turned + slope)
    };
    let (mut u, mut v, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (i, pair) in record.acceleration.windows(2).enumerate() {
        if i.is_multiple_of(1024) {
            interruption::check()?;
        }
        let rise = (pair[1] - pair[0]) / parts;
        for part in 0..parts as usize {
            let from = pair[0] + rise * part as f64;
            (u, v) = advance(u, v, -from, -(from + rise));
            largest = largest.max(u.abs());
        }
    }
    // The oscillator continues to move after the ground has come to rest.
    for _ in 0..half_period as usize {
        (u, v) = advance(u, v, 0.0, 0.0);
        largest = largest.max(u.abs());
    }
    checks::require(largest.is_finite(), "record", "too large", "must keep the response finite")?;
    Ok(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_acceleration_gives_the_overshoot_of_the_textbook() {
        // Under constant acceleration the peak is (1 + e^(−πζ/√(1−ζ²)))·a/ω².
        let record = Record::new("step", vec![1.0; 2000], 0.01).unwrap();
        for zeta in [0.0_f64, 0.05, 0.2] {
            let omega = TAU / 0.8;
            let overshoot = (-std::f64::consts::PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
            let found = displacement_spectrum(&record, &[0.8], zeta).unwrap()[0];
            // The undamped oscillator continues to move after the ground stops.
            let expected = (1.0 + overshoot) / (omega * omega);
            let most = if zeta == 0.0 { 2.0 * expected } else { expected };
            assert!(found > 0.998 * expected && found < 1.002 * most, "{zeta}: {found}, {expected}");
        }
    }

    #[test]
    fn very_stiff_and_very_soft_oscillators_have_the_peaks_of_the_ground() {
        let acceleration: Vec<f64> = (0..1000).map(|i| (0.07 * f64::from(i)).sin()).collect();
        let record = Record::new("sine", acceleration, 0.01).unwrap();
        let stiff = displacement_spectrum(&record, &[0.01], 0.05).unwrap()[0] * (TAU / 0.01_f64).powi(2);
        assert!((stiff - 1.0).abs() < 0.02, "{stiff}");
        assert!(displacement_spectrum(&record, &[0.0], 0.05).is_err());
        assert!(displacement_spectrum(&record, &[1.0], 1.0).is_err());
    }

    #[test]
    fn a_period_that_would_take_forever_is_refused() {
        let record = Record::new("step", vec![1.0; 10], 0.8).unwrap();
        let refused = displacement_spectrum(&record, &[1.19e16], 0.0).unwrap_err().to_string();
        assert!(refused.starts_with("period = 1"), "{refused}");
        assert!(displacement_spectrum(&record, &[1e5], 0.0).is_ok());
    }
}
