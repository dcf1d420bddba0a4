//! The frequency-domain evaluation index: amplitude and delay, weighted by the command's own spectrum.

use super::pair::in_range;
use crate::Result;
use crate::fourier::Complex64;
use std::f64::consts::TAU;

/// Amplitude, delay and frequency of the frequency-domain evaluation index with exponent l = 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fei {
    /// Modulus of `ΣX_m·conj(X_c) / Σ|X_c|²`, dimensionless: 1 means the amplitude of the command.
    pub(super) amplitude: f64,
    /// Argument of the same quotient over `−2π·frequency`, in s: positive when the measured signal lags.
    pub(super) delay: f64,
    /// Equivalent frequency `Σ|X_c|²·f / Σ|X_c|²`, in Hz.
    pub(super) frequency: f64,
}

/// The index of a measured signal, from the one-sided spectra of `samples` samples of command and measured signal.
pub(super) fn fei_of([x_c, x_m]: [&[Complex64]; 2], samples: usize, sample_rate: f64) -> Result<Fei> {
    let (mut cross, mut energy, mut moment) = (Complex64::default(), 0.0, 0.0);
    for (k, (c, m)) in x_c.iter().zip(x_m).enumerate() {
        cross += m * c.conj();
        energy += c.norm_sqr();
        moment += c.norm_sqr() * k as f64;
    }
    let frequency = moment / energy * sample_rate / samples as f64;
    Ok(Fei {
        amplitude: in_range("fei_amplitude", cross.norm() / energy)?,
        delay: in_range("fei_delay", -cross.arg() / (TAU * frequency))?,
        frequency: in_range("fei_frequency", frequency)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Metrics;

    fn fei(command: &[f64], measured: &[f64], sample_rate: f64) -> Result<Fei> {
        let found = Metrics::of_force(command, measured, sample_rate)?;
        let [amplitude, delay, frequency] =
            ["fei_amplitude", "fei_delay", "fei_frequency"].map(|name| found.get(name).unwrap());
        Ok(Fei { amplitude, delay, frequency })
    }

    #[test]
    fn one_tone_has_its_own_amplitude_delay_and_frequency() {
        for n in [1000, 999] {
            let fs = 250.0;
            let f = 12.0 * fs / n as f64;
            let tone = |delay: f64| move |i: usize| (TAU * f * (i as f64 / fs - delay)).sin();
            let command: Vec<f64> = (0..n).map(tone(0.0)).collect();
            for delay in [0.0, 0.02, -0.05] {
                let measured: Vec<f64> = (0..n).map(tone(delay)).map(|m| 0.9 * m).collect();
                let fei = fei(&command, &measured, fs).unwrap();
                assert!((fei.amplitude - 0.9).abs() < 1e-12 && (fei.frequency - f).abs() < 1e-10);
                assert!((fei.delay - delay).abs() < 1e-12, "{} instead of {delay}", fei.delay);
            }
        }
    }

    #[test]
    fn two_tones_are_weighted_by_their_power() {
        let n = 400;
        let tones = |a: f64, b: f64| {
            let value = move |i: usize| {
                let t = TAU * i as f64 / n as f64;
                a * (10.0 * t).cos() + b * (40.0 * t).cos()
            };
            (0..n).map(value).collect::<Vec<_>>()
        };
        let fei = fei(&tones(2.0, 1.0), &tones(2.2, 0.8), 400.0).unwrap();
        // Weights 4 : 1, so 1.1·0.8 + 0.8·0.2 and 10·0.8 + 40·0.2.
        assert!((fei.amplitude - 1.04).abs() < 1e-12 && (fei.frequency - 16.0).abs() < 1e-10);
        assert!(fei.delay.abs() < 1e-15);
    }

    #[test]
    fn undefined_input_is_an_error() {
        assert!(fei(&[1.0; 8], &[1.0; 8], 10.0).unwrap().amplitude.is_nan());
        assert!(fei(&[0.0; 8], &[1.0; 8], 10.0).is_err());
        assert!(fei(&[0.0, 1.0], &[0.0, 1.0], -1.0).is_err());
        assert!(fei(&[0.0, 1e300], &[0.0, 1e300], 1.0).is_err());
        let silent = fei(&[0.0, 1.0, 0.0], &[0.0; 3], 1.0).unwrap();
        assert!(silent.amplitude == 0.0 && silent.delay.is_nan());
    }
}
