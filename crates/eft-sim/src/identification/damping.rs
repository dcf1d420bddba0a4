//! Damping from free vibration, by the decay of a fitted sinusoid.

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};

use super::Estimate;
use super::clipping::check_unclipped;
use super::gaps::detrend;
use crate::fourier::spectrum;
use crate::{Error, Result, checks};

/// Least number of cycles that distinguishes decay from drift.
const LEAST_CYCLES: usize = 3;
/// Numbers of frequencies on either side of the vibration's that show the noise about it. Few show noise in a narrow
/// band, and many show it more surely.
const NEIGHBOURS: [f64; 2] = [3.0, 8.0];
/// Number of cycles below which the deviation mostly stands for noise that the fit takes for vibration. Measured in
/// noise of a band as wide as half the frequency, where the deviation without it is too small by 1.7 with three cycles.
const HIDDEN: f64 = 4.5;
/// Change of the damping, in deviations, that noise does not make.
const SIGNIFICANT: f64 = 3.0;

/// Damping and frequency from a free vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingEstimate {
    /// Damping ratio (1).
    pub ratio: Estimate,
    /// Natural frequency (Hz), undamped.
    pub frequency: Estimate,
    /// Logarithmic decrement (1): the logarithm of one peak over the next of the same sign.
    pub decrement: f64,
}

/// Damping and frequency of a free vibration sampled at a rate (Hz): `e^(−σt)·(a·cos ω_d t + b·sin ω_d t)`
/// with offset and drift, by least squares over all finite samples. The signal must begin after the release. The
/// uncertainties are those by noise with the spectrum that the residuals have about the frequency. With few cycles they
/// are larger, because the fit takes more of the noise near the frequency for vibration. A damping that changes from
/// the beginning to the end, as with friction, has the change in its uncertainty.
///
/// # Errors
/// A signal that is too short, constant, clipped, not one decaying oscillation, or shorter than three cycles.
pub fn identify_damping(displacement: &[f64], sample_rate: f64) -> Result<DampingEstimate> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let mut found = fitted(displacement, sample_rate)?;
    let decayed = sample_rate / (TAU * found.frequency.value * found.ratio.value);
    let (early, late) = displacement.split_at((displacement.len() / 2).min(decayed as usize));
    // A part may be too short, or at rest.
    if let (Ok(early), Ok(late)) = (fitted(early, sample_rate), fitted(late, sample_rate)) {
        let (early, late) = (early.ratio, late.ratio);
        let change = (late.value - early.value).abs();
        if change > SIGNIFICANT * early.uncertainty.hypot(late.uncertainty) {
            found.ratio.uncertainty = found.ratio.uncertainty.hypot(change);
        }
    }
    Ok(found)
}

/// The least squares over a whole signal.
fn fitted(displacement: &[f64], sample_rate: f64) -> Result<DampingEstimate> {
    let finite: Vec<usize> = (0..displacement.len()).filter(|i| displacement[*i].is_finite()).collect();
    let allowed = "must have at least 20";
    checks::require(finite.len() >= 20, "displacement", format!("{} samples", finite.len()), allowed)?;
    check_unclipped(&[("displacement", displacement)])?;
    let residual = detrend(displacement, |i| f64::from(displacement[i].is_finite()));
    let energy: f64 = residual.iter().map(|v| v * v).sum();
    checks::require(energy.is_normal(), "displacement", "constant", "must vibrate")?;
    let cycles = cycles(&residual);
    let allowed = format!("must have at least {LEAST_CYCLES}");
    checks::require(cycles >= LEAST_CYCLES, "displacement", format!("{cycles} cycles"), allowed)?;
    let duration = displacement.len() as f64 / sample_rate;
    let omega = TAU * cycles as f64 / duration;
    let half = residual.len() / 2;
    let rms = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>().sqrt();
    let decay = ((rms(&residual[..half]) / rms(&residual[half..]).max(1e-300)).ln() / (0.5 * duration))
        .clamp(0.0, omega);
    // The fit may miss the frequency from a start with strong damping, and the decay from one with weak
    // damping. Several starts are cheap.
    let starts = [decay, 0.3 * decay, 0.02 * omega, 0.1 * omega];
    let fits =
        starts.into_iter().filter_map(|start| refine(displacement, &finite, sample_rate, start, omega));
    let best = fits.min_by(|fit, other| fit.0.total_cmp(&other.0));
    let refused = |found: String| Error::value("displacement", found, "must be one decaying oscillation");
    let (cost, p, inverse) = best.ok_or_else(|| refused("no fit".into()))?;
    if cost > 0.25 * energy {
        return Err(refused(format!("{:.0} % of it is something else", 100.0 * cost / energy)));
    }
    let (sigma, damped) = (p[4], p[5]);
    let natural = sigma.hypot(damped);
    if sigma <= 0.0 {
        return Err(refused(format!("growth at {:.3} 1/s", -sigma)));
    }
    let mut remaining = vec![0.0; displacement.len()];
    for &i in &finite {
        remaining[i] = displacement[i] - model(&p, i as f64 / sample_rate).0;
    }
    let samples = finite.len() as f64;
    let cycles = damped * duration / TAU;
    let seen = variance_about(&remaining, samples, cycles, sigma * duration / TAU)?;
    let variance = seen * (1.0 + (HIDDEN / cycles).powi(2));
    let of = |by_sigma: f64, by_damped: f64| {
        let (a, b, c) = (inverse[(4, 4)], inverse[(4, 5)], inverse[(5, 5)]);
        (variance * (by_sigma * by_sigma * a + 2.0 * by_sigma * by_damped * b + by_damped * by_damped * c))
            .sqrt()
    };
    let cube = natural.powi(3);
    Ok(DampingEstimate {
        ratio: Estimate::new(sigma / natural, of(damped * damped / cube, -sigma * damped / cube)),
        frequency: Estimate::new(natural / TAU, of(sigma / natural, damped / natural) / TAU),
        decrement: TAU * sigma / damped,
    })
}

/// Variance of white noise with the mean power that residuals have about a frequency, that of `cycles` in their
/// duration and of a peak of half the width `spread`. Only this power acts on decay and frequency. Samples in gaps
/// are zero.
fn variance_about(residuals: &[f64], samples: f64, cycles: f64, spread: f64) -> Result<f64> {
    let output = spectrum(residuals)?;
    let of = |reach: f64| {
        let (first, end) =
            ((cycles - reach).round().max(1.0) as usize, (cycles + reach).round() as usize + 1);
        let power: Vec<f64> = output.iter().take(end).skip(first).map(|bin| bin.norm_sqr()).collect();
        // Amplitude, phase, decay and frequency of the fit take the noise of two frequencies, the drift of half a one.
        power.iter().sum::<f64>() / (samples * (power.len() as f64 - 2.5).max(0.5))
    };
    Ok(NEIGHBOURS.map(|least| of(least.max(2.0 * spread))).into_iter().fold(0.0, f64::max))
}

/// Number of cycles in the signal of its strongest frequency, that of a whole number of cycles.
fn cycles(signal: &[f64]) -> usize {
    let Ok(output) = spectrum(signal) else { return 0 };
    let peak = (1..output.len()).max_by(|a, b| output[*a].norm_sqr().total_cmp(&output[*b].norm_sqr()));
    peak.unwrap_or(0)
}

/// Displacement at a time (s) by the parameters of the fit, and its derivatives by them.
fn model(p: &SVector<f64, 6>, t: f64) -> (f64, SVector<f64, 6>) {
    let decay = (-p[4] * t).exp();
    let (sin, cos) = (p[5] * t).sin_cos();
    let wave = decay * (p[0] * cos + p[1] * sin);
    let quadrature = decay * (p[1] * cos - p[0] * sin);
    let by = [decay * cos, decay * sin, 1.0, t, -t * wave, t * quadrature];
    (wave + p[2] + p[3] * t, SVector::from(by))
}

type Fitted = (f64, SVector<f64, 6>, SMatrix<f64, 6, 6>);

/// Levenberg–Marquardt on (a, b, offset, drift, σ, ω_d): cost, parameters, inverse normal matrix.
fn refine(signal: &[f64], finite: &[usize], sample_rate: f64, sigma: f64, omega: f64) -> Option<Fitted> {
    let mut p = SVector::<f64, 6>::from_column_slice(&[0.0, 0.0, 0.0, 0.0, sigma, omega]);
    let system = |p: &SVector<f64, 6>| {
        let (mut normal, mut right, mut cost) =
            (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros(), 0.0);
        for &i in finite {
            let (value, row) = model(p, i as f64 / sample_rate);
            let residual = signal[i] - value;
            for j in 0..6 {
                for i in j..6 {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
            right += row * residual;
            cost += residual * residual;
        }
        (normal, right, cost)
    };
    let mut damping = 1e-3;
    let (mut normal, mut right, mut cost) = system(&p);
    for round in 0..100 {
        let mut raised = normal;
        for i in 0..6 {
            raised[(i, i)] *= 1.0 + damping;
            // Without an amplitude the last two parameters have no effect until the first step.
            if raised[(i, i)] == 0.0 {
                raised[(i, i)] = 1.0;
            }
        }
        let step = raised.cholesky()?.solve(&right);
        let next = p + step;
        let (n, r, c) = system(&next);
        if c.is_finite() && c <= cost {
            let settled = round > 2 && cost - c <= 1e-14 * cost;
            (p, normal, right, cost) = (next, n, r, c);
            damping = (damping * 0.2).max(1e-12);
            if settled {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    normal.fill_upper_triangle_with_lower_triangle();
    Some((cost, p, normal.try_inverse()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vibration(zeta: f64, frequency: f64, noise: f64) -> Vec<f64> {
        let omega = TAU * frequency;
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let wobble = |i: usize| ((i * 7919 + 13) % 1000) as f64 / 500.0 - 1.0;
        (0..8000)
            .map(|i| {
                let t = i as f64 / 500.0;
                0.02 * (-zeta * omega * t).exp() * (damped * t).cos() + 1e-3 + 2e-5 * t + noise * wobble(i)
            })
            .collect()
    }

    #[test]
    fn damping_and_frequency_are_found_with_offset_drift_noise_and_gaps() {
        for (zeta, frequency) in [(0.031, 1.58), (0.005, 3.0), (0.1, 1.0)] {
            let clean = identify_damping(&vibration(zeta, frequency, 0.0), 500.0).unwrap();
            assert!((clean.ratio.value / zeta - 1.0).abs() < 1e-6, "{clean:?}");
            assert!((clean.frequency.value / frequency - 1.0).abs() < 1e-8);
            let mut noisy = vibration(zeta, frequency, 4e-4);
            noisy[100..150].fill(f64::NAN);
            let found = identify_damping(&noisy, 500.0).unwrap();
            assert!((found.ratio.value / zeta - 1.0).abs() < 0.02, "{zeta}: {found:?}");
            assert!((found.ratio.value - zeta).abs() < 5.0 * found.ratio.uncertainty);
        }
    }

    #[test]
    fn the_truth_is_within_two_deviations_with_noise_of_any_band() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let omega = TAU * 1.5;
        // White noise through w_i = 2·r·cos(φ)·w_(i−1) − r²·w_(i−2) + e_i.
        let (white, slow, near) = ((0.0, 0.0), (0.8, 0.0), (0.95, TAU * 1.7 / 50.0));
        for ((radius, angle), zeta, samples) in [
            (white, 0.03, 500),
            (white, 0.02, 105),
            (slow, 0.1, 300),
            (slow, 0.03, 500),
            (near, 0.03, 500),
            (near, 0.005, 1000),
            (near, 0.03, 105),
            (near, 0.1, 125),
            (near, 0.005, 175),
        ] {
            let damped = omega * f64::sqrt(1.0 - zeta * zeta);
            let mut found = Vec::new();
            // Where few cycles are seen the share within two deviations is nearest to its bound.
            let draws = if samples < 200 { 200 } else { 100 };
            for _ in 0..draws {
                let (mut last, mut before, phase) = (0.0, 0.0, TAU * uniform());
                let mut value = |i: i32| {
                    let next = 2.0 * radius * f64::cos(angle) * last - radius * radius * before + uniform();
                    (before, last) = (last, next);
                    let t = f64::from(i) / 50.0;
                    (-zeta * omega * t).exp() * (damped * t + phase).cos() + 0.01 * next
                };
                let signal: Vec<f64> = (-100..samples).map(&mut value).collect();
                found.push(identify_damping(&signal[100..], 50.0).unwrap());
            }
            let ratios: Vec<Estimate> = found.iter().map(|one| one.ratio).collect();
            let frequencies: Vec<Estimate> = found.iter().map(|one| one.frequency).collect();
            for (estimates, truth) in [(ratios, zeta), (frequencies, 1.5)] {
                let errors = || estimates.iter().map(|one| ((one.value - truth).abs(), one.uncertainty));
                let within = errors().filter(|(error, stated)| *error < 2.0 * stated).count();
                let (error, stated) = errors().fold((0.0, 0.0), |sum, (e, u)| (sum.0 + e * e, sum.1 + u * u));
                let times = f64::sqrt(stated / error);
                assert!(
                    10 * within >= 9 * draws && times < 2.2,
                    "{radius} {zeta} {samples}: {within} of {draws}, {times:.2}"
                );
            }
        }
    }

    #[test]
    fn three_cycles_suffice_at_every_sample_rate_and_two_do_not() {
        for rate in [410, 412, 413, 500] {
            let rate = f64::from(rate);
            let of = |cycles: f64| {
                let value = |i: usize| {
                    let turn = TAU * cycles * i as f64 / 1000.0;
                    (-0.02 * turn).exp() * turn.cos()
                };
                identify_damping(&(0..1000).map(value).collect::<Vec<_>>(), rate)
            };
            assert!((of(3.0).unwrap().ratio.value - 0.02).abs() < 1e-4, "{rate} Hz");
            let said = of(2.0).unwrap_err().to_string();
            assert_eq!(said, "displacement = 2 cycles: must have at least 3");
        }
    }

    #[test]
    fn a_vibration_that_does_not_decay_is_refused() {
        let text = |signal: &[f64]| identify_damping(signal, 500.0).unwrap_err().to_string();
        assert!(text(&[1.0; 10]).contains("at least 20"));
        assert!(text(&[1.0; 1000]).contains("must vibrate"));
        let grows: Vec<f64> = vibration(0.01, 2.0, 0.0).iter().rev().map(|v| v - 1e-3).collect();
        assert!(text(&grows).contains("must be one decaying oscillation"));
        let mut state = 1_u64;
        let random = |_: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64
        };
        let noise: Vec<f64> = (0..2000).map(random).collect();
        assert!(text(&noise).contains("must be one decaying oscillation"), "{}", text(&noise));
    }
}
