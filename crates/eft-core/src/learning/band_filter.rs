//! The common band filter of the estimators' signals. All signals have the same filter, so it does not bias an estimate.

use crate::integrity::integrity;
use crate::number::Real;

/// Two equal first-order low-passes, then a first-order high-pass against offsets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BandFilter<T> {
    /// Share of the difference between input and output by which a low-pass changes in a step.
    pub(crate) low_pass: T,
    /// The same for the mean, long after the start.
    pub(crate) high_pass: T,
}
integrity!(BandFilter<T>: low_pass, high_pass);

/// The state of one signal's filter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct BandState<T> {
    first: T,
    second: T,
    mean: T,
}
integrity!(BandState<T>: first, second, mean);

impl<T: Real> BandFilter<T> {
    /// The filtered signal midway between the last step and this one, and its change between them. Both belong to one
    /// instant, so value and rate of a sine are exactly in quadrature. `high_pass` is the mean's share in this step. A
    /// `restart` sets the low-passes to their steady state at this input.
    pub(crate) fn step(&self, state: &mut BandState<T>, input: T, high_pass: T, restart: bool) -> (T, T) {
        if restart {
            let mean = state.mean + high_pass * (input - state.mean);
            *state = BandState { first: input, second: input, mean };
        }
        state.first = state.first + self.low_pass * (input - state.first);
        let rise = self.low_pass * (state.first - state.second);
        let drift = high_pass * (state.second - state.mean);
        let change = rise - drift;
        let value = state.second - state.mean + T::splat(0.5) * change;
        state.second = state.second + rise;
        state.mean = state.mean + drift;
        (value, change)
    }

    /// The mean's share in the next step: 1, 1/2, 1/3, … The first means are thus those of all steps so far. In a
    /// `restart` the mean is kept, because a few lost steps do not change it.
    pub(crate) fn next_share(&self, share: T, restart: bool) -> T {
        let next = share / (T::splat(1.0) + share);
        if restart {
            share
        } else if next > self.high_pass {
            next
        } else {
            self.high_pass
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "zero is exact")]
mod tests {
    use super::*;

    impl<T: Copy> BandState<T> {
        /// Output of the first low-pass.
        pub(crate) fn input(&self) -> T {
            self.first
        }

        /// Outputs of both low-passes, and the mean.
        pub(crate) fn parts(&self) -> [T; 3] {
            [self.first, self.second, self.mean]
        }
    }

    #[test]
    fn value_and_change_of_a_sine_are_in_quadrature() {
        let filter = BandFilter { low_pass: 0.25, high_pass: 0.002 };
        let mut state = BandState::default();
        let (mut crossed, mut squares) = (0.0, 0.0);
        for n in 0..24_000_u32 {
            let input = 3.0 + (core::f64::consts::TAU * f64::from(n) / 120.0).sin();
            let (value, change) = filter.step(&mut state, input, filter.high_pass, n == 0);
            if n >= 12_000 {
                crossed += value * change;
                squares += value * value;
            }
        }
        // The offset is removed.
        assert!((crossed / squares).abs() < 1e-6, "{crossed} {squares}");
        assert!((squares / 6000.0 - 1.0).abs() < 0.2, "{squares}");
    }

    #[test]
    fn a_start_is_at_rest_a_restart_keeps_the_mean_and_the_first_means_are_of_many_steps() {
        let filter = BandFilter { low_pass: 0.25, high_pass: 0.002 };
        let mut state = BandState { first: 9.0, second: -9.0, mean: 4.0 };
        assert_eq!(filter.step(&mut state, 2.0, 1.0, true), (0.0, 0.0));
        state = BandState { first: 9.0, second: -9.0, mean: 4.0 };
        assert_eq!(filter.step(&mut state, 2.0, 0.0, true), (-2.0, 0.0));
        assert_eq!(filter.next_share(0.5, true), 0.5);
        let mut share = filter.next_share(1.0, true);
        for n in 1..100_u32 {
            assert!((share - 1.0 / f64::from(n)).abs() < 1e-12);
            share = filter.next_share(share, false);
        }
    }
}
