//! The oscillation check: a force error from about 30 to 150 Hz that persists or grows shows an unstable oil column.
//!
//! The overcompensation guard observes the specimen's frequencies only. Two high-passes and a low-pass select the band
//! of the error. Its mean square over windows of a sixtieth of a second is compared with a limit and with the previous
//! window.

#[cfg(test)]
mod tests;

use crate::integrity::integrity;
use core::f64::consts::TAU;

use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::number::Real;

/// Corners (Hz) of the two high-passes and of the low-pass.
const HIGH_PASS_CORNER: f64 = 40.0;
const LOW_PASS_CORNER: f64 = 150.0;
/// Windows per second (1/s): each holds half a period of the lowest frequency, a whole one of its square.
const WINDOW_RATE: f64 = 60.0;
/// Number of windows in a row beyond the limit that trip. Number of windows in a row, each larger by the factor (1),
/// that trip if the last one is beyond the limit. The error after a single impulse decays faster.
const PERSISTENT_WINDOWS: u32 = 15;
const GROWING_WINDOWS: u32 = 3;
const GROWTH_FACTOR: f64 = 1.3;

/// An oscillation watch's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OscillationWatch<T> {
    /// Coefficients (1) of the high-passes and of the low-pass.
    high_pass: T,
    low_pass: T,
    /// Largest sum of squares of a window (N²).
    limit: T,
    ticks: u32,
}
integrity!(OscillationWatch<T>: high_pass, low_pass, limit, ticks);

/// Its state. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct OscillationWatchState<T> {
    /// The states of both high-passes, and the filtered error (N).
    high_pass_states: [T; 2],
    filtered_error: T,
    /// Sums of squares of this window and of the last one (N²).
    sum_of_squares: T,
    last_sum: T,
    ticks: u32,
    windows_over_limit: u32,
    windows_growing: u32,
}
integrity!(
    OscillationWatchState<T>: high_pass_states, filtered_error, sum_of_squares, last_sum, ticks, windows_over_limit,
    windows_growing
);

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
        let [first, second] = &mut state.high_pass_states;
        *first = *first + self.high_pass * (error - *first);
        let first_output = error - *first;
        *second = *second + self.high_pass * (first_output - *second);
        state.filtered_error =
            state.filtered_error + self.low_pass * ((first_output - *second) - state.filtered_error);
        state.sum_of_squares = state.sum_of_squares + state.filtered_error * state.filtered_error;
        state.ticks += 1;
        state.ticks >= self.ticks && self.close(state)
    }

    /// Closes a window.
    fn close(&self, state: &mut OscillationWatchState<T>) -> bool {
        let grows = state.sum_of_squares > T::splat(GROWTH_FACTOR) * state.last_sum;
        let over_limit = state.sum_of_squares > self.limit;
        state.windows_growing = if grows { state.windows_growing.saturating_add(1) } else { 0 };
        state.windows_over_limit = if over_limit { state.windows_over_limit.saturating_add(1) } else { 0 };
        (state.last_sum, state.sum_of_squares, state.ticks) = (state.sum_of_squares, T::splat(0.0), 0);
        state.windows_over_limit >= PERSISTENT_WINDOWS
            || (over_limit && state.windows_growing >= GROWING_WINDOWS)
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
                let ticks = if rate > WINDOW_RATE { (rate / WINDOW_RATE) as u32 } else { 1 };
                Ok(Some(Self {
                    high_pass: share(TAU * HIGH_PASS_CORNER / rate) as $t,
                    low_pass: share(TAU * LOW_PASS_CORNER / rate) as $t,
                    limit: (limit * limit * ticks as f64) as $t,
                    ticks,
                }))
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
