//! Response delay: the slope of the phase of response over command against frequency (Fig. 4a of the paper).

use std::f64::consts::TAU;

use super::gaps::{Fade, check, detrend};
use crate::checks;
use crate::error::{Error, Result};
use crate::fourier::{Complex64, spectrum};

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
/// Samples that are not finite in either signal are gaps. Both signals are faded at them and at the ends of the
/// recording. A response that is faded at the same time as its command seems less late than it is. So the fading of the
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
    check(("command", "response"), (command.len(), response.len()), 16)?;
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::band(band, sample_rate)?;
    let (low, high) = band;
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
    if ends > MOST_FROM_ENDS {
        let found = format!(
            "{:.0} % of its power within {low} to {high} Hz from the ends of the recording",
            1e2 * ends
        );
        return Err(Error::value("command", found, "must excite the band: choose the band of the test"));
    }
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
    if found.intercept.cos() < -LEAST_ALIKE {
        let angle = found.intercept.cos().acos().to_degrees();
        let found = format!("the opposite of the command: {angle:.0}° at zero frequency");
        let allowed = "must have the sign of the command: check the wiring of both";
        return Err(Error::value("response", found, allowed));
    }
    found.uncertainty = found.uncertainty.hypot(found.delay - delay) / signals;
    Ok(found)
}

/// Indices of the frequencies within the band (Hz) that a spectrum with this distance (Hz) of its bins has.
fn excited(spectrum: &[Complex64], width: f64, (low, high): (f64, f64)) -> Result<Vec<usize>> {
    let first = ((low / width - 1e-9).ceil() as usize).max(1);
    let last = ((high / width + 1e-9).floor() as usize).min(spectrum.len() - 1);
    let strongest = (first..=last).map(|k| spectrum[k].norm_sqr()).fold(0.0, f64::max);
    let bins: Vec<usize> = (first..=last).filter(|k| spectrum[*k].norm_sqr() > EXCITED * strongest).collect();
    if bins.len() < LEAST_BINS || !strongest.is_normal() {
        let found = format!("{} excited frequencies within {low} to {high} Hz", bins.len());
        let allowed = format!("must excite at least {LEAST_BINS}: use a longer sweep or a wider band");
        return Err(Error::value("command", found, allowed));
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_motion::excitation::sine_sweep;

    const RATE: f64 = 1000.0;
    const BAND: (f64, f64) = (0.25, 10.0);

    /// A 0–10 Hz sweep, and the same sweep delayed.
    fn late(delay: f64) -> (Vec<f64>, Vec<f64>) {
        let sweep = |shift: f64| {
            let value = |i: usize| {
                let t = i as f64 / RATE - shift;
                (TAU * 0.5 * 10.0 / 32.0 * t * t).sin()
            };
            (0..32_000).map(value).collect()
        };
        (sweep(0.0), sweep(delay))
    }

    #[test]
    fn a_pure_delay_of_either_sign_and_of_many_periods_is_found() {
        for delay in [0.0, 4.7e-3, -3e-3, 0.3] {
            let (x, y) = late(delay);
            let found = identify_delay(&x, &y, RATE, BAND).unwrap();
            assert!((found.delay - delay).abs() < 1e-4 + 0.01 * delay.abs(), "{delay}: {found:?}");
            assert!(found.coherence > 0.9);
        }
    }

    #[test]
    fn gaps_offset_and_drift_do_not_change_the_result() {
        let (x, mut y) = late(5e-3);
        let clean = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
        y.iter_mut().enumerate().for_each(|(i, v)| *v = 0.2 * *v + 3.0 + 1e-4 * i as f64);
        for gap in [3000..3100, 12_000..13_000, 20_000..20_003] {
            y[gap].fill(f64::NAN);
        }
        let found = identify_delay(&x, &y, RATE, BAND).unwrap().delay;
        assert!((found - clean).abs() < 0.02 * clean, "{found}, without {clean}");
    }

    /// Normal noise of deviation 1, as a sum of twelve uniform numbers.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn a_band_that_only_the_ends_of_the_recording_excite_is_refused() {
        for (band, duration) in [
            ((60.0, 80.0), 2.0),
            ((30.0, 100.0), 2.0),
            ((60.0, 80.0), 2.1),
            ((60.0, 80.0), 3.0),
            ((6.0, 30.0), 2.0),
        ] {
            let command = sine_sweep(1.0, 0.0, 5.0, duration, RATE).unwrap().values;
            let response: Vec<f64> = (0..command.len()).map(|i| 0.9 * command[i.saturating_sub(4)]).collect();
            let said = identify_delay(&command, &response, RATE, band).unwrap_err().to_string();
            assert!(
                said.starts_with("command = ") && said.contains("from the ends of the recording"),
                "{said}"
            );
            let inside = identify_delay(&command, &response, RATE, (0.5, 5.0)).unwrap();
            assert!((inside.delay - 4e-3).abs() < 4.0 * inside.uncertainty.max(2e-4), "{inside:?}");
        }
        // An impulse at the first sample and noise excite every band, and so does a step, whose trend is removed.
        let mut noise = noise(3);
        let impulse: Vec<f64> = (0..4000).map(|i| f64::from(i < 3)).collect();
        let step: Vec<f64> = (0..4000).map(|i| f64::from(i > 200)).collect();
        let white: Vec<f64> = (0..4000).map(|_| noise()).collect();
        for (command, known) in [(impulse, true), (white, true), (step, false)] {
            let response: Vec<f64> = (0..4000).map(|i| if i < 4 { 0.0 } else { command[i - 4] }).collect();
            for band in [(0.5, 10.0), (60.0, 80.0)] {
                let found = identify_delay(&command, &response, RATE, band).unwrap();
                let right = (found.delay - 4e-3).abs() < 4.0 * found.uncertainty.max(2e-4);
                assert!(right || !known, "{band:?}: {found:?}");
            }
        }
    }

    /// Motion of an oscillator under a sweep, noise or a sine that grows, cut from a longer recording.
    fn resonant(seed: u64, noise: &mut impl FnMut() -> f64) -> Vec<f64> {
        let part = |n: u64| (seed * n % 97) as f64 / 97.0;
        let (samples, before) = ((4e3 * (1.0 + 6.0 * part(31))) as usize, 1000);
        let (natural, damping) = (1.0 + 7.0 * part(13), 0.005 + 0.05 * part(29));
        // A sweep that ends within the resonance.
        let highest = natural * (0.9 + 0.2 * part(41));
        let (turn, fade) = (TAU * natural / RATE, (-damping * TAU * natural / RATE).exp());
        let (mut last, mut before_last) = (0.0, 0.0);
        let mut response = Vec::with_capacity(samples + before);
        for i in 0..samples + before {
            let t = i as f64 / RATE;
            let sweep = (0.5 * TAU * highest * t * t * RATE / (samples + before) as f64).sin();
            let drive = if seed.is_multiple_of(2) { sweep } else { noise() };
            let value = 2.0 * fade * turn.cos() * last - fade * fade * before_last + drive;
            (before_last, last) = (last, value);
            response.push(value);
        }
        response.split_off(before - 8)
    }

    #[test]
    fn the_uncertainty_holds_where_a_recording_ends_in_motion() {
        let mut noise = noise(11);
        let (mut within, mut square) = (0, 0.0);
        for seed in 0..100 {
            let motion = resonant(seed, &mut noise);
            let (late, command) = ((seed % 6) as usize, &motion[8..]);
            let largest = motion.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let size = 2e-3 * (seed % 7) as f64 / 6.0 * largest + 1e-9 * largest;
            let response: Vec<f64> =
                (0..command.len()).map(|i| 0.7 * motion[8 + i - late] + size * noise()).collect();
            let found = identify_delay(command, &response, RATE, BAND).unwrap();
            let off = (found.delay - late as f64 / RATE) / found.uncertainty;
            within += u32::from(off.abs() < 2.0);
            square += off * off / 100.0;
        }
        assert!((90..=99).contains(&within) && square > 0.3, "{within} within two deviations, {square}");
    }

    #[test]
    fn a_single_frequency_is_refused_or_has_the_right_delay() {
        let mut noise = noise(7);
        let mut refused = 0;
        for seed in 0..200 {
            let part = |n: u64| (seed * n % 97) as f64 / 97.0;
            let (samples, frequency) = ((3e3 + 1.7e4 * part(31)) as usize, 0.5 + 5.5 * part(13));
            let damping = if seed % 2 == 0 { 0.0 } else { 0.001 + 0.03 * part(29) };
            let angle = |i: usize| TAU * frequency * i as f64 / RATE;
            let motion: Vec<f64> = (0..samples + 14)
                .map(|i| (angle(i) + 6.0 * part(41)).sin() * (-damping * angle(i)).exp())
                .collect();
            let (late, size) = (1 + (seed % 14) as usize, [0.0, 1e-4, 1e-3][(seed % 3) as usize]);
            let response: Vec<f64> = (0..samples).map(|i| motion[14 + i - late] + size * noise()).collect();
            match identify_delay(&motion[14..], &response, RATE, (0.25, 10.0)) {
                Err(error) => {
                    let said = error.to_string();
                    assert!(said.starts_with("command = ") && !said.contains("wiring"), "{seed}: {said}");
                    refused += 1;
                }
                Ok(found) => {
                    let off = (found.delay - late as f64 / RATE).abs();
                    assert!(off < 4.0 * found.uncertainty.max(1e-9), "{seed}: {off} s off, {found:?}");
                }
            }
        }
        assert!(refused > 20, "{refused}");
    }

    #[test]
    fn noise_alone_is_refused_in_a_narrow_band_as_well() {
        let command = sine_sweep(1.0, 0.0, 400.0, 4.0, RATE).unwrap().values;
        for bins in [8, 12, 20, 40] {
            let band = (200.0, 200.0 + f64::from(bins - 1) / 4.0);
            let accepted = (0..300).filter(|seed| {
                let mut noise = noise(1 + seed);
                let response: Vec<f64> = command.iter().map(|_| noise()).collect();
                identify_delay(&command, &response, RATE, band).is_ok()
            });
            let accepted = accepted.count();
            assert!(accepted <= 2, "{accepted} of 300, {bins} frequencies");
            // The same band of a response with little noise.
            let mut noise = noise(7);
            let late: Vec<f64> =
                (0..command.len()).map(|i| command[i.saturating_sub(3)] + 0.1 * noise()).collect();
            let found = identify_delay(&command, &late, RATE, band).unwrap();
            assert!((found.delay - 3e-3).abs() < 4.0 * found.uncertainty, "{bins} frequencies: {found:?}");
        }
    }

    #[test]
    fn the_uncertainty_is_the_scatter_by_noise() {
        let (x, y) = late(5e-3);
        let mut noise = noise(1);
        let (mut square, mut stated) = (0.0, 0.0);
        for _ in 0..30 {
            let noisy: Vec<f64> = y.iter().map(|v| v + 0.3 * noise()).collect();
            let found = identify_delay(&x, &noisy, RATE, BAND).unwrap();
            square += (found.delay - 5e-3).powi(2) / 30.0;
            stated += found.uncertainty / 30.0;
        }
        assert!((0.6..1.7).contains(&(square.sqrt() / stated)), "{} and {stated}", square.sqrt());
    }

    #[test]
    fn unusable_data_are_refused_with_the_reason() {
        let (x, y) = late(5e-3);
        let text = |x: &[f64], y: &[f64], band| identify_delay(x, y, RATE, band).unwrap_err().to_string();
        assert!(text(&x, &y[1..], BAND).starts_with("response = 31999 samples"));
        assert!(text(&x, &y, (0.25, 600.0)).starts_with("band = (0.25, 600)"));
        assert!(text(&[1.0; 32_000], &y, BAND).starts_with("command = "));
        assert!(text(&x, &[1.0; 32_000], BAND).starts_with("response = "));
        assert!(text(&x, &[f64::NAN; 32_000], BAND).contains("0 of 32000 samples outside gaps"));
        let opposite: Vec<f64> = y.iter().map(|y| 2.0 - 0.3 * y).collect();
        let text_of = text(&x, &opposite, BAND);
        assert!(
            text_of.contains("180° at zero frequency") && text_of.contains("check the wiring"),
            "{text_of}"
        );
        let other = sine_sweep(1.0, 8.0, 0.3, 32.0, RATE).unwrap().values;
        assert!(text(&x, &other, BAND).contains("must follow the command"));
    }
}
