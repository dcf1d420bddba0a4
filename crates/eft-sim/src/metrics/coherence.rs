//! The part of a measured signal that is linear in the command, by Welch's averaged periodograms.

use super::pair::{check, in_range};
use crate::fourier::{Complex64, spectrum};
use crate::{Result, checks};
use std::f64::consts::TAU;

/// Bins with less than this part of the largest power contain rounding errors only.
const EMPTY_BIN: f64 = 1e-24;

/// Magnitude-squared coherence over frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Coherence {
    /// Frequency of each bin, in Hz.
    pub frequency: Vec<f64>,
    /// `|S_cm|² / (S_cc·S_mm)` in each bin, dimensionless, within 0 and 1.
    pub coherence: Vec<f64>,
}

/// Magnitude-squared coherence of command and measured signal, dimensionless, from segments of `segment`
/// samples.
///
/// Segments overlap by half. Their mean is removed, and they are weighted by Hann's window (periodic form).
/// Bins in which either signal has less than 1e-24 of its largest power are left out.
///
/// # Errors
/// When the signals are empty, unequal in length or not finite, the command is zero throughout, the sample
/// rate is not positive and finite, or `segment` is below 2 or leaves fewer than two segments, because one
/// segment always has the coherence 1.
pub fn coherence(command: &[f64], measured: &[f64], sample_rate: f64, segment: usize) -> Result<Coherence> {
    check(command, measured)?;
    checks::sample_rate("sample_rate", sample_rate)?;
    let hop = segment - segment / 2;
    let fits = segment >= 2 && segment.saturating_add(hop) <= command.len();
    let allowed = format!("must be at least 2 and leave two segments in {} samples", command.len());
    checks::require(fits, "segment", segment, allowed)?;
    let window: Vec<f64> =
        (0..segment).map(|i| 0.5 - 0.5 * (TAU * i as f64 / segment as f64).cos()).collect();
    let bins = segment / 2 + 1;
    let (mut cc, mut mm, mut cm) = (vec![0.0; bins], vec![0.0; bins], vec![Complex64::default(); bins]);
    for start in (0..=command.len() - segment).step_by(hop) {
        let x_c = windowed_spectrum(&command[start..start + segment], &window)?;
        let x_m = windowed_spectrum(&measured[start..start + segment], &window)?;
        for (k, (c, m)) in x_c.iter().zip(&x_m).enumerate() {
            cc[k] += c.norm_sqr();
            mm[k] += m.norm_sqr();
            cm[k] += c.conj() * m;
        }
    }
    let largest = |power: &[f64]| power.iter().fold(0.0, |largest: f64, p| largest.max(*p));
    let (least_c, least_m) = (EMPTY_BIN * largest(&cc), EMPTY_BIN * largest(&mm));
    let mut answer = Coherence { frequency: Vec::new(), coherence: Vec::new() };
    for k in (0..bins).filter(|k| cc[*k] > least_c && mm[*k] > least_m) {
        let ratio = in_range("coherence", cm[k].norm_sqr() / (cc[k] * mm[k]))?;
        answer.frequency.push(k as f64 * sample_rate / segment as f64);
        // By rounding, the ratio may exceed the limit of the Cauchy–Schwarz inequality.
        answer.coherence.push(if ratio > 1.0 { 1.0 } else { ratio });
    }
    let allowed = "one frequency at least must be in both";
    checks::require(!answer.frequency.is_empty(), "command, measured", "constant", allowed)?;
    Ok(answer)
}

fn windowed_spectrum(segment: &[f64], window: &[f64]) -> Result<Vec<Complex64>> {
    let mean = segment.iter().sum::<f64>() / segment.len() as f64;
    let weighted: Vec<f64> = segment.iter().zip(window).map(|(v, w)| w * (v - mean)).collect();
    spectrum(&weighted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(n: usize) -> (Vec<f64>, Vec<f64>) {
        let pair = |i: usize| {
            let i = i as f64;
            let c = (0.3 * i).sin() + 0.5 * (1e-3 * i * i).sin();
            (c, 0.8 * (0.3 * i - 0.4).sin() + 0.2 * (2e-3 * i * i + 1.0).sin())
        };
        (0..n).map(pair).unzip()
    }

    /// Values of `scipy.signal.coherence` 1.17.1 with the same segments, overlap and window.
    #[test]
    fn agrees_with_scipy_for_even_and_odd_segments() {
        let (c, m) = signals(1000);
        let even = [
            (0, 0.8405974715560942),
            (5, 0.9154986056982051),
            (6, 0.9890776140914459),
            (50, 0.003591835657742011),
        ];
        let odd = [
            (0, 0.5922889907732845),
            (5, 0.9858608352457001),
            (40, 0.09543881335221314),
            (50, 0.11913051007886284),
        ];
        for (segment, values) in [(128, even), (101, odd)] {
            let found = coherence(&c, &m, 50.0, segment).unwrap();
            assert_eq!(found.frequency.len(), segment / 2 + 1);
            for (k, expected) in values {
                assert!((found.coherence[k] - expected).abs() < 1e-9, "{k}: {}", found.coherence[k]);
                assert!((found.frequency[k] - 50.0 * k as f64 / segment as f64).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_linear_response_is_coherent_and_too_few_segments_are_refused() {
        let (c, _) = signals(1000);
        let found = coherence(&c, &c.iter().map(|c| -3.0 * c).collect::<Vec<_>>(), 50.0, 200).unwrap();
        assert!(found.coherence.iter().all(|c| *c > 1.0 - 1e-12 && *c <= 1.0));
        for segment in [0, 1, 667, 1000, usize::MAX] {
            assert!(coherence(&c, &c, 50.0, segment).unwrap_err().to_string().starts_with("segment = "));
        }
        assert!(coherence(&[1.0; 10], &[1.0; 10], 1.0, 4).unwrap_err().to_string().contains("constant"));
    }
}
