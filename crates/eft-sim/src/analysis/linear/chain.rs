//! A sampled filter and a delay of whole samples in a signal's path, as part of a larger linear state.

use nalgebra::{DMatrix, RowDVector};

use crate::instruments::Lag;

/// A signal, with one value for each case of a linear calculation.
pub(super) type Signal = RowDVector<f64>;

/// An optional first-order lag, followed by a delay.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chain {
    /// Index of its first state.
    at: usize,
    lag: Option<Lag>,
    delay: usize,
}

/// A delay of any length, linear between samples, as of [`crate::instruments`].
#[derive(Debug, Clone, Copy)]
pub(super) struct AnyDelay {
    /// Index of its first state.
    at: usize,
    whole: usize,
    part: f64,
}

impl AnyDelay {
    /// A delay (samples) whose states begin at `at`.
    pub(super) fn new(at: usize, delay: f64) -> Self {
        Self { at, whole: delay as usize, part: delay.fract() }
    }

    /// Names for its states.
    pub(super) fn names(&self, signal: &str) -> Vec<String> {
        (1..=self.whole + 1).map(|age| format!("{signal}_{age}")).collect()
    }

    /// A signal at a tick and at the next one, both delayed; the new states are written to `next`.
    pub(super) fn pass(
        &self,
        state: &DMatrix<f64>,
        next: &mut DMatrix<f64>,
        [now, then]: [Signal; 2],
    ) -> [Signal; 2] {
        // From the next tick backwards.
        let aged = |age: usize| match age {
            0 => then.clone(),
            1 => now.clone(),
            _ => state.row(self.at + age - 2).into_owned(),
        };
        let delayed = |age: usize| aged(age) * (1.0 - self.part) + aged(age + 1) * self.part;
        next.rows_mut(self.at + 1, self.whole).copy_from(&state.rows(self.at, self.whole));
        next.set_row(self.at, &now);
        [delayed(self.whole + 1), delayed(self.whole)]
    }
}

impl Chain {
    /// A chain whose states begin at `at`, with a bandwidth (Hz) and a delay (samples).
    pub(super) fn new(at: usize, bandwidth: Option<f64>, delay: usize, sample_rate: f64) -> Self {
        Self { at, lag: bandwidth.map(|corner| Lag::new(corner, sample_rate)), delay }
    }

    /// The index after its last state.
    pub(super) fn end(&self) -> usize {
        self.ring() + self.delay
    }

    fn ring(&self) -> usize {
        self.at + if self.lag.is_some() { 2 } else { 0 }
    }

    /// Names for its states.
    pub(super) fn names(&self, signal: &str) -> Vec<String> {
        let lag = if self.lag.is_some() {
            vec![format!("{signal}_input"), format!("{signal}_lag")]
        } else {
            vec![]
        };
        lag.into_iter().chain((1..=self.delay).map(|age| format!("{signal}_{age}"))).collect()
    }

    /// The output at a tick; the new states are written to `next`. States have a column for each case.
    pub(super) fn pass(&self, state: &DMatrix<f64>, next: &mut DMatrix<f64>, signal: Signal) -> Signal {
        let seen = match self.lag {
            None => signal,
            Some(lag) => {
                let output =
                    state.row(self.at + 1) * lag.pole + state.row(self.at) * lag.older + &signal * lag.newer;
                next.set_row(self.at, &signal);
                next.set_row(self.at + 1, &output);
                output
            }
        };
        if self.delay == 0 {
            return seen;
        }
        let (first, last) = (self.ring(), self.end() - 1);
        next.rows_mut(first + 1, self.delay - 1).copy_from(&state.rows(first, self.delay - 1));
        next.set_row(first, &seen);
        state.row(last).into_owned()
    }
}
