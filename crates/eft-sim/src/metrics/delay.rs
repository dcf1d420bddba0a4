//! The lag of a measured force behind its command, and the error without the lag.

use super::pair::{check, in_range};
use crate::fourier::{padded_spectrum, signal_of};
use crate::{Error, Result, checks};

/// A lag counts only if the overlap has this part of both signals' energy.
const LEAST_OVERLAP: f64 = 0.25;
/// Peaks of the correlation of at least this part of the highest count as equal. The one nearest to zero is
/// the delay.
const EQUAL_PEAKS: f64 = 0.95;
/// Differences of the normalised correlation below this are rounding errors.
const FLAT: f64 = 1e-12;

/// Delay of the measured signal against the command in s, positive when it lags.
///
/// The delay is the lag with the highest cross-correlation within half the record. The correlation is
/// normalised by the energy of both signals in the overlap; without that, a finite record would bias the lag
/// towards zero. Between samples a cosine through the three highest points is used, which is exact for a
/// sine. A periodic command has many lags of equal correlation: the smallest is reported.
///
/// # Errors
/// When the signals are empty, unequal in length or not finite, either is zero throughout, or the sample
/// rate is not positive and finite.
pub fn delay(command: &[f64], measured: &[f64], sample_rate: f64) -> Result<f64> {
    checks::sample_rate("sample_rate", sample_rate)?;
    in_range("delay", lag(command, measured)? / sample_rate)
}

/// [`super::nrmse`] against the measured signal `lag` samples later; the caller must have called [`check`].
pub(super) fn nrmse_at_lag(command: &[f64], measured: &[f64], lag: f64) -> Result<f64> {
    let between = Between::new(lag);
    let (mut error, mut reference) = (0.0, 0.0);
    for (i, c) in command.iter().enumerate() {
        if let Some(later) = between.value(measured, i) {
            let difference = later - c;
            error += difference * difference;
            reference += c * c;
        }
    }
    in_range("nrmse_delay_removed", (error / reference).sqrt())
}

/// The delay in samples; see [`delay`].
fn lag(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    lag_if_any(command, measured)?.ok_or_else(|| {
        let value = "zero, or opposed to the command throughout";
        Error::value("measured", value, "has no delay: it must correlate positively at some lag")
    })
}

/// The delay in samples, if any lag correlates positively; the caller must have called [`check`].
pub(super) fn lag_if_any(command: &[f64], measured: &[f64]) -> Result<Option<f64>> {
    let correlation = Correlation::new(command, measured)?;
    let peaks = |sign: isize| {
        let correlation = &correlation;
        move |lag: isize| correlation.peak(sign * lag)
    };
    let longest = correlation.longest;
    let heights = (-longest..=longest).filter_map(peaks(1)).map(|(_, height)| height);
    let least = EQUAL_PEAKS * heights.fold(0.0, |highest: f64, height| highest.max(height));
    let nearest_first = (0..=longest).flat_map(|lag| [peaks(1)(lag), peaks(-1)(lag)]).flatten();
    Ok(nearest_first.into_iter().find(|(_, height)| *height >= least).map(|(lag, _)| lag))
}

/// Normalised cross-correlation at lags within half the record; zero where the overlap holds too little.
struct Correlation {
    /// Lags from zero upwards, and negative ones from the end downwards, as the transform leaves them.
    circular: Vec<f64>,
    longest: isize,
}

impl Correlation {
    fn new(command: &[f64], measured: &[f64]) -> Result<Self> {
        let n = command.len();
        let longest = n / 2;
        let length = fast_length(n + longest);
        let mut product = padded_spectrum(command, length)?;
        for (c, m) in product.iter_mut().zip(padded_spectrum(measured, length)?) {
            *c = c.conj() * m;
        }
        // Rounding must not leave an imaginary part where a real signal has none.
        for edge in [0, length / 2] {
            product[edge].im = 0.0;
        }
        let mut circular = signal_of(product, length)?;
        let (energy_c, energy_m) = (energy("Σx_c²", command)?, energy("Σx_m²", measured)?);
        if energy_m == 0.0 {
            circular.fill(0.0);
            return Ok(Self { circular, longest: longest as isize });
        }
        let normalise = |raw: &mut f64, c: f64, m: f64| {
            let enough = c >= LEAST_OVERLAP * energy_c && m >= LEAST_OVERLAP * energy_m;
            *raw = if enough { *raw / (length as f64 * (c * m).sqrt()) } else { 0.0 };
        };
        normalise(&mut circular[0], energy_c, energy_m);
        // Each longer lag loses one sample at either end of the overlap.
        let (mut late, mut early) = ([energy_c, energy_m], [energy_c, energy_m]);
        for lag in 1..=longest {
            let (first, last) = (lag - 1, n - lag);
            late[0] -= command[last] * command[last];
            late[1] -= measured[first] * measured[first];
            normalise(&mut circular[lag], late[0], late[1]);
            early[0] -= command[first] * command[first];
            early[1] -= measured[last] * measured[last];
            normalise(&mut circular[length - lag], early[0], early[1]);
        }
        Ok(Self { circular, longest: longest as isize })
    }

    /// The value at a lag, if it lies within the range.
    fn at(&self, lag: isize) -> Option<f64> {
        let index = if lag < 0 { self.circular.len() as isize + lag } else { lag };
        if lag.abs() <= self.longest { self.circular.get(index as usize).copied() } else { None }
    }

    /// Position and height of the peak around a lag, if it is higher than both its neighbours.
    fn peak(&self, lag: isize) -> Option<(f64, f64)> {
        let here = self.at(lag).filter(|here| *here > 0.0)?;
        let (before, after) = (self.at(lag - 1), self.at(lag + 1));
        let above = |side: Option<f64>| side.is_none_or(|side| here + FLAT >= side);
        if !above(before) || !above(after) {
            return None;
        }
        let (offset, height) = match (before, after) {
            (Some(before), Some(after)) => cosine_peak(before, here, after),
            _ => (0.0, here),
        };
        Some((lag as f64 + offset, height))
    }
}

/// Sum of squares, in the square of the signal's unit; zero only for a signal of zeros.
fn energy(name: &str, signal: &[f64]) -> Result<f64> {
    let sum: f64 = signal.iter().map(|v| v * v).sum();
    let vanished = sum < f64::MIN_POSITIVE && signal.iter().any(|v| *v != 0.0);
    in_range(name, if vanished { f64::NAN } else { sum })
}

/// An even transform length of small factors, at least `least`.
fn fast_length(least: usize) -> usize {
    let smallest = |factor: usize| factor * least.div_ceil(factor).next_power_of_two();
    [2, 6, 10, 18, 30].into_iter().map(smallest).min().unwrap_or(least)
}

/// Offset and height of the maximum of a cosine through three points one sample apart, the highest inside.
fn cosine_peak(before: f64, top: f64, after: f64) -> (f64, f64) {
    let (left, right) = (top - before, top - after);
    let one_minus_cos = 0.5 * (left + right) / top;
    if one_minus_cos <= FLAT || one_minus_cos >= 2.0 {
        return (0.0, top);
    }
    let step = (1.0 - one_minus_cos).acos();
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
    let tan = (left - right) / (2.0 * top * sin);
    // No correlation exceeds one, though a jagged peak may suggest it.
    ((tan.atan() / step).clamp(-0.5, 0.5), (top * tan.hypot(1.0)).min(1.0))
}

/// A signal some samples later: a cubic through four of its samples, a line at its ends.
struct Between {
    /// Whole samples, and the rest.
    whole: isize,
    t: f64,
    /// Of the four samples around.
    weights: [f64; 4],
}

impl Between {
    fn new(lag: f64) -> Self {
        let t = lag - lag.floor();
        let (before, after) = (t + 1.0, t - 1.0);
        let beyond = t - 2.0;
        let weights = [
            t * after * beyond / -6.0,
            before * after * beyond / 2.0,
            before * t * beyond / -2.0,
            before * t * after / 6.0,
        ];
        Self { whole: lag.floor() as isize, t, weights }
    }

    /// The value later than sample `i`, if the signal reaches so far.
    fn value(&self, signal: &[f64], i: usize) -> Option<f64> {
        let left = i.checked_add_signed(self.whole)?;
        if let Some([a, b, c, d]) = left.checked_sub(1).and_then(|first| signal.get(first..first + 4)) {
            let [of_a, of_b, of_c, of_d] = self.weights;
            return Some((of_a * a + of_d * d) + (of_b * b + of_c * c));
        }
        let value = *signal.get(left)?;
        if self.t == 0.0 { Some(value) } else { Some(value + self.t * (signal.get(left + 1)? - value)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::nrmse;
    use std::f64::consts::{PI, TAU};

    /// Pairs of a signal and the same `delay` samples later, sampled from a formula.
    fn delayed(n: usize, delay: f64, formula: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        (0..n).map(|i| (formula(i as f64), formula(i as f64 - delay))).unzip()
    }

    #[test]
    fn a_sine_is_exact_between_samples() {
        for (samples_per_cycle, tolerance) in [(4.5, 1e-2), (17.3, 2e-3), (400.0, 1e-3)] {
            for delay in [0.0, 0.25, -0.37, 1.49] {
                let (c, m) = delayed(4000, delay, |i| 3.0 * (TAU * i / samples_per_cycle).sin());
                let found = lag(&c, &m).unwrap();
                assert!((found - delay).abs() < tolerance, "{delay} at {samples_per_cycle}: {found}");
            }
        }
    }

    #[test]
    fn a_sweep_and_a_pulse_are_found_within_their_record() {
        let sweep = |i: f64| (PI * 10.0 / 32.0 * (i / 512.0) * (i / 512.0)).sin();
        let pulse = |i: f64| (-((i - 700.0) / 30.0) * ((i - 700.0) / 30.0)).exp();
        for delay in [0.0, 2.5, -2.5, 100.25, -0.125] {
            let (c, m) = delayed(16_384, delay, |i| sweep(i + 600.0));
            assert!((lag(&c, &m).unwrap() - delay).abs() < 2e-2, "sweep, {delay}: {}", lag(&c, &m).unwrap());
            let (c, m) = delayed(1501, delay, pulse);
            assert!((lag(&c, &m).unwrap() - delay).abs() < 1e-4, "pulse, {delay}: {}", lag(&c, &m).unwrap());
        }
        let (c, m) = delayed(1501, 3.0, |i| if i == 700.0 { 1.0 } else { 0.0 });
        assert_eq!(delay(&c, &m, 100.0).unwrap(), 0.03);
    }

    #[test]
    fn removing_the_delay_leaves_the_gain_error() {
        let (c, m) = delayed(4096, 12.3, |i| (TAU * i / 200.0).sin());
        let m: Vec<f64> = m.iter().map(|m| 1.02 * m).collect();
        assert!(nrmse(&c, &m).unwrap() > 0.35);
        let removed = |m: &[f64]| nrmse_at_lag(&c, m, lag(&c, m).unwrap()).unwrap();
        assert!((removed(&m) - 0.02).abs() < 1e-4);
        assert!(removed(&c) < 1e-12);
    }

    #[test]
    fn a_constant_command_has_no_delay_and_no_response_is_an_error() {
        assert_eq!(delay(&[2.0; 50], &[1.9; 50], 10.0).unwrap(), 0.0);
        assert_eq!(delay(&[2.0], &[1.0], 10.0).unwrap(), 0.0);
        let text = |c: &[f64], m: &[f64]| delay(c, m, 10.0).unwrap_err().to_string();
        assert!(text(&[1.0, 2.0], &[0.0, 0.0]).contains("has no delay"));
        assert!(text(&[0.0, 0.0], &[1.0, 0.0]).contains("command"));
        assert!(text(&[1.0; 9], &[-1.0; 9]).contains("opposed"));
        assert!(text(&[1e200, 0.0], &[1e200, 0.0]).contains("too large"));
        assert!(delay(&[1.0], &[1.0], 0.0).is_err());
    }
}
