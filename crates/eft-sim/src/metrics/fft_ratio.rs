//! Frequency response from a whole record: the ratio of two spectra.

use super::pair::{check, in_range};
use crate::fourier::spectrum;
use crate::{Result, checks};

/// Bins in which the command has less than this part of its largest bin contain rounding errors only.
const EMPTY_BIN: f64 = 1e-12;

/// |FFT(force)| / |FFT(command)| over a band, as in the paper's Figs. 9 and 11.
#[derive(Debug, Clone, PartialEq)]
pub struct FftRatio {
    /// Frequency of each bin, in Hz.
    pub frequency: Vec<f64>,
    /// Ratio of the magnitudes in each bin, dimensionless.
    pub ratio: Vec<f64>,
}

impl FftRatio {
    /// The smallest ratio (dimensionless) and its frequency in Hz.
    #[must_use]
    pub fn min(&self) -> (f64, f64) {
        self.extreme(|a, b| a < b)
    }

    /// The largest ratio (dimensionless) and its frequency in Hz.
    #[must_use]
    pub fn max(&self) -> (f64, f64) {
        self.extreme(|a, b| a > b)
    }

    fn extreme(&self, better: impl Fn(f64, f64) -> bool) -> (f64, f64) {
        let pairs = self.ratio.iter().copied().zip(self.frequency.iter().copied());
        pairs.reduce(|best, next| if better(next.0, best.0) { next } else { best }).unwrap_or_default()
    }
}

/// Magnitude of the force's spectrum over the command's, dimensionless, at the bins in `f_low..=f_high` (Hz).
///
/// Both spectra are taken over the whole record, without window or padding, so a bin is `1 / duration` wide.
/// Bins in which the command has less than 1e-12 of its largest bin are left out.
///
/// # Errors
/// When the signals are empty, unequal in length or not finite, the command is zero throughout, the band is
/// not ordered within 0 and half the sample rate, or no bin of the band is excited.
pub fn fft_ratio(
    command: &[f64],
    force: &[f64],
    sample_rate: f64,
    f_low: f64,
    f_high: f64,
) -> Result<FftRatio> {
    check(command, force)?;
    check_band(sample_rate, f_low, f_high)?;
    let (x_c, x_m) = (spectrum(command)?, spectrum(force)?);
    let largest = x_c.iter().fold(0.0, |largest: f64, x| largest.max(x.norm_sqr())).sqrt();
    in_range("|FFT(command)|", largest)?;
    let bin_width = sample_rate / command.len() as f64;
    // A bin on the edge of the band apart from rounding belongs to it.
    let first = (f_low / bin_width - 1e-6).ceil().max(0.0) as usize;
    let last = ((f_high / bin_width + 1e-6).floor() as usize).min(x_c.len() - 1);
    let mut answer = FftRatio { frequency: Vec::new(), ratio: Vec::new() };
    for k in first..=last {
        if x_c[k].norm() > EMPTY_BIN * largest {
            answer.frequency.push(k as f64 * bin_width);
            answer.ratio.push(in_range("ratio", x_m[k].norm() / x_c[k].norm())?);
        }
    }
    let band = format!("{f_low} to {f_high} Hz");
    let allowed = format!("must hold a frequency that the command excites; bins are {bin_width} Hz apart");
    checks::require(!answer.ratio.is_empty(), "f_low, f_high", band, allowed)?;
    Ok(answer)
}

/// Rejects a band that is not ordered within zero and half the sample rate (all in Hz).
pub(super) fn check_band(sample_rate: f64, f_low: f64, f_high: f64) -> Result<()> {
    checks::within_nyquist("f_low", f_low, sample_rate)?;
    let nyquist = 0.5 * sample_rate;
    let allowed = format!("must lie within f_low = {f_low} Hz and half the sample rate, {nyquist} Hz");
    checks::require((f_low..=nyquist).contains(&f_high), "f_high", f_high, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn tones(n: usize, parts: &[(f64, f64, f64)]) -> Vec<f64> {
        let value = |t: f64| parts.iter().map(|(a, k, phase)| a * (TAU * k * t + phase).sin()).sum();
        (0..n).map(|i| value(i as f64 / n as f64)).collect()
    }

    #[test]
    fn two_tones_give_their_amplitude_ratios() {
        for n in [1000, 1001, 1021] {
            let command = tones(n, &[(2.0, 10.0, 0.1), (3.0, 20.0, 0.7)]);
            let force = tones(n, &[(1.0, 10.0, 0.4), (3.3, 20.0, -0.7)]);
            let fs = n as f64 / 4.0;
            let ratio = fft_ratio(&command, &force, fs, 1.0, 6.0).unwrap();
            assert_eq!(ratio.frequency, [2.5, 5.0], "the bins between them are empty, n = {n}");
            assert!((ratio.ratio[0] - 0.5).abs() < 1e-12 && (ratio.ratio[1] - 1.1).abs() < 1e-12);
            assert_eq!(ratio.min().1, 2.5);
            assert_eq!(ratio.max().1, 5.0);
        }
    }

    #[test]
    fn band_edges_belong_to_the_band() {
        let mut impulse = vec![0.0; 320];
        impulse[0] = 1.0;
        let ratio = fft_ratio(&impulse, &impulse, 10.0, 1.25, 2.0).unwrap();
        assert_eq!(ratio.frequency.len(), 25, "bins are 1/32 Hz wide");
        assert_eq!((ratio.frequency[0], ratio.frequency[24]), (1.25, 2.0));
        assert!(ratio.ratio.iter().all(|r| *r == 1.0));
        assert_eq!(fft_ratio(&impulse, &impulse, 10.0, 0.0, 5.0).unwrap().ratio.len(), 161);
    }

    #[test]
    fn undefined_input_is_an_error() {
        let sine = tones(100, &[(1.0, 10.0, 0.0)]);
        let text = |fs, low, high| fft_ratio(&sine, &sine, fs, low, high).unwrap_err().to_string();
        assert!(text(0.0, 1.0, 2.0).starts_with("sample_rate = 0"));
        assert!(text(100.0, f64::NAN, 2.0).starts_with("f_low = NaN"));
        assert!(text(100.0, 3.0, 2.0).starts_with("f_high = 2"));
        assert!(text(100.0, 3.0, 51.0).starts_with("f_high = 51"));
        assert!(text(100.0, 30.0, 40.0).contains("30 to 40 Hz"), "nothing excited there");
        assert!(fft_ratio(&[0.0; 4], &[1.0; 4], 1.0, 0.0, 0.5).is_err());
        assert!(fft_ratio(&[], &[], 1.0, 0.0, 0.5).is_err());
    }
}
