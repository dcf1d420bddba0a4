//! The metrics without a Fourier transform, computed sample by sample for one test or several side by side.

use super::pair::{check, in_range};
use crate::Result;
use crate::lanes::Num;

/// Number of samples with a common mean.
pub(crate) const BLOCK: usize = 1024;

/// Sums during a test; memory does not grow with the length of the test.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Norms<S> {
    samples: f64,
    squared_error: S,
    squared_command: S,
    largest_error: S,
    largest_command: S,
    area: S,
    error: Spread<S>,
    command: Spread<S>,
    last: [S; 2],
}

/// Mean, and sum of squares about the mean.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Spread<S> {
    mean: S,
    squares: S,
}

impl<S: Num> Spread<S> {
    /// The spread with `count` values after the first `samples`, from their mean and the squares about it
    /// (Chan, Golub and LeVeque 1983).
    #[inline(always)]
    fn after(self, samples: f64, count: f64, mean: S, squares: S) -> Self {
        let (apart, all) = (mean - self.mean, samples + count);
        Self {
            mean: self.mean + apart * S::splat(count / all),
            squares: self.squares + squares + apart * apart * S::splat(samples * count / all),
        }
    }

    fn lane(self, lane: usize) -> Spread<f64> {
        Spread { mean: self.mean.lane(lane), squares: self.squares.lane(lane) }
    }
}

impl<S: Num> Norms<S> {
    /// Adds the next samples of command and measured force (N): [`BLOCK`] of them, fewer only at the end.
    #[inline(always)]
    pub(crate) fn add(&mut self, command: &[S], measured: &[S]) {
        let (mut sums, [mut last_command, mut last_measured]) = (*self, self.last);
        for (&c, &m) in command.iter().zip(measured) {
            let error = m - c;
            sums.squared_error = sums.squared_error + error * error;
            sums.squared_command = sums.squared_command + c * c;
            sums.largest_error = error.abs().larger(sums.largest_error);
            sums.largest_command = c.abs().larger(sums.largest_command);
            // ¼(m₁+m₀)(c₁−c₀) − ¼(c₁+c₀)(m₁−m₀) is half the cross product of two points.
            sums.area = sums.area + S::splat(0.5) * (last_measured * c - m * last_command);
            (last_command, last_measured) = (c, m);
        }
        // Squares are summed about the mean of each block, because about zero they would cancel for a large
        // mean. Error and command share the loops: each sum waits for its last addition.
        let (zero, count) = (S::splat(0.0), command.len() as f64);
        let [mut error_mean, mut command_mean] = [zero; 2];
        for (&c, &m) in command.iter().zip(measured) {
            error_mean = error_mean + (m - c);
            command_mean = command_mean + c;
        }
        error_mean = error_mean * S::splat(1.0 / count);
        command_mean = command_mean * S::splat(1.0 / count);
        let [mut error_squares, mut command_squares] = [zero; 2];
        for (&c, &m) in command.iter().zip(measured) {
            let (error, command) = ((m - c) - error_mean, c - command_mean);
            error_squares = error_squares + error * error;
            command_squares = command_squares + command * command;
        }
        *self = Self {
            samples: self.samples + count,
            error: self.error.after(self.samples, count, error_mean, error_squares),
            command: self.command.after(self.samples, count, command_mean, command_squares),
            last: [last_command, last_measured],
            ..sums
        };
    }

    /// Number of samples until now.
    pub(crate) fn samples(&self) -> usize {
        self.samples as usize
    }

    /// The sums of one lane.
    pub(crate) fn lane(&self, lane: usize) -> Norms<f64> {
        Norms {
            samples: self.samples,
            squared_error: self.squared_error.lane(lane),
            squared_command: self.squared_command.lane(lane),
            largest_error: self.largest_error.lane(lane),
            largest_command: self.largest_command.lane(lane),
            area: self.area.lane(lane),
            error: self.error.lane(lane),
            command: self.command.lane(lane),
            last: self.last.map(|last| last.lane(lane)),
        }
    }
}

impl Norms<f64> {
    /// The sums of whole signals.
    pub(crate) fn of(command: &[f64], measured: &[f64]) -> Self {
        let mut norms = Self::default();
        for (command, measured) in command.chunks(BLOCK).zip(measured.chunks(BLOCK)) {
            norms.add(command, measured);
        }
        norms
    }

    pub(crate) fn nrmse(&self) -> Result<f64> {
        in_range("nrmse", (self.squared_error / self.squared_command).sqrt())
    }

    pub(crate) fn nrmse_bias_free(&self) -> Result<f64> {
        in_range("nrmse_bias_free", (self.error.squares / self.command.squares).sqrt())
    }

    pub(crate) fn peak_error(&self) -> Result<f64> {
        in_range("peak_error", self.largest_error / self.largest_command)
    }

    pub(crate) fn tracking_indicator(&self) -> Result<f64> {
        in_range("tracking_indicator", self.area)
    }
}

/// Normalised root-mean-square error `√(Σ(x_m − x_c)² / Σx_c²)`, dimensionless.
///
/// # Errors
/// When the signals are empty, unequal in length, not finite, or the command is zero throughout.
pub fn nrmse(command: &[f64], measured: &[f64]) -> Result<f64> {
    check(command, measured)?;
    Norms::of(command, measured).nrmse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use eft_core::{Lanes, Scalar};

    /// Command and measured force.
    type Pair = (Vec<f64>, Vec<f64>);

    fn signals(n: usize, offset: f64) -> Pair {
        let pair = |i: usize| {
            let c = (0.01 * i as f64).sin() * 8900.0;
            (c, 0.97 * c + 30.0 * (0.37 * i as f64).cos() + offset)
        };
        (0..n).map(pair).unzip()
    }

    #[test]
    fn blocks_give_the_sums_of_two_passes_over_all_samples() {
        for (n, offset) in [(1, 0.0), (1023, 50.0), (1024, 0.0), (5000, 1e9), (10_241, -7.0)] {
            let (command, measured) = signals(n, offset);
            let error: Vec<f64> = command.iter().zip(&measured).map(|(c, m)| m - c).collect();
            let norms = Norms::of(&command, &measured);
            for (spread, values) in [(norms.error, &error), (norms.command, &command)] {
                let mean = values.iter().sum::<f64>() / n as f64;
                let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
                assert!((spread.mean - mean).abs() <= 1e-13 * mean.abs().max(1.0), "{n}");
                assert!((spread.squares - squares).abs() <= 1e-9 * squares.max(1e-3), "{n}, {offset}");
            }
        }
    }

    #[test]
    fn a_lane_has_the_bits_of_its_test_alone() {
        let tests: Vec<_> = (0..4).map(|i| signals(3000, 10.0 * f64::from(i))).collect();
        let mut wide = Norms::<Lanes<f64, 4>>::default();
        for start in (0..3000).step_by(BLOCK) {
            let end = (start + BLOCK).min(3000);
            let pack = |of: fn(&Pair) -> &Vec<f64>| {
                (start..end).map(|n| Lanes::from_lanes(|i| of(&tests[i])[n])).collect::<Vec<_>>()
            };
            wide.add(&pack(|test| &test.0), &pack(|test| &test.1));
        }
        for (i, (command, measured)) in tests.iter().enumerate() {
            assert_eq!(wide.lane(i), Norms::of(command, measured));
        }
    }
}
