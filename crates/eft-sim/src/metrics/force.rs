//! The metrics of a measured force and its command.

use super::norms::Norms;
use super::pair::{check, in_range};
use super::table::Metrics;
use super::{delay, fei, oscillation};
use crate::fourier::spectrum;
use crate::{Result, checks};

impl Metrics {
    /// Compares a measured force (N) with its command (N), without the costly metrics.
    ///
    /// # Errors
    /// When the signals are empty, unequal in length or not finite, or the command is zero throughout.
    pub fn quick_of_force(command: &[f64], force: &[f64]) -> Result<Self> {
        check(command, force)?;
        let mut metrics = Self::default();
        metrics.add_norms(&Norms::of(command, force), command)?;
        Ok(metrics)
    }

    /// Compares a measured force (N) with its command (N), both sampled at `sample_rate` (Hz).
    ///
    /// Undefined are the delay of a force that stays zero, the bias-free error and the frequency-domain index of a
    /// constant command, and the oscillation at a sample rate below 300 Hz.
    ///
    /// # Errors
    /// When the signals are empty, unequal in length or not finite, the command is zero throughout, or the
    /// sample rate is not positive and finite.
    pub fn of_force(command: &[f64], force: &[f64], sample_rate: f64) -> Result<Self> {
        let mut metrics = Self::quick_of_force(command, force)?;
        checks::sample_rate("sample_rate", sample_rate)?;
        metrics.add_transforms(command, force, sample_rate)?;
        Ok(metrics)
    }

    /// Adds the metrics of the force that follow from its sums.
    ///
    /// # Errors
    /// Signals whose squares leave the range of `f64`.
    pub(super) fn add_norms(&mut self, norms: &Norms<f64>, command: &[f64]) -> Result<()> {
        self.set("nrmse", norms.nrmse()?);
        self.set("nrmse_bias_free", varies(command).then(|| norms.nrmse_bias_free()).transpose()?);
        self.set("peak_error", norms.peak_error()?);
        self.set("tracking_indicator", norms.tracking_indicator()?);
        Ok(())
    }

    /// Adds the other metrics of the same, already checked signals.
    ///
    /// # Errors
    /// Numbers that leave the range of `f64`.
    pub(super) fn add_transforms(&mut self, command: &[f64], force: &[f64], sample_rate: f64) -> Result<()> {
        let lag = delay::lag_if_any(command, force)?;
        let without_lag = |lag| delay::nrmse_at_lag(command, force, lag);
        self.set("nrmse_delay_removed", lag.map(without_lag).transpose()?);
        self.set("delay", lag.map(|lag| in_range("delay", lag / sample_rate)).transpose()?);
        let samples = command.len();
        let (c, m) = (spectrum(command)?, spectrum(force)?);
        let fei = varies(command).then(|| fei::fei_of([&c, &m], samples, sample_rate)).transpose()?;
        self.set("fei_amplitude", fei.map(|fei| fei.amplitude));
        self.set("fei_delay", fei.filter(|fei| fei.amplitude > 0.0).map(|fei| fei.delay));
        self.set("fei_frequency", fei.map(|fei| fei.frequency));
        let energy = command.iter().map(|c| c * c).sum();
        self.set("oscillation", oscillation::oscillation_of([&c, &m], samples, energy, sample_rate)?);
        Ok(())
    }
}

/// Whether a command is not constant.
fn varies(command: &[f64]) -> bool {
    command.iter().any(|c| *c != command[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::nrmse;
    use std::f64::consts::{PI, TAU};

    fn value(metrics: &Metrics, name: &str) -> f64 {
        metrics.get(name).unwrap()
    }

    fn quick(command: &[f64], force: &[f64], name: &str) -> f64 {
        value(&Metrics::quick_of_force(command, force).unwrap(), name)
    }

    /// Values of NumPy 2 for the same formulas.
    #[test]
    fn agrees_with_numpy() {
        let pair = |i: usize| {
            let i = i as f64;
            let c = (0.3 * i).sin() + 0.5 * (1e-3 * i * i).sin();
            (c, 0.8 * (0.3 * i - 0.4).sin() + 0.2 * (2e-3 * i * i + 1.0).sin())
        };
        let (c, m): (Vec<f64>, Vec<f64>) = (0..1000).map(pair).unzip();
        let metrics = Metrics::of_force(&c, &m, 50.0).unwrap();
        assert!((value(&metrics, "nrmse") - 0.6070146389303732).abs() < 1e-12);
        assert!((value(&metrics, "nrmse_bias_free") - 0.6070597344822596).abs() < 1e-12);
        assert!((value(&metrics, "fei_amplitude") - 0.6450938334071045).abs() < 1e-11);
        assert!((value(&metrics, "fei_delay") - 0.01746670331409834).abs() < 1e-12);
        assert!((value(&metrics, "fei_frequency") - 3.5763125806616483).abs() < 1e-10);
    }

    #[test]
    fn metrics_agree_with_the_single_functions() {
        let c: Vec<f64> = (0..512).map(|i| (0.1 * f64::from(i)).sin()).collect();
        let m: Vec<f64> = (0..512).map(|i| 0.9 * (0.1 * f64::from(i) - 0.2).sin() + 0.01).collect();
        let metrics = Metrics::of_force(&c, &m, 100.0).unwrap();
        assert_eq!(value(&metrics, "delay"), delay::delay(&c, &m, 100.0).unwrap());
        assert!((value(&metrics, "nrmse_delay_removed") - 0.1).abs() < 0.01, "{metrics:?}");
        assert!((value(&metrics, "delay") - 0.02).abs() < 1e-3);
        assert!(value(&metrics, "tracking_indicator") < 0.0, "a lag");
        assert_eq!(metrics.iter().count(), 10);
        assert!(value(&metrics, "oscillation").is_nan(), "too slow");
    }

    #[test]
    fn an_undefined_metric_is_nan() {
        let undefined = |metrics: &Metrics| {
            let names = metrics.iter().filter(|(_, value)| value.is_nan()).map(|(name, _)| name);
            names.collect::<Vec<_>>()
        };
        let steady = Metrics::of_force(&[2.0; 20], &[1.0; 20], 10.0).unwrap();
        assert_eq!((value(&steady, "nrmse"), value(&steady, "delay")), (0.5, 0.0));
        let of_a_constant = ["nrmse_bias_free", "fei_amplitude", "fei_delay", "fei_frequency", "oscillation"];
        assert_eq!(undefined(&steady), of_a_constant);
        let silent = Metrics::of_force(&[1.0, -2.0, 1.0], &[0.0; 3], 10.0).unwrap();
        assert_eq!(undefined(&silent), ["nrmse_delay_removed", "delay", "fei_delay", "oscillation"]);
        assert_eq!(value(&silent, "fei_amplitude"), 0.0);
        assert!(Metrics::of_force(&[], &[], 10.0).is_err());
        assert!(Metrics::of_force(&[0.0], &[1.0], 10.0).is_err());
    }

    #[test]
    fn a_lagging_sine_loses_pi_a_b_sin_phi_per_cycle() {
        let (a, b, phi, per_cycle) = (3.0, 2.0, 0.4, 20_000);
        let theta = |i: usize| TAU * i as f64 / per_cycle as f64;
        for cycles in [1, 2] {
            let command: Vec<f64> = (0..=cycles * per_cycle).map(|i| a * theta(i).sin()).collect();
            let measured: Vec<f64> = (0..=cycles * per_cycle).map(|i| b * (theta(i) - phi).sin()).collect();
            let found = quick(&command, &measured, "tracking_indicator");
            assert!((found / (-PI * a * b * phi.sin()) - cycles as f64).abs() < 1e-7);
        }
    }

    #[test]
    fn a_pure_gain_has_no_area_and_wrong_input_is_an_error() {
        let command = [0.0, 1.0, 3.0, -2.0];
        for length in 2..=4 {
            let (command, measured) = (&command[..length], &command.map(|c| 0.7 * c)[..length]);
            assert!(quick(command, measured, "tracking_indicator").abs() < 1e-15);
        }
        assert!(Metrics::quick_of_force(&[1e300, -1e300], &[1e300, 1e300]).is_err());
    }

    #[test]
    fn known_errors() {
        let command = [3.0, -4.0, 0.0];
        assert_eq!(nrmse(&command, &command).unwrap(), 0.0);
        assert_eq!(nrmse(&command, &[0.0; 3]).unwrap(), 1.0);
        assert!((nrmse(&command, &[3.0, -4.0, 5.0]).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!(quick(&command, &[3.0, -4.0, 1.0], "peak_error"), 0.25);
    }

    #[test]
    fn an_offset_counts_in_nrmse_only() {
        let command = [1.0, -1.0, 1.0, -1.0];
        let measured = command.map(|c| 1.1 * c + 0.5);
        assert!((nrmse(&command, &measured).unwrap() - 0.26_f64.sqrt()).abs() < 1e-15);
        assert!((quick(&command, &measured, "nrmse_bias_free") - 0.1).abs() < 1e-15);
    }

    #[test]
    fn undefined_input_is_an_error() {
        let refused = |command: &[f64], measured: &[f64]| {
            let quick = Metrics::quick_of_force(command, measured).unwrap_err().to_string();
            assert_eq!(nrmse(command, measured).unwrap_err().to_string(), quick);
            quick
        };
        assert!(refused(&[], &[]).starts_with("command = no samples"));
        assert!(refused(&[1.0, 2.0], &[1.0]).contains("the command's 2 samples"));
        assert!(refused(&[0.0, 0.0], &[1.0, 1.0]).contains("zero at every sample"));
        assert!(refused(&[1.0, 2.0], &[1.0, f64::NAN]).contains("sample 1"));
        assert!(nrmse(&[1e200, 0.0], &[-1e200, f64::MAX]).is_err(), "squares overflow");
        assert!(quick(&[2.0, 2.0], &[1.0, 2.0], "nrmse_bias_free").is_nan());
    }
}
