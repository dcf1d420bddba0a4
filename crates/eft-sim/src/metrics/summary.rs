//! All metrics of a force and its command together.

use super::norms::Norms;
use super::pair::{check, in_range};
use super::{delay, fei, oscillation};
use crate::checks;
use crate::error::Result;
use crate::fourier::spectrum;

/// The metrics of a measured force and its command.
///
/// Undefined metrics are `None`: the delay of a force that stays zero, and the bias-free error and the
/// frequency-domain index of a constant command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// Root-mean-square error over the command's root mean square, dimensionless.
    pub nrmse: f64,
    /// The same with the delay removed, dimensionless.
    pub nrmse_delay_removed: Option<f64>,
    /// Standard deviation of the error over that of the command, dimensionless.
    pub nrmse_bias_free: Option<f64>,
    /// Largest error over the largest command, dimensionless.
    pub peak_error: f64,
    /// Delay by cross-correlation in s, positive when the force lags.
    pub delay: Option<f64>,
    /// Amplitude of the frequency-domain evaluation index, dimensionless.
    pub fei_amplitude: Option<f64>,
    /// Delay of the frequency-domain evaluation index, in s.
    pub fei_delay: Option<f64>,
    /// Equivalent frequency of the frequency-domain evaluation index, in Hz.
    pub fei_frequency: Option<f64>,
    /// Rms of the force error from 30 to 150 Hz over the rms of the command, dimensionless; `None` for a
    /// sample rate below 300 Hz.
    pub oscillation: Option<f64>,
    /// Mercan's tracking indicator at the end of the test, in N²: half the difference of the areas under measured over
    /// command and command over measured, each by the trapezoidal rule. A lag `φ` of the amplitude `b` behind `a` lowers
    /// it by `π·a·b·sin φ` per cycle; a lead raises it.
    pub tracking_indicator: f64,
}

impl Metrics {
    /// Compares a measured force (N) with its command (N), without the metrics that take longer than the test; those are
    /// `None`.
    ///
    /// # Errors
    /// When the signals are empty, unequal in length or not finite, or the command is zero throughout.
    pub fn quick(command: &[f64], measured: &[f64]) -> Result<Self> {
        check(command, measured)?;
        Self::of(&Norms::of(command, measured), command)
    }

    /// The same from sums.
    ///
    /// # Errors
    /// Signals whose squares leave the range of `f64`.
    pub(crate) fn of(norms: &Norms<f64>, command: &[f64]) -> Result<Self> {
        let varies = command.iter().any(|c| *c != command[0]);
        Ok(Self {
            nrmse: norms.nrmse()?,
            nrmse_delay_removed: None,
            nrmse_bias_free: varies.then(|| norms.nrmse_bias_free()).transpose()?,
            peak_error: norms.peak_error()?,
            delay: None,
            fei_amplitude: None,
            fei_delay: None,
            fei_frequency: None,
            oscillation: None,
            tracking_indicator: norms.tracking_indicator()?,
        })
    }

    /// Compares a measured force (N) with its command (N), both sampled at `sample_rate` (Hz).
    ///
    /// # Errors
    /// When the signals are empty, unequal in length or not finite, the command is zero throughout, or the
    /// sample rate is not positive and finite.
    pub fn new(command: &[f64], measured: &[f64], sample_rate: f64) -> Result<Self> {
        let quick = Self::quick(command, measured)?;
        checks::sample_rate("sample_rate", sample_rate)?;
        quick.with_transforms(command, measured, sample_rate)
    }

    /// Adds the other metrics of the same, already checked signals.
    ///
    /// # Errors
    /// As [`new`](Self::new), where the numbers leave the range of `f64`.
    pub(crate) fn with_transforms(self, command: &[f64], measured: &[f64], sample_rate: f64) -> Result<Self> {
        let lag = delay::lag_if_any(command, measured)?;
        let samples = command.len();
        let (c, m) = (spectrum(command)?, spectrum(measured)?);
        let fei = self.nrmse_bias_free.map(|_| fei::fei_of([&c, &m], samples, sample_rate)).transpose()?;
        let energy = command.iter().map(|c| c * c).sum();
        let fei_delay = fei.filter(|fei| fei.amplitude > 0.0).map(|fei| fei.delay);
        let without_lag = |lag| delay::nrmse_at_lag(command, measured, lag);
        Ok(Self {
            nrmse_delay_removed: lag.map(without_lag).transpose()?,
            delay: lag.map(|lag| in_range("delay", lag / sample_rate)).transpose()?,
            fei_amplitude: fei.map(|fei| fei.amplitude),
            fei_delay,
            fei_frequency: fei.map(|fei| fei.frequency),
            oscillation: oscillation::oscillation_of([&c, &m], samples, energy, sample_rate)?,
            ..self
        })
    }

    /// Name and value of each metric that has a value.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.all().into_iter().filter_map(|(name, value)| Some((name, value?)))
    }

    /// Name and value of every metric, the same names for every test.
    pub fn all(&self) -> [(&'static str, Option<f64>); 10] {
        [
            ("nrmse", Some(self.nrmse)),
            ("nrmse_delay_removed", self.nrmse_delay_removed),
            ("nrmse_bias_free", self.nrmse_bias_free),
            ("peak_error", Some(self.peak_error)),
            ("delay", self.delay),
            ("fei_amplitude", self.fei_amplitude),
            ("fei_delay", self.fei_delay),
            ("fei_frequency", self.fei_frequency),
            ("oscillation", self.oscillation),
            ("tracking_indicator", Some(self.tracking_indicator)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Values of NumPy 2 for the same formulas.
    #[test]
    fn agrees_with_numpy() {
        let pair = |i: usize| {
            let i = i as f64;
            let c = (0.3 * i).sin() + 0.5 * (1e-3 * i * i).sin();
            (c, 0.8 * (0.3 * i - 0.4).sin() + 0.2 * (2e-3 * i * i + 1.0).sin())
        };
        let (c, m): (Vec<f64>, Vec<f64>) = (0..1000).map(pair).unzip();
        let metrics = Metrics::new(&c, &m, 50.0).unwrap();
        assert!((metrics.nrmse - 0.6070146389303732).abs() < 1e-12);
        assert!((metrics.nrmse_bias_free.unwrap() - 0.6070597344822596).abs() < 1e-12);
        assert!((metrics.fei_amplitude.unwrap() - 0.6450938334071045).abs() < 1e-11);
        assert!((metrics.fei_delay.unwrap() - 0.01746670331409834).abs() < 1e-12);
        assert!((metrics.fei_frequency.unwrap() - 3.5763125806616483).abs() < 1e-10);
    }

    #[test]
    fn metrics_agree_with_the_single_functions() {
        let c: Vec<f64> = (0..512).map(|i| (0.1 * f64::from(i)).sin()).collect();
        let m: Vec<f64> = (0..512).map(|i| 0.9 * (0.1 * f64::from(i) - 0.2).sin() + 0.01).collect();
        let metrics = Metrics::new(&c, &m, 100.0).unwrap();
        assert_eq!(metrics.delay.unwrap(), delay::delay(&c, &m, 100.0).unwrap());
        assert!((metrics.nrmse_delay_removed.unwrap() - 0.1).abs() < 0.01, "{metrics:?}");
        assert!((metrics.delay.unwrap() - 0.02).abs() < 1e-3);
        assert!(metrics.tracking_indicator < 0.0, "a lag");
        assert_eq!(metrics.iter().count(), 9, "too slow for an oscillation");
        assert!(metrics.iter().any(|(name, value)| name == "nrmse" && value == metrics.nrmse));
    }

    #[test]
    fn an_undefined_metric_is_absent() {
        let steady = Metrics::new(&[2.0; 20], &[1.0; 20], 10.0).unwrap();
        assert_eq!((steady.nrmse, steady.delay), (0.5, Some(0.0)));
        assert!(steady.nrmse_bias_free.is_none() && steady.fei_frequency.is_none());
        let silent = Metrics::new(&[1.0, -2.0, 1.0], &[0.0; 3], 10.0).unwrap();
        assert!(silent.delay.is_none() && silent.nrmse_delay_removed.is_none() && silent.fei_delay.is_none());
        assert_eq!(silent.fei_amplitude, Some(0.0));
        assert!(silent.iter().all(|(_, value)| value.is_finite()));
        assert!(Metrics::new(&[], &[], 10.0).is_err() && Metrics::new(&[0.0], &[1.0], 10.0).is_err());
    }

    #[test]
    fn a_lagging_sine_loses_pi_a_b_sin_phi_per_cycle() {
        let (a, b, phi, per_cycle) = (3.0, 2.0, 0.4, 20_000);
        let theta = |i: usize| TAU * i as f64 / per_cycle as f64;
        for cycles in [1, 2] {
            let command: Vec<f64> = (0..=cycles * per_cycle).map(|i| a * theta(i).sin()).collect();
            let measured: Vec<f64> = (0..=cycles * per_cycle).map(|i| b * (theta(i) - phi).sin()).collect();
            let found = Metrics::quick(&command, &measured).unwrap().tracking_indicator;
            assert!((found / (-PI * a * b * phi.sin()) - cycles as f64).abs() < 1e-7);
        }
    }

    #[test]
    fn a_pure_gain_has_no_area_and_wrong_input_is_an_error() {
        let command = [0.0, 1.0, 3.0, -2.0];
        for length in 2..=4 {
            let (command, measured) = (&command[..length], &command.map(|c| 0.7 * c)[..length]);
            assert!(Metrics::quick(command, measured).unwrap().tracking_indicator.abs() < 1e-15);
        }
        assert!(Metrics::quick(&[1e300, -1e300], &[1e300, 1e300]).is_err());
    }
}
