//! Oscillation of the oil column in the force.

use super::pair::in_range;
use crate::Result;
use crate::fourier::Complex64;

/// Band (Hz) of the oil column's mode on rigs of the paper's size.
pub const OIL_COLUMN: (f64, f64) = (30.0, 150.0);

/// Rms of the force error within [`OIL_COLUMN`] over the rms of the command, dimensionless, from the
/// one-sided spectra of `samples` samples of both; `None` if the sample rate (Hz) is too low for the whole
/// band.
///
/// # Errors
/// Numbers that leave the range of `f64`.
pub(super) fn oscillation_of(
    [command, measured]: [&[Complex64]; 2],
    samples: usize,
    command_energy: f64,
    sample_rate: f64,
) -> Result<Option<f64>> {
    if sample_rate <= 2.0 * OIL_COLUMN.1 {
        return Ok(None);
    }
    let n = samples as f64;
    let inside = |k: usize| (OIL_COLUMN.0..=OIL_COLUMN.1).contains(&(k as f64 * sample_rate / n));
    let pairs = command.iter().zip(measured).enumerate().filter(|(k, _)| inside(*k));
    let energy: f64 = pairs.map(|(_, (c, m))| (m - c).norm_sqr()).sum();
    // By Parseval's theorem each bin counts twice, for positive and negative frequency.
    in_range("oscillation", (2.0 * energy / n / command_energy).sqrt()).map(Some)
}

#[cfg(test)]
mod tests {
    use crate::metrics::Metrics;
    use std::f64::consts::TAU;

    #[test]
    fn the_oscillation_counts_within_its_band_only() {
        let rate = 1000.0;
        let tone = |f: f64, a: f64| move |i: usize| a * (TAU * f * i as f64 / rate).sin();
        let command: Vec<f64> = (0..2000).map(tone(2.0, 5.0)).collect();
        let with = |f: f64| -> f64 {
            let swing = tone(f, 0.5);
            let force: Vec<f64> = command.iter().enumerate().map(|(i, c)| c + swing(i)).collect();
            Metrics::of_force(&command, &force, rate).unwrap().get("oscillation").unwrap()
        };
        assert!((with(65.0) - 0.1).abs() < 1e-12);
        assert!(with(20.0) < 1e-12 && with(200.0) < 1e-12);
        let slow = Metrics::of_force(&command, &command, 250.0).unwrap();
        assert!(slow.get("oscillation").unwrap().is_nan());
    }
}
