//! Detects a stuck sensor by equal readings, because the readings of a frozen converter are plausible.

use crate::error::{ConfigError, within};
use crate::integrity::integrity;
use crate::number::Real;
use crate::status;

/// The number of samples that a measurement may repeat to the last bit.
///
/// A real signal has the noise of its converter, so many equal readings mean that the converter is frozen. The number
/// depends on the converter: a quiet one of 12 bits on a rig at rest repeats a reading for many samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StuckWatch {
    repeats: u32,
}
integrity!(StuckWatch: repeats);

/// The last measurements and the number of their repetitions. `default()` is the state before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct StuckWatchState<T> {
    last: [T; 3],
    repeats: [u32; 3],
}
integrity!(StuckWatchState<T>: last, repeats);

impl StuckWatch {
    /// From the number of samples (1) that a measurement may repeat before it counts as stuck.
    ///
    /// # Errors
    /// `stuck_samples` outside [1, 1e6].
    pub const fn new(stuck_samples: u32) -> Result<Self, ConfigError> {
        match within("stuck_samples", stuck_samples as f64, 1.0, 1.0e6) {
            Ok(_) => Ok(Self { repeats: stuck_samples }),
            Err(e) => Err(e),
        }
    }

    /// One sample of piston velocity (m/s), force (N) and spool opening (1). The result is
    /// [`status::STUCK_MEASUREMENT`] if one of them has repeated too often.
    ///
    /// # NaN
    /// NaN differs from every number, so it is never stuck. The controller refuses it.
    ///
    /// # Cost
    /// Independent of history.
    #[inline(always)]
    pub fn step<T: Real>(&self, state: &mut StuckWatchState<T>, velocity: T, force: T, spool: T) -> u32 {
        let mut stuck = false;
        let signals = state.last.iter_mut().zip(&mut state.repeats);
        for ((last, repeats), reading) in signals.zip([velocity, force, spool]) {
            let repeated = reading == *last;
            // The count stops at the limit.
            let count = if *repeats < self.repeats { *repeats + 1 } else { *repeats };
            *repeats = if repeated { count } else { 0 };
            *last = reading;
            stuck |= *repeats >= self.repeats;
        }
        if stuck { status::STUCK_MEASUREMENT } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frozen_signal_is_flagged_until_it_moves_again() {
        let watch = StuckWatch::new(3).unwrap();
        let mut state = StuckWatchState::default();
        let mut step = |n: f32, spool: f32| watch.step(&mut state, 0.1 * n, 1.0e3 + n, spool);
        for n in 0..10 {
            assert_eq!(step(n as f32, 0.01 * n as f32), 0);
        }
        // The last regular sample and two repetitions, then the flag for as long as it lasts.
        let flags: [u32; 6] = core::array::from_fn(|n| step(10.0 + n as f32, 0.01 * 9.0));
        assert_eq!(flags, [0, 0, 1, 1, 1, 1].map(|stuck| stuck * status::STUCK_MEASUREMENT));
        assert_eq!(step(20.0, 0.1), 0);
    }

    #[test]
    fn nan_is_never_stuck_and_the_count_is_limited() {
        let watch = StuckWatch::new(2).unwrap();
        let mut state = StuckWatchState::default();
        for _ in 0..10 {
            assert_eq!(watch.step(&mut state, f64::NAN, f64::NAN, f64::NAN), 0);
        }
        for _ in 0..10 {
            watch.step(&mut state, 1.0, 1.0, 1.0);
        }
        assert!(state.repeats.iter().all(|&r| r == 2));
        assert!(StuckWatch::new(0).is_err());
    }
}
