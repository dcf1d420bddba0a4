//! The error in the time domain, relative to the command and dimensionless.

use super::norms::Norms;
use super::pair::check;
use crate::error::Result;

/// Normalised root-mean-square error `√(Σ(x_m − x_c)² / Σx_c²)`, dimensionless.
///
/// # Errors
/// When the signals are empty, unequal in length, not finite, or the command is zero throughout.
pub fn nrmse(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    Norms::of(command, measured).nrmse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Metrics;

    #[test]
    fn known_errors() {
        let command = [3.0, -4.0, 0.0];
        assert_eq!(nrmse(&command, &command).unwrap(), 0.0);
        assert_eq!(nrmse(&command, &[0.0; 3]).unwrap(), 1.0);
        assert!((nrmse(&command, &[3.0, -4.0, 5.0]).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!(Metrics::quick(&command, &[3.0, -4.0, 1.0]).unwrap().peak_error, 0.25);
    }

    #[test]
    fn an_offset_counts_in_nrmse_only() {
        let command = [1.0, -1.0, 1.0, -1.0];
        let measured = command.map(|c| 1.1 * c + 0.5);
        assert!((nrmse(&command, &measured).unwrap() - 0.26_f64.sqrt()).abs() < 1e-15);
        let bias_free = Metrics::quick(&command, &measured).unwrap().nrmse_bias_free;
        assert!((bias_free.unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn undefined_input_is_an_error() {
        let refused = |command: &[f64], measured: &[f64]| {
            let quick = Metrics::quick(command, measured).unwrap_err().to_string();
            assert_eq!(nrmse(command, measured).unwrap_err().to_string(), quick);
            quick
        };
        assert!(refused(&[], &[]).starts_with("command = no samples"));
        assert!(refused(&[1.0, 2.0], &[1.0]).contains("the command's 2 samples"));
        assert!(refused(&[0.0, 0.0], &[1.0, 1.0]).contains("zero at every sample"));
        assert!(refused(&[1.0, 2.0], &[1.0, f64::NAN]).contains("sample 1"));
        assert!(nrmse(&[1e200, 0.0], &[-1e200, f64::MAX]).is_err(), "squares overflow");
        assert_eq!(Metrics::quick(&[2.0, 2.0], &[1.0, 2.0]).unwrap().nrmse_bias_free, None);
    }
}
