//! Errors in the time domain, relative to the command and dimensionless.

use super::norms::Norms;
use super::pair::check;
use crate::error::{Error, Result};

/// Normalised root-mean-square error `√(Σ(x_m − x_c)² / Σx_c²)`, dimensionless.
///
/// # Errors
/// When the signals are empty, unequal in length, not finite, or the command is zero throughout.
pub fn nrmse(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    Norms::of(command, measured).nrmse()
}

/// Standard deviation of the error over that of the command, dimensionless: [`nrmse`] without the offset.
///
/// # Errors
/// As [`nrmse`], and when the command is constant.
pub fn nrmse_bias_free(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    if command.iter().all(|c| *c == command[0]) {
        return Err(Error::value("command", format!("{} at every sample", command[0]), "must vary"));
    }
    Norms::of(command, measured).nrmse_bias_free()
}

/// Largest error over the largest command, `max|x_m − x_c| / max|x_c|`, dimensionless.
///
/// # Errors
/// As [`nrmse`].
pub fn peak_error(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    Norms::of(command, measured).peak_error()
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
