//! Errors in the time domain, relative to the command and without a unit.

use super::pair::{check, in_range, peak};
use crate::error::{Error, Result};

/// Normalised root-mean-square error `√(Σ(x_m − x_c)² / Σx_c²)`, dimensionless.
///
/// # Errors
/// When the signals are empty, unequal in length, not finite, or the command is zero throughout.
pub fn nrmse(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    nrmse_of(command, measured)
}

/// [`nrmse`] of signals that have passed [`check`].
pub(super) fn nrmse_of(command: &[f64], measured: &[f64]) -> Result<f64> {
    let error: f64 = pairs(command, measured).map(|(c, m)| (m - c) * (m - c)).sum();
    let reference: f64 = command.iter().map(|c| c * c).sum();
    in_range("nrmse", (error / reference).sqrt())
}

/// Standard deviation of the error over that of the command, dimensionless: [`nrmse`] blind to an offset.
///
/// # Errors
/// As [`nrmse`], and when the command is constant.
pub fn nrmse_bias_free(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    if command.iter().all(|c| *c == command[0]) {
        return Err(Error::value("command", format!("{} at every sample", command[0]), "must vary"));
    }
    nrmse_bias_free_of(command, measured)
}

/// [`nrmse_bias_free`] of signals that have passed [`check`], the command not constant.
pub(super) fn nrmse_bias_free_of(command: &[f64], measured: &[f64]) -> Result<f64> {
    let error = sum_of_squares_about_mean(pairs(command, measured).map(|(c, m)| m - c), command.len());
    let reference = sum_of_squares_about_mean(command.iter().copied(), command.len());
    in_range("nrmse_bias_free", (error / reference).sqrt())
}

/// Largest error over the largest command, `max|x_m − x_c| / max|x_c|`, dimensionless.
///
/// # Errors
/// As [`nrmse`].
pub fn peak_error(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    peak_error_of(command, measured)
}

/// [`peak_error`] of signals that have passed [`check`].
pub(super) fn peak_error_of(command: &[f64], measured: &[f64]) -> Result<f64> {
    let error = peak(pairs(command, measured).map(|(c, m)| m - c));
    in_range("peak_error", error / peak(command.iter().copied()))
}

fn pairs<'a>(command: &'a [f64], measured: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    command.iter().copied().zip(measured.iter().copied())
}

/// Two passes: one pass cancels where the mean is large against the deviation.
fn sum_of_squares_about_mean(values: impl Iterator<Item = f64> + Clone, count: usize) -> f64 {
    let mean = values.clone().sum::<f64>() / count as f64;
    values.map(|v| (v - mean) * (v - mean)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_errors() {
        let command = [3.0, -4.0, 0.0];
        assert_eq!(nrmse(&command, &command).unwrap(), 0.0);
        assert_eq!(nrmse(&command, &[0.0; 3]).unwrap(), 1.0);
        assert!((nrmse(&command, &[3.0, -4.0, 5.0]).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!(peak_error(&command, &[3.0, -4.0, 1.0]).unwrap(), 0.25);
    }

    #[test]
    fn an_offset_counts_in_nrmse_only() {
        let command = [1.0, -1.0, 1.0, -1.0];
        let measured = command.map(|c| 1.1 * c + 0.5);
        assert!((nrmse(&command, &measured).unwrap() - 0.26_f64.sqrt()).abs() < 1e-15);
        assert!((nrmse_bias_free(&command, &measured).unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn undefined_input_is_an_error() {
        for metric in [nrmse, nrmse_bias_free, peak_error] {
            assert!(metric(&[], &[]).unwrap_err().to_string().starts_with("command = no samples"));
            assert!(metric(&[1.0, 2.0], &[1.0]).unwrap_err().to_string().contains("the command's 2 samples"));
            assert!(
                metric(&[0.0, 0.0], &[1.0, 1.0]).unwrap_err().to_string().contains("zero at every sample")
            );
            assert!(metric(&[1.0, 2.0], &[1.0, f64::NAN]).unwrap_err().to_string().contains("sample 1"));
        }
        assert!(nrmse(&[1e200, 0.0], &[-1e200, f64::MAX]).is_err(), "squares overflow");
        assert!(nrmse_bias_free(&[2.0, 2.0], &[1.0, 2.0]).is_err());
    }
}
