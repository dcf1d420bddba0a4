//! Response delay: the slope of the phase of response over command against frequency (Fig. 4a of the paper).

#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use super::gaps::{Fade, bridged, check, detrend};
use crate::fourier::{Complex64, spectrum};
use crate::{Error, Result, checks};

/// A bin with less than this part of the band's largest power is not excited.
const EXCITED: f64 = 1e-4;
/// Least number of excited bins for a line.
const LEAST_BINS: usize = 8;
/// Cosine beyond which a phase at zero frequency is that of a wrong sign. A band far above zero leaves the phase uncertain.
const LEAST_ALIKE: f64 = 0.5;
/// Largest share of the power in the band that the ends of the recording may have. Beyond, the phases in the band are
/// those of frequencies outside it.
const MOST_FROM_ENDS: f64 = 0.7;
/// Largest share of the delay by which the fading alone may move the estimate.
const MOST_BY_FADING: f64 = 0.95;
/// Longest gap that is bridged, over the period of the band's highest frequency.
const BRIDGED: f64 = 0.1;
/// Largest number of corrections of the fading.
const ROUNDS: usize = 30;
/// Coherence below which phases count as random.
const LEAST_COHERENCE: f64 = 0.6;
/// Coherence that is enough for any number of frequencies.
const RESONANT: f64 = 0.99;
/// Probability with which random phases may have more than the least coherence.
const CHANCE: f64 = 1e-3;

/// A response delay with the data of its fit.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayEstimate {
    /// The delay (s), positive if the response lags.
    pub delay: f64,
    /// Its standard uncertainty (s), from the scatter of the phases about their line, larger where the ends of the
    /// recording have much of the power.
    pub uncertainty: f64,
    /// Phase (rad) of the line at zero frequency.
    pub intercept: f64,
    /// Coherence of the phases with the line: 1 for exact phases, 0 for random ones.
    pub coherence: f64,
    /// Frequencies (Hz) of the excited bins.
    pub frequency: Vec<f64>,
    /// Phase lag (rad) of the response at these frequencies, unwrapped.
    pub lag: Vec<f64>,
}

/// The delay of a response behind its command, sampled at a rate (Hz), over a band (Hz): a linear regression
/// of phase on frequency with an intercept. Each bin is weighted by the command's power.
///
/// Samples that are not finite in either signal are gaps. Gaps of up to a tenth of the period of the band's highest frequency
/// are bridged by straight lines. Both signals are faded at longer ones and at the ends of the recording. A response that is faded at the same time as its command seems less late than it is. So the fading of the
/// command leads that of the response by the delay, which is found in rounds.
///
/// # Errors
/// Unequal or too short signals, a band outside 0 to half the rate, more gaps than samples, a command that does not
/// excite the band, or a response that does not follow it or has the opposite sign.
pub fn identify_delay(
    command: &[f64],
    response: &[f64],
    sample_rate: f64,
    band: (f64, f64),
) -> Result<DelayEstimate> {
    check([("command", command), ("response", response)], 16)?;
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::band(band, sample_rate)?;
    let (low, high) = band;
    let most = (BRIDGED * sample_rate / high) as usize;
    let (command, response) = (&*bridged(command, most), &*bridged(response, most));
    let width = sample_rate / command.len() as f64;
    let at = |delay: f64| {
        let fade = Fade::of(command, response, 2.0 * sample_rate / high, delay * sample_rate)?;
        let x = spectrum(&fade.of_command(command))?;
        let y = spectrum(&fade.of_response(response))?;
        let bins = excited(&x, width, band)?;
        let cross: Vec<(f64, Complex64)> =
            bins.iter().map(|&k| (k as f64 * width, y[k] * x[k].conj())).collect();
        let mut found = fit(&cross, &bins.iter().map(|&k| x[k].norm_sqr()).collect::<Vec<_>>(), width)?;
        found.uncertainty *= fade.inflation().sqrt();
        Ok::<_, Error>(found)
    };
    let start = at(0.0)?;
    let plain = detrend(command, |i| f64::from(command[i].is_finite() && response[i].is_finite()));
    let x = spectrum(&plain)?;
    let ends = from_ends(&plain, &x, &excited(&x, width, band)?);
    let (most_from_ends, share) = (ends > MOST_FROM_ENDS, 1e2 * ends);
    let found = format!("{share:.0} % of its power within {low} to {high} Hz from the ends of the recording");
    let allowed = "must excite the band: choose the band of the test";
    checks::require(!most_from_ends, "command", found, allowed)?;
    let few = |found: String| {
        Error::value("command", found, "must excite a range of frequencies: use a sweep or noise")
    };
    let duration = command.len() as f64 / sample_rate;
    let moved = |delay| at(delay).map_err(|_| few(format!("no delay that fits into its {duration:.3} s")));
    let (mut delay, step) = (start.delay, 1.0 / sample_rate);
    let mut found = moved(delay)?;
    // The estimate moves with the fading by this share. Near 1 it has the delay of the fading alone.
    let by_fading = (moved(delay + step)?.delay - found.delay) / step;
    if by_fading.is_nan() || by_fading > MOST_BY_FADING {
        return Err(few(format!("a delay that follows the fading of its ends by {:.0} %", 1e2 * by_fading)));
    }
    let signals = 1.0 - by_fading.max(0.0);
    let mut rounds = 0;
    while (found.delay - delay).abs() > (0.01 * found.uncertainty).max(1e-6 * step) && rounds < ROUNDS {
        delay += (found.delay - delay) / signals;
        found = moved(delay)?;
        rounds += 1;
    }
    let alike = found.intercept.cos();
    let is_opposite = alike < -LEAST_ALIKE;
    let turned = format!("the opposite of the command: {:.0}° at zero frequency", alike.acos().to_degrees());
    let allowed = "must have the sign of the command: check the wiring of both";
    checks::require(!is_opposite, "response", turned, allowed)?;
    found.uncertainty = found.uncertainty.hypot(found.delay - delay) / signals;
    Ok(found)
}

/// Indices of the frequencies within the band (Hz) that a spectrum with this distance (Hz) of its bins has.
fn excited(spectrum: &[Complex64], width: f64, (low, high): (f64, f64)) -> Result<Vec<usize>> {
    let first = ((low / width - 1e-9).ceil() as usize).max(1);
    let last = ((high / width + 1e-9).floor() as usize).min(spectrum.len() - 1);
    let strongest = (first..=last).map(|k| spectrum[k].norm_sqr()).fold(0.0, f64::max);
    let bins: Vec<usize> = (first..=last).filter(|k| spectrum[*k].norm_sqr() > EXCITED * strongest).collect();
    let found = format!("{} excited frequencies within {low} to {high} Hz", bins.len());
    let allowed = format!("must excite at least {LEAST_BINS}: use a longer sweep or a wider band");
    checks::require(bins.len() >= LEAST_BINS && strongest.is_normal(), "command", found, allowed)?;
    Ok(bins)
}

/// Share of a signal's power in these bins that comes from the jump of value and slope from the last sample to the first,
/// which a response has without a delay.
fn from_ends(signal: &[f64], spectrum: &[Complex64], bins: &[usize]) -> f64 {
    let (n, last) = (signal.len(), signal.len() - 1);
    let jump = signal[0] - signal[last];
    let (first_slope, last_slope) = (signal[1] - signal[0], signal[last] - signal[last - 1]);
    let (mut all, mut rest) = (0.0, 0.0);
    for &k in bins {
        // The difference of successive samples, twice, is nothing else at the ends.
        let back = Complex64::from_polar(1.0, -TAU * k as f64 / n as f64);
        let difference = 1.0 - back;
        let ends = (jump + (first_slope * back - last_slope) / difference) / difference;
        all += spectrum[k].norm_sqr();
        rest += (spectrum[k] - ends).norm_sqr();
    }
    1.0 - rest / all
}

fn fit(cross: &[(f64, Complex64)], weights: &[f64], width: f64) -> Result<DelayEstimate> {
    let refuse = |found: String| {
        Err(Error::value("response", found, "must follow the command: its phases scatter at random"))
    };
    // The mean change of phase from bin to bin gives the delay within a fraction of a turn over the band. The
    // remaining phase needs no unwrapping.
    let turn: Complex64 = cross
        .windows(2)
        .filter(|pair| pair[1].0 - pair[0].0 < 1.5 * width)
        .map(|pair| pair[1].1 * pair[0].1.conj())
        .sum();
    let coarse = if turn.norm() > 0.0 { -turn.arg() / (TAU * width) } else { 0.0 };
    let straight = |&(f, s): &(f64, Complex64)| s * Complex64::from_polar(1.0, TAU * f * coarse);
    let mean: Complex64 = cross.iter().map(straight).sum();
    let size: f64 = cross.iter().map(|(_, s)| s.norm()).sum();
    if !(size > 0.0 && size.is_finite()) {
        return refuse("constant or beyond double precision".into());
    }
    let level = Complex64::from_polar(1.0, -mean.arg());
    let phases: Vec<f64> = cross.iter().map(|bin| (straight(bin) * level).arg()).collect();

    let total: f64 = weights.iter().sum();
    let weighted = |f: &dyn Fn(usize) -> f64| (0..cross.len()).map(|i| weights[i] * f(i)).sum::<f64>();
    let frequency_mean = weighted(&|i| cross[i].0) / total;
    let phase_mean = weighted(&|i| phases[i]) / total;
    let spread = weighted(&|i| (cross[i].0 - frequency_mean).powi(2));
    let slope = weighted(&|i| (cross[i].0 - frequency_mean) * (phases[i] - phase_mean)) / spread;
    let rest = |i: usize| phases[i] - phase_mean - slope * (cross[i].0 - frequency_mean);
    let variance = weighted(&|i| rest(i).powi(2)) / (cross.len() - 2) as f64;
    let along: Complex64 = (0..cross.len()).map(|i| Complex64::from_polar(cross[i].1.norm(), rest(i))).sum();
    let coherence = along.norm() / size;
    let least = least_coherence(size * size / cross.iter().map(|(_, s)| s.norm_sqr()).sum::<f64>());
    if coherence.is_nan() || coherence < least {
        let few = if least > LEAST_COHERENCE {
            format!(", of few frequencies below {least:.3}")
        } else {
            String::new()
        };
        return refuse(format!("coherence {coherence:.3}{few}"));
    }
    let delay = coarse - slope / TAU;
    let intercept = phase_mean - slope * frequency_mean - level.arg();
    Ok(DelayEstimate {
        delay,
        uncertainty: (variance / spread).sqrt() / TAU,
        intercept,
        coherence,
        frequency: cross.iter().map(|(f, _)| *f).collect(),
        lag: (0..cross.len()).map(|i| TAU * cross[i].0 * coarse - phases[i] + level.arg()).collect(),
    })
}

/// Least coherence of phases that are not random, from the number of frequencies that count alike.
///
/// The squared coherence of `n` random phases with a line of two parameters exceeds `c` with a probability of about
/// `n·(1 - c)^(n - 2)`.
fn least_coherence(n: f64) -> f64 {
    let random = 1.0 - libm::pow(CHANCE / n, 1.0 / (n - 2.0).max(0.0));
    // A resonance can have nearly all of the power. A response that follows it is more coherent than this.
    random.max(0.0).sqrt().clamp(LEAST_COHERENCE, RESONANT)
}
