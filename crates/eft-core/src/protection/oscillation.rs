//! The oscillation check: a force error from about 30 to 150 Hz that persists or grows shows an unstable oil column.
//!
//! The overcompensation guard observes the specimen's frequencies only. Two high-passes and a low-pass select the band of
//! the error. Its mean square over windows of a sixtieth of a second is compared with a limit and with the previous
//! window.

use crate::integrity::integrity;
use core::f64::consts::TAU;

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::number::Real;

/// Corners (Hz) of the two high-passes and of the low-pass.
const LOWEST: f64 = 40.0;
const HIGHEST: f64 = 150.0;
/// Windows per second (1/s): each holds half a period of the lowest frequency, a whole one of its square.
const WINDOWS: f64 = 60.0;
/// Number of windows in a row beyond the limit that trip. Number of windows in a row, each larger by the factor (1), that
/// trip if the last one is beyond the limit. The error after a single impulse decays faster.
const PERSISTS: u32 = 15;
const GROWS: u32 = 3;
const GROWTH: f64 = 1.3;

/// An oscillation watch's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OscillationWatch<T> {
    /// Coefficients (1) of the high-passes and of the low-pass.
    high: T,
    low: T,
    /// Largest sum of squares of a window (N²).
    limit: T,
    ticks: u32,
}
integrity!(OscillationWatch<T>: high, low, limit, ticks);

/// Its state. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct OscillationWatchState<T> {
    /// The states of both high-passes, and the filtered error (N).
    slow: [T; 2],
    band: T,
    /// Sums of squares of this window and of the last one (N²).
    sum: T,
    last: T,
    ticks: u32,
    beyond: u32,
    growing: u32,
}
integrity!(OscillationWatchState<T>: slow, band, sum, last, ticks, beyond, growing);

impl<T: Real> OscillationWatch<T> {
    /// Adds a force error (N); whether the loop oscillates.
    ///
    /// # NaN
    /// An error that is not finite does not change the state.
    ///
    /// # Cost
    /// Independent of history, except for the comparison at a window's end.
    // A separate function, so that a protection without it does not save registers for it.
    #[inline(never)]
    pub(super) fn step(&self, state: &mut OscillationWatchState<T>, error: T) -> bool {
        if !(error.abs() <= T::splat(LARGEST)) {
            return false;
        }
        let [first, second] = &mut state.slow;
        *first = *first + self.high * (error - *first);
        let once = error - *first;
        *second = *second + self.high * (once - *second);
        state.band = state.band + self.low * ((once - *second) - state.band);
        state.sum = state.sum + state.band * state.band;
        state.ticks += 1;
        state.ticks >= self.ticks && self.close(state)
    }

    /// Closes a window.
    fn close(&self, state: &mut OscillationWatchState<T>) -> bool {
        let more = state.sum > T::splat(GROWTH) * state.last;
        let beyond = state.sum > self.limit;
        state.growing = if more { state.growing.saturating_add(1) } else { 0 };
        state.beyond = if beyond { state.beyond.saturating_add(1) } else { 0 };
        (state.last, state.sum, state.ticks) = (state.sum, T::splat(0.0), 0);
        state.beyond >= PERSISTS || (beyond && state.growing >= GROWS)
    }
}

/// Coefficient (1) of a first-order low-pass whose corner turns by an angle (rad) in a sample.
const fn share(angle: f64) -> f64 {
    angle / (1.0 + angle)
}

macro_rules! constructor {
    ($t:ty) => {
        impl OscillationWatch<$t> {
            /// From the root mean square (N) of the error in the band that trips, and the sample rate (Hz); `f64::MAX`
            /// for no check.
            ///
            /// # Errors
            /// `oscillation_limit` not positive, or beyond 10¹².
            pub(super) const fn new(limit: f64, rate: f64) -> Result<Option<Self>, ConfigError> {
                if limit >= f64::MAX {
                    return Ok(None);
                }
                let limit = check!(positive("oscillation_limit", limit));
                check!(within("oscillation_limit", limit, 0.0, LARGEST));
                let ticks = if rate > WINDOWS { (rate / WINDOWS) as u32 } else { 1 };
                Ok(Some(Self {
                    high: share(TAU * LOWEST / rate) as $t,
                    low: share(TAU * HIGHEST / rate) as $t,
                    limit: (limit * limit * ticks as f64) as $t,
                    ticks,
                }))
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 4096.0;

    /// Time (s) until a force error (N) of time (s) trips; at most 4 s.
    fn trips(limit: f64, error: impl Fn(f64) -> f64) -> Option<f64> {
        let watch = OscillationWatch::<f64>::new(limit, RATE).unwrap().unwrap();
        let mut state = OscillationWatchState::default();
        let times = (0..(4.0 * RATE) as u32).map(|n| f64::from(n) / RATE);
        let mut tripped = times.filter(|t| watch.step(&mut state, error(*t)));
        tripped.next()
    }

    fn wave(frequency: f64, time: f64) -> f64 {
        libm::sin(TAU * frequency * time)
    }

    #[test]
    fn errors_that_persist_or_grow_in_the_band_trip() {
        // The band passes 0.36 to 0.7 of a steady amplitude of 1000 N; the root mean square is smaller by √2.
        for frequency in [35.0, 65.0, 120.0] {
            let after = trips(200.0, |t| 1000.0 * wave(frequency, t)).unwrap();
            assert!((0.2..0.3).contains(&after), "{frequency} Hz: {after} s");
        }
        // A newton that grows at 30 1/s exceeds 400 N after 0.2 s.
        let after = trips(200.0, |t| libm::exp(30.0 * t) * wave(65.0, t)).unwrap();
        assert!((0.2..0.27).contains(&after), "{after} s");
    }

    #[test]
    fn slow_small_and_decaying_errors_do_not_trip() {
        assert_eq!(trips(200.0, |t| 3000.0 * wave(10.0, t)), None);
        assert_eq!(trips(200.0, |t| 200.0 * wave(65.0, t)), None);
        // An impulse, and another one a second later.
        let kick = |t: f64| 20e3 * libm::exp(-25.0 * libm::fmod(t, 1.0)) * wave(65.0, t);
        assert_eq!(trips(200.0, kick), None);
        assert_eq!(trips(200.0, |_| f64::NAN), None);
    }

    #[test]
    fn a_lost_sample_changes_nothing() {
        let watch = OscillationWatch::<f32>::new(200.0, RATE).unwrap().unwrap();
        let mut state = OscillationWatchState::default();
        watch.step(&mut state, 5e3);
        let before = state;
        for lost in [f32::NAN, f32::INFINITY, -1e30] {
            assert!(!watch.step(&mut state, lost));
        }
        assert_eq!(state, before);
        assert!(OscillationWatch::<f32>::new(f64::MAX, RATE).unwrap().is_none());
        for (limit, rate) in [(0.0, RATE), (-1.0, RATE), (f64::NAN, RATE), (1e13, RATE)] {
            assert!(OscillationWatch::<f32>::new(limit, rate).is_err());
        }
    }
}
