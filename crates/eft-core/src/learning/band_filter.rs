//! The common band filter of the estimators' signals. All signals have the same filter, so it does not bias an estimate.
//!
//! Hum of the mains on a sensor passes through the controller into the valve command. There it is far above the motion in
//! frequency, where a valve's delay and gain are others.

use crate::integrity::integrity;
use crate::number::Real;

/// Three symmetric taps with a zero at the hum of the mains, two equal first-order low-passes, then a first-order high-pass
/// against offsets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BandFilter<T> {
    /// Tap of this input and of the one before the last, and tap of the last one. The sum of the three is 1.
    pub(crate) taps: [T; 2],
    /// Share of the difference between input and output by which a low-pass changes in a step.
    pub(crate) low_pass: T,
    /// The same for the mean, long after the start.
    pub(crate) high_pass: T,
}
integrity!(BandFilter<T>: taps, low_pass, high_pass);

/// The state of one signal's filter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct BandState<T> {
    /// The last input and the one before.
    inputs: [T; 2],
    first: T,
    second: T,
    mean: T,
}
integrity!(BandState<T>: inputs, first, second, mean);

impl<T: Real> BandFilter<T> {
    /// The filtered signal midway between the last step and this one, and its change between them. Both belong to one
    /// instant, so value and rate of a sine are exactly in quadrature. `high_pass` is the mean's share in this step. A
    /// `restart` sets taps and low-passes to their steady state at this input.
    pub(crate) fn step(&self, state: &mut BandState<T>, input: T, high_pass: T, restart: bool) -> (T, T) {
        if restart {
            let mean = state.mean + high_pass * (input - state.mean);
            *state = BandState { inputs: [input; 2], first: input, second: input, mean };
        }
        let ([last, before], [ends, middle]) = (state.inputs, self.taps);
        let without_hum = ends * (input + before) + middle * last;
        state.inputs = [input, last];
        state.first = state.first + self.low_pass * (without_hum - state.first);
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

/// Equal taps at both ends of three symmetric ones whose sum is 1, with a zero at this angle per step. The taps are 0 for an
/// angle of at least π: the mean over so long a window has little hum.
pub(super) const fn end_taps(angle: f64) -> f64 {
    if angle >= core::f64::consts::PI {
        return 0.0;
    }
    // The cosine, by Taylor's series in Horner's scheme.
    let (mut cosine, mut n) = (1.0, 24.0);
    while n > 0.5 {
        cosine = 1.0 - cosine * angle * angle / (n * (n - 1.0));
        n -= 2.0;
    }
    0.5 / (1.0 - cosine)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "zero is exact")]
mod tests {
    use super::*;
    use core::f64::consts::{PI, TAU};

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

    /// A filter whose taps have their zero at this angle per step.
    fn filter(zero: f64) -> BandFilter<f64> {
        let ends = end_taps(zero);
        BandFilter { taps: [ends, 1.0 - 2.0 * ends], low_pass: 0.25, high_pass: 0.002 }
    }

    /// Power of the filtered sine, and its value times its change over that power; the sine has an angle per step.
    fn passed(filter: &BandFilter<f64>, angle: f64) -> [f64; 2] {
        let (mut state, mut crossed, mut squares) = (BandState::default(), 0.0, 0.0);
        for n in 0..24_000_u32 {
            let input = 3.0 + (angle * f64::from(n)).sin();
            let (value, change) = filter.step(&mut state, input, filter.high_pass, n == 0);
            if n >= 12_000 {
                crossed += value * change;
                squares += value * value;
            }
        }
        [squares / 6000.0, crossed / squares]
    }

    #[test]
    fn value_and_change_of_a_sine_are_in_quadrature() {
        let [power, crossed] = passed(&filter(1.4), TAU / 120.0);
        // The offset is removed.
        assert!(crossed.abs() < 1e-6, "{crossed}");
        assert!((power - 1.0).abs() < 0.2, "{power}");
    }

    #[test]
    fn the_hum_of_the_mains_is_removed_and_the_motion_is_not() {
        for rate in [125.0, 200.0, 256.0, 312.5, 399.0] {
            let (filter, plain) = (filter(TAU * 58.0 / rate), filter(PI));
            let plain = BandFilter { taps: [0.0, 1.0], ..plain };
            let share = |hertz: f64| {
                let angle = TAU * hertz / rate;
                (passed(&filter, angle)[0] / passed(&plain, angle)[0]).sqrt()
            };
            assert!((share(4.0) - 1.0).abs() < 0.02, "{rate}: {}", share(4.0));
            assert!((share(10.0) - 1.0).abs() < 0.07, "{rate}: {}", share(10.0));
            assert!(share(50.0) < 0.27 && share(60.0) < 0.08, "{rate}: {} {}", share(50.0), share(60.0));
        }
    }

    #[test]
    fn a_long_window_is_not_filtered_against_hum() {
        assert_eq!([end_taps(PI), end_taps(4.0)], [0.0; 2]);
        assert!((end_taps(TAU / 4.0) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_start_is_at_rest_a_restart_keeps_the_mean_and_the_first_means_are_of_many_steps() {
        let filter = filter(1.4);
        let before = BandState { inputs: [7.0, -7.0], first: 9.0, second: -9.0, mean: 4.0 };
        let mut state = before;
        assert_eq!(filter.step(&mut state, 2.0, 1.0, true), (0.0, 0.0));
        state = before;
        assert_eq!(filter.step(&mut state, 2.0, 0.0, true), (-2.0, 0.0));
        assert_eq!(filter.next_share(0.5, true), 0.5);
        let mut share = filter.next_share(1.0, true);
        for n in 1..100_u32 {
            assert!((share - 1.0 / f64::from(n)).abs() < 1e-12);
            share = filter.next_share(share, false);
        }
    }
}
