//! The delay from the slope of a phase.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use crate::{Result, checks};

/// Number of frequencies of the fit.
const POINTS: usize = 400;

/// The delay (s) of a response over a band (Hz): the slope of its phase against frequency, fitted with an intercept
/// at evenly spaced frequencies, over −2π.
///
/// # Errors
/// A band that is not positive, ordered and finite.
pub fn phase_delay(response: impl Fn(f64) -> Complex<f64>, band: (f64, f64)) -> Result<f64> {
    let (low, high) = band;
    checks::finite("band", high, "Hz")?;
    let allowed = "must be two frequencies in Hz, the lower first";
    checks::require(low >= 0.0 && high > low, "band", format!("({low}, {high})"), allowed)?;
    let step = (high - low) / (POINTS - 1) as f64;
    let middle = 0.5 * (low + high);
    let (mut last, mut unwrapped) = (0.0, 0.0);
    let (mut product, mut square) = (0.0, 0.0);
    for i in 0..POINTS {
        let frequency = low + i as f64 * step;
        let phase = response(frequency).arg();
        let jump = phase - last;
        unwrapped += if i == 0 { phase } else { jump - TAU * ((jump + PI) / TAU).floor() };
        last = phase;
        product += (frequency - middle) * unwrapped;
        square += (frequency - middle) * (frequency - middle);
    }
    // Gives 0 and not −0 without delay.
    Ok((0.0 - product) / square / TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pure_delay_of_many_periods_is_found() {
        let delay = phase_delay(|f| Complex::from_polar(0.3, 1.0 - TAU * f * 0.7), (0.25, 10.0)).unwrap();
        assert!((delay - 0.7).abs() < 1e-12);
        assert!(phase_delay(|_| Complex::new(1.0, 0.0), (2.0, 1.0)).is_err());
        assert!(phase_delay(|_| Complex::new(1.0, 0.0), (f64::NAN, 1.0)).is_err());
    }
}
