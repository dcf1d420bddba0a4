//! Notices a sensor that repeats itself: a frozen converter reads plausibly, and nothing else in the loop sees it.

use crate::error::{ConfigError, within};
use crate::scalar::{Mask, Scalar};
use crate::status;

/// How often a measurement may repeat itself to the last bit.
///
/// A real signal carries the noise of its converter, so that a long run of equal bits means that it is frozen. How long
/// is long depends on the converter: a quiet one of 12 bits on a rig at rest repeats itself for many samples. A caller
/// holds the output while the flag stands ([`Controller::hold`](crate::Controller::hold)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StuckWatch<S> {
    repeats: S,
}

/// The last measurements and how often each has repeated itself. `default()` has seen nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct StuckWatchState<S> {
    last: [S; 3],
    repeats: [S; 3],
}

impl<S: Scalar> StuckWatch<S> {
    /// One sample of piston velocity (m/s), force (N) and spool opening (1): [`status::STUCK_MEASUREMENT`] where one of
    /// them has repeated itself too often.
    ///
    /// # NaN
    /// NaN equals nothing, so it is never stuck; the controller refuses it.
    ///
    /// # Cost
    /// Independent of history.
    #[inline(always)]
    pub fn step(&self, state: &mut StuckWatchState<S>, velocity: S, force: S, spool: S) -> S::Flags {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let mut stuck = S::Mask::splat(false);
        let remembered = state.last.iter_mut().zip(&mut state.repeats);
        for ((last, repeats), now) in remembered.zip([velocity, force, spool]) {
            let equal = now.le(*last) & now.ge(*last);
            // Not counted further than needed: a sum without end would stop growing at 2^24.
            let counted = S::select(repeats.lt(self.repeats), *repeats + one, *repeats);
            *repeats = S::select(equal, counted, zero);
            *last = now;
            stuck = stuck | repeats.ge(self.repeats);
        }
        S::flag(stuck, status::STUCK_MEASUREMENT)
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl StuckWatch<$t> {
            /// From the number of samples (1) that a measurement may repeat itself before it counts as stuck.
            ///
            /// # Errors
            /// `repeats` outside [1, 1e6].
            pub const fn new(repeats: u32) -> Result<Self, ConfigError> {
                match within("repeats", repeats as f64, 1.0, 1.0e6) {
                    Ok(repeats) => Ok(Self { repeats: repeats as $t }),
                    Err(e) => Err(e),
                }
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frozen_signal_is_flagged_until_it_moves_again() {
        let watch = StuckWatch::<f32>::new(3).unwrap();
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
    fn nan_is_never_stuck_and_the_count_does_not_run_away() {
        let watch = StuckWatch::<f64>::new(2).unwrap();
        let mut state = StuckWatchState::default();
        for _ in 0..10 {
            assert_eq!(watch.step(&mut state, f64::NAN, f64::NAN, f64::NAN), 0);
        }
        for _ in 0..10 {
            watch.step(&mut state, 1.0, 1.0, 1.0);
        }
        assert!(state.repeats.iter().all(|&r| r.to_bits() == 2.0_f64.to_bits()));
        assert!(StuckWatch::<f64>::new(0).is_err());
    }
}
