//! Common commands: step, sine, burst, multisine, noise.

use std::f64::consts::{PI, TAU};

use super::{Command, sampled, samples};
use crate::fourier::{Complex64, signal_of};
use crate::instruments::Noise;
use crate::{Result, checks};

/// A force (N) of zero up to `start` (s), and of `amplitude` from there to the end of `duration` (s).
///
/// # Errors
/// If an argument is not finite, `duration` is not positive, `start` is not within it, or the `sample_rate`
/// (Hz) is outside its range.
pub fn step(amplitude: f64, start: f64, duration: f64, sample_rate: f64) -> Result<Command> {
    checks::finite("amplitude", amplitude, "N")?;
    let allowed = format!("must lie within 0 and the duration, {duration} s");
    checks::require((0.0..=duration).contains(&start), "start", start, allowed)?;
    sampled(duration, sample_rate, |t| if t >= start { amplitude } else { 0.0 })
}

/// A sine of one `frequency` (Hz), force in N.
///
/// # Errors
/// When an argument is not finite, the frequency is not within 0 and half the `sample_rate` (Hz), or `duration` (s) is
/// not positive.
pub fn sine(amplitude: f64, frequency: f64, duration: f64, sample_rate: f64) -> Result<Command> {
    checks::finite("amplitude", amplitude, "N")?;
    checks::within_nyquist("frequency", frequency, sample_rate)?;
    sampled(duration, sample_rate, |t| amplitude * libm::sin(TAU * frequency * t))
}

/// A number of `cycles` of a sine under a raised cosine, then zero until `duration` (s); force in N.
///
/// # Errors
/// As [`sine`]; cycles that are not positive, or longer than the duration.
pub fn burst(
    amplitude: f64,
    frequency: f64,
    cycles: f64,
    duration: f64,
    sample_rate: f64,
) -> Result<Command> {
    checks::finite("amplitude", amplitude, "N")?;
    checks::within_nyquist("frequency", frequency, sample_rate)?;
    checks::positive("frequency", frequency, "Hz")?;
    checks::positive("cycles", cycles, "")?;
    let length = cycles / frequency;
    let too_long = length > duration;
    let allowed = format!("must fit into {duration} s: at most {}", duration * frequency);
    checks::require(!too_long, "cycles", cycles, allowed)?;
    sampled(duration, sample_rate, |t| {
        let window = if t < length { 0.5 - 0.5 * libm::cos(TAU * t / length) } else { 0.0 };
        amplitude * window * libm::sin(TAU * frequency * t)
    })
}

/// Sines of the same amplitude at every multiple of `1/duration` in the band (Hz), with Schroeder's phases,
/// which give a low peak. The largest force is `amplitude` (N). The signal can be repeated without a jump.
///
/// # Errors
/// A band that is not within 0 and half the `sample_rate` (Hz), or contains no multiple; arguments that are
/// not finite.
pub fn multisine(amplitude: f64, band: (f64, f64), duration: f64, sample_rate: f64) -> Result<Command> {
    checks::finite("amplitude", amplitude, "N")?;
    let values = lines(band, duration, sample_rate, |n, count| {
        let n = n as f64;
        Complex64::cis(-PI * n * (n + 1.0) / count as f64)
    })?;
    let peak = values.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()));
    let factor = amplitude / peak;
    Command::new(values.iter().map(|value| factor * value).collect(), sample_rate)
}

/// Gaussian noise within a band (Hz) with the rms force `rms` (N). The same `seed` gives the same signal,
/// which can be repeated without a jump.
///
/// # Errors
/// As [`multisine`].
pub fn noise(rms: f64, band: (f64, f64), duration: f64, sample_rate: f64, seed: u64) -> Result<Command> {
    checks::finite("rms", rms, "N")?;
    let source = Noise::new(seed, 0);
    let values = lines(band, duration, sample_rate, |n, _| {
        let n = n as u64;
        Complex64::new(source.normal(2 * n), source.normal(2 * n + 1))
    })?;
    let squares: f64 = values.iter().map(|value| value * value).sum();
    let factor = rms / (squares / values.len() as f64).sqrt();
    Command::new(values.iter().map(|value| factor * value).collect(), sample_rate)
}

/// A signal whose spectrum has `line(n, count)` at the `n`-th of `count` lines within a band (Hz).
fn lines(
    (low, high): (f64, f64),
    duration: f64,
    sample_rate: f64,
    line: impl Fn(usize, usize) -> Complex64,
) -> Result<Vec<f64>> {
    let samples = samples(duration, sample_rate)?;
    checks::within_nyquist("f_low", low, sample_rate)?;
    checks::within_nyquist("f_high", high, sample_rate)?;
    let spacing = sample_rate / samples as f64;
    let mut spectrum = vec![Complex64::default(); samples / 2 + 1];
    // Without the mean and the last bin of an even length, which have no phase.
    let first = ((low / spacing).ceil() as usize).max(1);
    let last = ((high / spacing).floor() as usize).min((samples - 1) / 2);
    let allowed = format!("must hold a multiple of {spacing} Hz");
    checks::require(first <= last, "band", format!("{low} to {high} Hz"), allowed)?;
    let count = last - first + 1;
    for (n, bin) in spectrum[first..=last].iter_mut().enumerate() {
        *bin = line(n, count);
    }
    signal_of(spectrum, samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::excitation::sine_sweep;

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    /// Amplitude of the sine at a multiple of 1/(whole length) by the definition of the transform.
    fn amplitude(values: &[f64], line: usize) -> f64 {
        let turn = |n: usize| Complex64::cis(-TAU * (n * line) as f64 / values.len() as f64);
        let sum: Complex64 = values.iter().enumerate().map(|(n, value)| turn(n) * value).sum();
        2.0 * sum.norm() / values.len() as f64
    }

    #[test]
    fn step_sine_and_burst_have_known_samples() {
        assert_eq!(step(5.0, 0.5, 1.0, 4.0).unwrap().values, [0.0, 0.0, 5.0, 5.0]);
        let sine = sine(2.0, 1.0, 1.0, 4.0).unwrap().values;
        assert!(sine.iter().zip([0.0, 2.0, 0.0, -2.0]).all(|(value, known)| (value - known).abs() < 1e-14));
        let burst = burst(3.0, 2.0, 2.0, 2.0, 64.0).unwrap().values;
        assert_eq!((burst.len(), burst[0]), (128, 0.0));
        assert!(burst[64..].iter().all(|value| *value == 0.0));
        // An eighth past half the burst window and sine are ½(1 + cos 45°) and 1.
        assert!((burst[40] - 1.5 * (1.0 + (0.125 * TAU).cos()) * (TAU * 1.25).sin()).abs() < 1e-12);
    }

    #[test]
    fn a_sine_has_the_bits_of_a_sweep_between_equal_frequencies() {
        let (sine, sweep) =
            (sine(1e3, 2.0, 60.0, 1e3).unwrap(), sine_sweep(1e3, 2.0, 2.0, 60.0, 1e3).unwrap());
        assert_eq!(sine, sweep);
    }

    #[test]
    fn a_multisine_is_flat_in_its_band_and_low_in_its_peak() {
        let command = multisine(100.0, (1.0, 10.0), 4.0, 128.0).unwrap().values;
        let peak = command.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()));
        assert!((peak - 100.0).abs() < 1e-9);
        let inside = amplitude(&command, 4);
        for line in 1..64 {
            let expected = if (4..=40).contains(&line) { inside } else { 0.0 };
            assert!((amplitude(&command, line) - expected).abs() < 1e-9, "line {line}");
        }
        assert!(peak / rms(&command) < 2.0, "crest factor {}", peak / rms(&command));
    }

    #[test]
    fn noise_has_its_rms_its_band_and_its_seed() {
        let make = |seed| noise(50.0, (2.0, 20.0), 16.0, 128.0, seed).unwrap().values;
        let command = make(7);
        assert!((rms(&command) - 50.0).abs() < 1e-9);
        assert_eq!(command, make(7));
        assert_ne!(command, make(8));
        assert!(amplitude(&command, 16) < 1e-9 && amplitude(&command, 400) < 1e-9);
        // 576 real numbers: the kurtosis of a Gaussian is 3, of this many within a few tenths.
        let fourth = command.iter().map(|value| value.powi(4)).sum::<f64>() / command.len() as f64;
        assert!((fourth / 50f64.powi(4) - 3.0).abs() < 0.8);
    }

    #[test]
    fn bad_arguments_are_named() {
        let text = |result: Result<Command>| result.unwrap_err().to_string();
        assert!(text(step(1.0, 2.0, 1.0, 10.0)).starts_with("start = 2: must lie within 0 and the duration"));
        assert!(text(sine(1.0, 6.0, 1.0, 10.0)).starts_with("frequency = 6"));
        assert!(
            text(burst(1.0, 1.0, 3.0, 2.0, 10.0)).starts_with("cycles = 3: must fit into 2 s: at most 2")
        );
        assert!(text(multisine(1.0, (1.2, 1.3), 1.0, 10.0)).starts_with("band = 1.2 to 1.3 Hz: must hold"));
        assert!(text(noise(f64::NAN, (1.0, 2.0), 1.0, 10.0, 0)).starts_with("rms = NaN"));
        assert!(text(noise(1.0, (1.0, 9.0), 1.0, 10.0, 0)).starts_with("f_high = 9"));
    }
}
