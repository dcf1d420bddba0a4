//! The signals of a test in the linear loop.

use std::f64::consts::TAU;

use crate::analysis::linear::{Complex, DMatrix, StateSpace};
use crate::ground_motion::excitation::Command;
use crate::state_space::{Responses, rows_of};
use crate::{Error, Result, fourier, interruption};

/// Highest frequency (Hz) of a prediction, and that of one for a command with more than this share of its power beyond.
const HIGHEST: f64 = 20.0;
const FAST: (f64, f64) = (100.0, 1e-4);
/// Least silence (s) after a test.
const SILENCE: f64 = 0.5;
/// Factor by which the signals fade over a test.
const FADED: f64 = 30.0;

/// Spectrum of a faded signal from 0 Hz.
pub(super) type Spectrum = Vec<Complex<f64>>;

/// The transform of signals that fade over a test, so that the motion at its end does not return at its start: a numerical
/// Laplace transform.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transform {
    pub(super) samples: usize,
    /// With silence after the test, into which a motion that goes on at its end can ring.
    length: usize,
    pub(super) sample_rate: f64,
    /// Index of the highest frequency.
    pub(super) last: usize,
    /// Share of the commands' power (1) beyond the highest frequency of the prediction.
    pub(super) beyond: f64,
}

impl Transform {
    /// For a test up to 20 or 100 Hz; `None` without a command, or with less than half of the power within 20 Hz.
    pub(super) fn of(commands: &[Command]) -> Result<Option<Self>> {
        let (Some(first), Some(samples)) =
            (commands.first(), commands.iter().map(|command| command.values.len()).min())
        else {
            return Ok(None);
        };
        let length = direct_length(samples + (SILENCE * first.sample_rate) as usize);
        let whole = Self { samples, length, sample_rate: first.sample_rate, last: 0, beyond: 0.0 };
        let up_to = |frequency| {
            let transform = whole.up_to(frequency);
            Ok(Self { beyond: 1.0 - transform.share(commands)?, ..transform })
        };
        let slow = up_to(HIGHEST)?;
        let known = slow.beyond <= 0.5;
        known.then(|| if slow.beyond > FAST.1 { up_to(FAST.0) } else { Ok(slow) }).transpose()
    }

    /// Duration (s) of the test.
    pub(super) fn duration(&self) -> f64 {
        self.samples as f64 / self.sample_rate
    }

    /// Highest frequency (Hz).
    pub(super) fn highest(&self) -> f64 {
        self.frequency(self.last)
    }

    /// Part of a command (rms over rms) beyond 100 Hz, of which an actuator follows little. 0 within 20 Hz.
    pub(super) fn unfollowed(&self, command: &Command) -> Result<f64> {
        if self.highest() < 0.5 * FAST.0 {
            return Ok(0.0);
        }
        Ok((1.0 - self.share(std::slice::from_ref(command))?).max(0.0).sqrt())
    }

    /// Up to another frequency (Hz).
    pub(super) fn up_to(self, frequency: f64) -> Self {
        let last = (frequency / self.sample_rate * self.length as f64) as usize;
        Self { last: last.min(self.length.saturating_sub(1) / 2), ..self }
    }

    /// Frequency (Hz) of a bin.
    pub(super) fn frequency(&self, bin: usize) -> f64 {
        bin as f64 * self.sample_rate / self.length as f64
    }

    /// Factor by which a signal without fading grows against the faded one from sample to sample.
    fn growth(&self) -> f64 {
        FADED.powf(1.0 / self.length as f64)
    }

    /// The whole factor at each sample.
    fn grown(&self) -> impl Iterator<Item = f64> {
        let growth = self.growth();
        std::iter::successors(Some(1.0), move |grown| Some(grown * growth))
    }

    /// A command (N) that goes on after the test, without a jump, until it is silent. A jump to zero would ring before the
    /// end of the test, because its part above 20 Hz is missing.
    fn ended<'a>(&self, command: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let command = &command[..self.samples.min(command.len())];
        let (last, after) = (command.last().copied().unwrap_or_default(), self.length - self.samples);
        let mirrored = command.iter().rev().chain(std::iter::repeat(&0.0)).take(after).enumerate();
        let left = move |i: usize| 0.5 + 0.5 * (0.5 * TAU * i as f64 / after as f64).cos();
        command.iter().copied().chain(mirrored.map(move |(i, value)| left(i) * (2.0 * last - value)))
    }

    /// Spectrum of a signal.
    pub(super) fn spectrum(&self, signal: impl IntoIterator<Item = f64>) -> Result<Spectrum> {
        let signal = signal.into_iter().take(self.length).zip(self.grown());
        let faded: Vec<f64> = signal.map(|(value, grown)| value / grown).collect();
        Ok(fourier::padded_spectrum(&faded, self.length)?.into_iter().take(self.last + 1).collect())
    }

    /// The signal with a spectrum.
    pub(super) fn signal(&self, mut spectrum: Spectrum) -> Result<impl Iterator<Item = f64>> {
        spectrum.resize(self.length / 2 + 1, Complex::ZERO);
        let (faded, length) = (fourier::signal_of(spectrum, self.length)?, self.length as f64);
        let signal = faded.into_iter().take(self.samples).zip(self.grown());
        Ok(signal.map(move |(value, grown)| grown * value / length))
    }

    /// Root mean square of the sum of a signal with a spectrum and a constant.
    pub(super) fn rms(&self, spectrum: Spectrum, constant: f64) -> Result<f64> {
        if spectrum.iter().all(|bin| *bin == Complex::ZERO) {
            return Ok(constant.abs());
        }
        let sum: f64 = self.signal(spectrum)?.map(|value| (value + constant) * (value + constant)).sum();
        Ok((sum / self.samples as f64).sqrt())
    }

    /// Share of the commands' power within the band; NaN without a command.
    fn share(&self, commands: &[Command]) -> Result<f64> {
        let power = |command: &Command| command.values.iter().map(|value| value * value).sum::<f64>();
        let whole: f64 = commands.iter().map(power).sum::<f64>() / self.samples as f64;
        let within = commands.iter().map(|command| {
            let spectrum = self.spectrum(self.ended(&command.values))?;
            Ok(self.rms(spectrum, 0.0)?.powi(2))
        });
        Ok(within.sum::<Result<f64>>()? / whole)
    }

    /// Factor (1) from sample to sample of a signal that has this bin only.
    pub(super) fn turn(&self, bin: usize) -> Complex<f64> {
        Complex::from_polar(self.growth(), TAU * bin as f64 / self.length as f64)
    }

    /// The responses of a model at a bin.
    pub(super) fn responses(&self, model: &Responses, bin: usize) -> Result<DMatrix<Complex<f64>>> {
        interruption::check()?;
        model.at(self.turn(bin)).ok_or_else(|| on_a_pole(self.frequency(bin)))
    }
}

/// The length itself, or the next even one, without a large prime factor: these take a Fourier transform several
/// times as long.
fn direct_length(mut length: usize) -> usize {
    let rest = |length: usize| {
        [2, 3, 5, 7, 11, 13].into_iter().fold(length, |mut rest, prime| {
            while rest > 1 && rest.is_multiple_of(prime) {
                rest /= prime;
            }
            rest
        })
    };
    while rest(length) > 1 {
        length += 2 - length % 2;
    }
    length
}

/// Spectra of an actuator's signals.
#[derive(Debug, Clone, Default)]
pub(super) struct Signals {
    pub(super) command: Spectrum,
    pub(super) missed_force: Spectrum,
    pub(super) ideal_motion: Spectrum,
    pub(super) missed_motion: Spectrum,
    pub(super) opening: Spectrum,
    pub(super) velocity: Spectrum,
    /// Force and motion by a null that the controller does not know. What is missed contains them.
    pub(super) by_null: [Spectrum; 2],
}

impl Signals {
    /// Of each actuator under its command.
    pub(super) fn of(model: &StateSpace, commands: &[Command], transform: &Transform) -> Result<Vec<Self>> {
        let asked = commands
            .iter()
            .map(|command| transform.spectrum(transform.ended(&command.values)))
            .collect::<Result<Vec<_>>>()?;
        let count = commands.len();
        let asked = DMatrix::from_fn(count, transform.last + 1, |actuator, bin| asked[actuator][bin]);
        let quantities = ["force", "displacement", "spool", "velocity"];
        let responses = responses(model, &quantities, &(0..count).collect::<Vec<_>>());
        let mut signals = vec![Self::default(); count];
        for (bin, command) in asked.column_iter().enumerate() {
            let command = DMatrix::from_column_slice(count, 1, command.as_slice());
            let all = transform.responses(&responses, bin)?;
            let applied = &all * &command;
            let ideal = motion_of_force(&all, count, &command, transform.frequency(bin))?;
            for (i, own) in signals.iter_mut().enumerate() {
                let of = |quantity: usize| applied[quantity * count + i];
                own.command.push(command[i]);
                own.missed_force.push(of(0) - command[i]);
                own.ideal_motion.push(ideal[i]);
                own.missed_motion.push(of(1) - ideal[i]);
                own.opening.push(of(2));
                own.velocity.push(of(3));
            }
        }
        Ok(signals)
    }
}

/// The responses of some quantities, those of all actuators one after another, to the inputs with these indices.
pub(super) fn responses(model: &StateSpace, quantities: &[&str], inputs: &[usize]) -> Responses {
    Responses::new(model, &rows(model, quantities), inputs)
}

/// The indices of these outputs.
pub(super) fn rows(model: &StateSpace, quantities: &[&str]) -> Vec<usize> {
    quantities.iter().flat_map(|quantity| rows_of(&model.outputs, quantity)).collect()
}

/// The motion of the structure under forces, as under the commands that make them. The first rows of `all` are
/// force and displacement.
fn motion_of_force(
    all: &DMatrix<Complex<f64>>,
    count: usize,
    force: &DMatrix<Complex<f64>>,
    frequency: f64,
) -> Result<DMatrix<Complex<f64>>> {
    let commands = all.view((0, 0), (count, count)).into_owned().lu().solve(force);
    Ok(all.view((count, 0), (count, count)) * commands.ok_or_else(|| on_a_pole(frequency))?)
}

fn on_a_pole(frequency: f64) -> Error {
    Error::value("frequency", frequency, "must not lie on a pole of the model")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_with_a_large_prime_factor_becomes_a_little_longer() {
        // 600.5 s at 4096 Hz are 2048 times the prime 1201.
        let lengths = [600 * 4096 + 2048, 16 * 4096 + 2048, 1, 2 * 17, 101];
        assert_eq!(lengths.map(direct_length), [2_459_688, 16 * 4096 + 2048, 1, 36, 104]);
    }

    #[test]
    fn a_signal_has_its_root_mean_square_and_returns() {
        let impulse = Command::new((0..1000).map(|i| f64::from(i == 999)).collect(), 1000.0).unwrap();
        let transform =
            Transform { samples: 1000, length: 1500, sample_rate: 1000.0, last: 0, beyond: 0.0 }.up_to(1e3);
        let spectrum = transform.spectrum(impulse.values.iter().copied()).unwrap();
        let again: Vec<f64> = transform.signal(spectrum.clone()).unwrap().collect();
        // The highest frequency of all is left out.
        assert!((again[999] - 1.0).abs() < 0.01 && again[0].abs() < 0.05, "{} {}", again[999], again[0]);
        assert!((transform.rms(spectrum, 0.0).unwrap() - 1.0 / 1000.0_f64.sqrt()).abs() < 1e-3);
        assert_eq!(transform.rms(vec![Complex::ZERO; 700], -0.5).unwrap(), 0.5);
    }
}
