//! Mercan's tracking indicator: the signed area between command and measurement.

use super::pair::{check, in_range};
use crate::error::Result;

/// The tracking indicator in the square of the signals' unit (N²), at each sample from the beginning.
///
/// The indicator is half the difference of the areas under measured over command and command over measured,
/// each by the trapezoidal rule. It falls while the measurement lags, by `π·a·b·sin φ` per cycle for the
/// amplitudes a and b and the lag φ. It rises while the measurement leads.
///
/// # Errors
/// When the signals are empty, unequal in length, not finite, or the command is zero throughout.
pub fn tracking_indicator(command: &[f64], measured: &[f64]) -> Result<Vec<f64>> {
    check(command, measured)?;
    let mut sum = 0.0;
    let history = steps(command, measured).map(|step| {
        sum += step;
        sum
    });
    let history: Vec<f64> = std::iter::once(0.0).chain(history).collect();
    in_range("tracking_indicator", sum).map(|_| history)
}

/// Increment of each step: ¼(m₁+m₀)(c₁−c₀) − ¼(c₁+c₀)(m₁−m₀) is half the cross product of two points.
fn steps(command: &[f64], measured: &[f64]) -> impl Iterator<Item = f64> {
    command.windows(2).zip(measured.windows(2)).map(|(c, m)| 0.5 * (m[0] * c[1] - m[1] * c[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn a_lagging_sine_loses_pi_a_b_sin_phi_per_cycle() {
        let (a, b, phi, per_cycle) = (3.0, 2.0, 0.4, 20_000);
        let theta = |i: usize| TAU * i as f64 / per_cycle as f64;
        let command: Vec<f64> = (0..=2 * per_cycle).map(|i| a * theta(i).sin()).collect();
        let measured: Vec<f64> = (0..=2 * per_cycle).map(|i| b * (theta(i) - phi).sin()).collect();
        let history = tracking_indicator(&command, &measured).unwrap();
        let expected = -PI * a * b * phi.sin();
        assert_eq!((history.len(), history[0]), (command.len(), 0.0));
        assert!((history[per_cycle] / expected - 1.0).abs() < 1e-7);
        assert!((history[2 * per_cycle] / expected - 2.0).abs() < 1e-7);
    }

    #[test]
    fn a_pure_gain_has_no_area_and_wrong_input_is_an_error() {
        let command = [0.0, 1.0, 3.0, -2.0];
        let history = tracking_indicator(&command, &command.map(|c| 0.7 * c)).unwrap();
        assert!(history.iter().all(|t| t.abs() < 1e-15));
        assert!(tracking_indicator(&[], &[]).is_err());
        assert!(tracking_indicator(&[1e300, -1e300], &[1e300, 1e300]).is_err());
    }
}
