//! Force commands, sampled at the controller's rate.

mod effective_force;
mod signals;
mod sweep;

pub use effective_force::effective_force;
pub use signals::{burst, multisine, noise, sine, step};
pub use sweep::sine_sweep;

use crate::{Result, checks};
use eft_core::Short;

/// The longest command: 10⁸ samples (0.8 GB), nearly seven hours at 4096 Hz.
pub const MAX_SAMPLES: usize = 100_000_000;

/// A force command in N, sampled at `sample_rate` in Hz; the time of sample `i` is `i / sample_rate`.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Commanded force at each sample, in N.
    pub values: Vec<f64>,
    /// Samples per second, in Hz.
    pub sample_rate: f64,
}

impl Command {
    /// A command from force samples in N and their rate in Hz.
    ///
    /// # Errors
    /// If there are no values, one of them is not finite, or the rate is outside its range.
    pub fn new(values: Vec<f64>, sample_rate: f64) -> Result<Self> {
        let command = Self { values, sample_rate };
        command.validate()?;
        Ok(command)
    }

    /// Repeats the checks of [`Command::new`], because the public fields may have changed.
    ///
    /// # Errors
    /// As [`Command::new`].
    pub fn validate(&self) -> Result<()> {
        checks::sample_rate("sample_rate", self.sample_rate)?;
        checks::signal("command", &self.values)?;
        within_memory(self.values.len() as f64).map(|_| ())
    }

    /// Time of each sample in s, from zero.
    #[must_use]
    pub fn time(&self) -> Vec<f64> {
        (0..self.values.len()).map(|i| i as f64 / self.sample_rate).collect()
    }

    /// Length in s: the number of samples over the sample rate.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.values.len() as f64 / self.sample_rate
    }
}

/// Number of samples of a duration (s) at a rate (Hz).
pub(crate) fn samples(duration: f64, sample_rate: f64) -> Result<usize> {
    checks::sample_rate("sample_rate", sample_rate)?;
    checks::positive("duration", duration, "s")?;
    within_memory((duration * sample_rate).round())
}

/// A command of `value(t)` (N) at each time (s). Its callers take functions of `libm`, because the last bits of the
/// platform's differ between platforms.
fn sampled(duration: f64, sample_rate: f64, value: impl Fn(f64) -> f64) -> Result<Command> {
    let samples = samples(duration, sample_rate)?;
    Command::new((0..samples).map(|i| value(i as f64 / sample_rate)).collect(), sample_rate)
}

/// The sample count as an integer, if it lies within 1 and [`MAX_SAMPLES`].
fn within_memory(samples: f64) -> Result<usize> {
    let within = (1.0..=MAX_SAMPLES as f64).contains(&samples);
    let allowed = format!("must lie within 1 and {MAX_SAMPLES}");
    checks::require(within, "number of samples", Short(samples), allowed)?;
    Ok(samples as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_starts_at_zero_and_counts_periods() {
        let command = Command::new(vec![0.0; 5], 4.0).unwrap();
        assert_eq!(command.time(), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(command.duration(), 1.25);
    }

    #[test]
    fn bad_commands_are_named() {
        let text = |values: Vec<f64>, rate| Command::new(values, rate).unwrap_err().to_string();
        assert!(text(vec![], 10.0).starts_with("command"));
        assert!(text(vec![0.0, f64::NAN], 10.0).contains("sample 1"));
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
            let message = text(vec![1.0], rate);
            assert!(
                message.starts_with("sample_rate = ") && message.ends_with("within 1e-6 and 1e9 Hz"),
                "{message}"
            );
        }
    }
}
