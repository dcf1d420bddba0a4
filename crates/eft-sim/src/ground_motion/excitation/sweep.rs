//! The sine sweep of the paper's characterisation tests (Figs. 8–11).

use super::{Command, sampled};
use crate::{Result, checks};
use std::f64::consts::TAU;

/// A sine whose frequency runs linearly from `f_start` to `f_end` (Hz) in `duration` (s); force in N.
///
/// Sample `i` is `amplitude·sin(2π(f_start·t + (f_end − f_start)·t²/(2·duration)))` at `t = i / sample_rate`;
/// there are `round(duration·sample_rate)` of them. `f_end` below `f_start` sweeps downwards.
///
/// # Errors
/// When an argument is not finite, a frequency is negative or above half the sample rate, `duration` is not
/// positive, the `sample_rate` is outside its range, or the sweep would be empty or longer than
/// [`super::MAX_SAMPLES`].
pub fn sine_sweep(
    amplitude: f64,
    f_start: f64,
    f_end: f64,
    duration: f64,
    sample_rate: f64,
) -> Result<Command> {
    checks::finite("amplitude", amplitude, "N")?;
    checks::within_nyquist("f_start", f_start, sample_rate)?;
    checks::within_nyquist("f_end", f_end, sample_rate)?;
    let rate_of_change = (f_end - f_start) / duration;
    sampled(duration, sample_rate, |t| {
        let cycles = (f_start + 0.5 * rate_of_change * t) * t;
        amplitude * libm::sin(TAU * cycles)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweep_of_the_paper_has_known_samples() {
        let sweep = sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0).unwrap();
        assert_eq!(sweep.values.len(), 131_072);
        assert_eq!(sweep.values[0], 0.0);
        // At t = 8 s the phase is 10 whole cycles, at t = 2 s 0.625 of one: sin(225°) = −√½.
        assert!(sweep.values[8 * 4096].abs() < 1e-8);
        assert!((sweep.values[2 * 4096] + 8900.0 * 0.5_f64.sqrt()).abs() < 1e-8);
        assert!(sweep.values.iter().all(|v| v.abs() <= 8900.0));
    }

    #[test]
    fn equal_frequencies_make_a_plain_sine() {
        let sine = sine_sweep(2.0, 3.0, 3.0, 1.0, 120.0).unwrap();
        assert!((sine.values[10] - 2.0).abs() < 1e-14, "a quarter period after 1/12 s");
    }

    #[test]
    fn duration_is_rounded_to_whole_samples() {
        assert_eq!(sine_sweep(1.0, 0.0, 1.0, 1.04, 10.0).unwrap().values.len(), 10);
        assert_eq!(sine_sweep(1.0, 0.0, 1.0, 1.06, 10.0).unwrap().values.len(), 11);
    }

    #[test]
    fn bad_arguments_are_named() {
        let text = |a, f0, f1, d, fs| sine_sweep(a, f0, f1, d, fs).unwrap_err().to_string();
        assert!(text(f64::NAN, 0.0, 1.0, 1.0, 10.0).starts_with("amplitude = NaN"));
        assert!(text(1.0, -1.0, 1.0, 1.0, 10.0).starts_with("f_start = -1"));
        assert!(text(1.0, 0.0, 5.1, 1.0, 10.0).starts_with("f_end = 5.1: must lie within 0 and half"));
        assert!(text(1.0, 0.0, f64::NAN, 1.0, 10.0).starts_with("f_end = NaN"));
        assert!(text(1.0, 0.0, 1.0, 0.0, 10.0).starts_with("duration = 0"));
        assert!(text(1.0, 0.0, 1.0, 1.0, f64::INFINITY).starts_with("sample_rate = inf"));
        assert!(text(1.0, 0.0, 1.0, 1e-9, 10.0).starts_with("number of samples = 0"));
        assert!(text(1.0, 0.0, 1.0, 1.0, 1e300).starts_with("sample_rate = 1e300"));
        assert!(text(1.0, 0.0, 1.0, 1e9, 1e9).starts_with("number of samples = "));
    }
}
