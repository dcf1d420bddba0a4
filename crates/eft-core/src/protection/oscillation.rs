//! The oscillation check: a force error from about 30 to 150 Hz that persists or grows shows an unstable oil column.
//!
//! The overcompensation guard observes the specimen's frequencies only. Two high-passes and a low-pass select the band of
//! the error. Its mean square over windows of a sixtieth of a second is compared with a limit and with the previous
//! window.

#[cfg(test)]
mod tests;

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
