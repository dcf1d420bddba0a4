//! The delay of the command by the known latency of the load cell.
//!
//! The force loop makes the load cell's reading equal to its command, so the true force leads the command by the load
//! cell's latency. A command that is played this much later puts the force on time. Feedforward and load-pressure
//! correction look ahead to the true force, so a digital controller gets the next command without the delay.

use eft_core::Scalar;

use super::DelayLines;

/// Delays the commands of one rig or of several side by side, linearly between samples.
#[derive(Debug, Clone)]
pub(crate) struct CommandDelay<S> {
    /// Whole samples of the command at the tick and of that at the next one.
    lines: [DelayLines; 2],
    last: [S; 2],
    /// The remaining part of a sample.
    fraction: S,
    /// Whether the line of the next command has that of the first tick.
    started: bool,
}

impl<S: Scalar<Element = f64>> CommandDelay<S> {
    /// At rest; `delay(i)` is the delay of lane `i` in samples. `None` if no lane has a delay.
    pub(crate) fn new(delay: impl Fn(usize) -> f64) -> Option<Self> {
        if (0..S::LANES).all(|i| delay(i) == 0.0) {
            return None;
        }
        let line = DelayLines::new(S::LANES, |i| delay(i) as usize, |_| 0.0);
        let fraction = S::from_lanes(|i| delay(i).fract());
        Some(Self { lines: [line.clone(), line], last: [S::splat(0.0); 2], fraction, started: false })
    }

    /// The delayed commands (N) of the tick and of the next one.
    pub(crate) fn delay(&mut self, [command, next]: [S; 2]) -> [S; 2] {
        if !self.started {
            self.started = true;
            self.delay_line(1, command);
        }
        [self.delay_line(0, command), self.delay_line(1, next)]
    }

    fn delay_line(&mut self, n: usize, command: S) -> S {
        let (line, last) = (&mut self.lines[n], &mut self.last[n]);
        let whole_delayed = line.delay(command);
        let delayed = whole_delayed + self.fraction * (*last - whole_delayed);
        *last = whole_delayed;
        delayed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_delayed_by_parts_of_a_sample() {
        for samples in [0.25, 1.0, 3.6] {
            let mut delay = CommandDelay::<f64>::new(|_| samples).unwrap();
            for tick in 0..20 {
                let at = f64::from(tick);
                let [now, next] = delay.delay([at, at + 1.0]);
                if at > samples + 1.0 {
                    assert!((now - (at - samples)).abs() < 1e-12, "{samples}: {now} at {tick}");
                    assert!((next - (at + 1.0 - samples)).abs() < 1e-12, "{samples}: {next} at {tick}");
                }
            }
        }
        assert!(CommandDelay::<f64>::new(|_| 0.0).is_none());
    }

    #[test]
    fn the_next_command_is_that_of_the_next_tick_from_the_first_one_on() {
        for samples in [0.25, 1.0, 3.6] {
            let mut delay = CommandDelay::<f64>::new(|_| samples).unwrap();
            let mut expected = None;
            for tick in 0..20 {
                let command = |tick: i32| 500.0 + f64::from(tick * tick);
                let [now, next] = delay.delay([command(tick), command(tick + 1)]);
                assert!(
                    expected.is_none_or(|before| now == before),
                    "{samples}: {now} at {tick}, not {expected:?}"
                );
                expected = Some(next);
            }
        }
    }
}
