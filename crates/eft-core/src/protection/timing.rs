//! Checks by alive counter and measured period that every sample is new and on time.

use crate::cause::Cause;
use crate::error::{ConfigError, check, positive, within};
use crate::integrity::integrity;
use crate::number::Real;
use crate::parameters::ProtectionParameters;

/// A check of alive counter and sample period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing<T> {
    rate: T,
    tolerance: T,
    /// Largest [`error_score`](TimingState::error_score) without a trip.
    score_limit: u32,
}
integrity!(Timing<T>: rate, tolerance, score_limit);

/// Its state. `default()` is that before the first counter and period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct TimingState<T> {
    /// The last counter.
    last_counter: T,
    /// Whether there was a counter, and a period.
    has_counter: bool,
    has_period: bool,
    /// Whether the last sample was not new, or had no period.
    in_gap: bool,
    /// Increases by two with each bad sample and decreases by one with each good one. A share of bad samples above a
    /// third therefore trips.
    error_score: u32,
}
integrity!(TimingState<T>: last_counter, has_counter, has_period, in_gap, error_score);

/// The error of a sample's timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TimingError {
    /// The sample is not new.
    Old,
    /// Samples are missing before it.
    Skipped,
    /// Its period is wrong.
    Period,
    /// Its period is missing.
    NoPeriod,
}

impl TimingError {
    /// The cause of the trip if it persists.
    pub(crate) fn cause(self) -> Cause {
        if matches!(self, Self::Old | Self::Skipped) { Cause::SamplesOld } else { Cause::SamplePeriod }
    }

    fn is_gap(self) -> bool {
        matches!(self, Self::Old | Self::NoPeriod)
    }
}

impl<T: Real> Timing<T> {
    /// One sample, with its counter (1) and the period (s) since the last one: the error of its timing.
    ///
    /// # NaN
    /// A counter or period is checked after its first value. A later NaN is bad. The first new sample after such ones
    /// is good, whatever its counter and period are.
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut TimingState<T>, alive: T, period: T) -> Option<TimingError> {
        let error = Self::check_counter(state, alive).or_else(|| self.check_period(state, period));
        // The samples of a gap have been counted one by one.
        let error = error.filter(|error| error.is_gap() || !state.in_gap);
        if let Some(error) = error {
            state.in_gap = error.is_gap();
            if state.error_score <= self.score_limit {
                state.error_score += 2;
            }
        } else if state.error_score > 0 {
            state.in_gap = false;
            state.error_score -= 1;
        }
        error
    }

    /// Whether samples have been bad for too long.
    #[inline(always)]
    pub(crate) fn persists(&self, state: &TimingState<T>) -> bool {
        state.error_score > self.score_limit
    }

    #[inline(always)]
    fn check_counter(state: &mut TimingState<T>, alive: T) -> Option<TimingError> {
        let zero = T::splat(0.0);
        if state.has_counter {
            let last = state.last_counter;
            // A large counter plus one may round to the counter, but this difference is exact.
            if alive - last == T::splat(1.0) {
                state.last_counter = alive;
                return None;
            }
            if !alive.is_finite() || alive == last {
                return Some(TimingError::Old);
            }
            state.last_counter = alive;
            // A counter of any length returns to zero after its last value.
            return if alive == zero && last > zero { None } else { Some(TimingError::Skipped) };
        }
        if alive.is_finite() {
            (state.last_counter, state.has_counter) = (alive, true);
        }
        None
    }

    #[inline(always)]
    fn check_period(&self, state: &mut TimingState<T>, period: T) -> Option<TimingError> {
        let deviates = !((period * self.rate - T::splat(1.0)).abs() <= self.tolerance);
        if deviates && !period.is_finite() {
            return state.has_period.then_some(TimingError::NoPeriod);
        }
        state.has_period = true;
        deviates.then_some(TimingError::Period)
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl Timing<$t> {
            /// From the parameters of a protection and the sample rate (Hz).
            pub(crate) const fn new(p: &ProtectionParameters, sample_rate: f64) -> Result<Self, ConfigError> {
                check!(within("lost_samples", p.lost_samples as f64, 0.0, 1e5));
                Ok(Self {
                    rate: check!(positive("sample_rate", sample_rate)) as $t,
                    tolerance: check!(within("period_tolerance", p.period_tolerance, 0.0, 1e3)) as $t,
                    score_limit: 2 * p.lost_samples,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f32 = f32::NAN;

    fn timing() -> Timing<f32> {
        Timing::<f32>::new(&ProtectionParameters::DEFAULT, 1000.0).unwrap()
    }

    /// The sample at which these counters and periods trip, and the cause.
    fn trips(samples: impl IntoIterator<Item = (f32, f32)>) -> Option<(usize, Cause, bool)> {
        let (timing, mut state) = (timing(), TimingState::default());
        samples.into_iter().enumerate().find_map(|(n, (alive, period))| {
            let error = timing.step(&mut state, alive, period)?;
            timing.persists(&state).then_some((n, error.cause(), error == TimingError::Old))
        })
    }

    // SR-15
    #[test]
    fn a_counter_that_stops_or_skips_trips() {
        let ten_and_then = |then: fn(u16) -> f32| {
            (0..10_u16).map(f32::from).chain((10..200).map(then)).map(|alive| (alive, NONE))
        };
        assert_eq!(trips(ten_and_then(f32::from)), None);
        // Ten bad samples do not trip yet.
        assert_eq!(trips(ten_and_then(|_| 9.0)), Some((20, Cause::SamplesOld, true)));
        assert_eq!(trips(ten_and_then(|_| NONE)), Some((20, Cause::SamplesOld, true)));
        assert_eq!(trips(ten_and_then(|n| f32::from(2 * n))), Some((20, Cause::SamplesOld, false)));
        // Each counter twice.
        let (n, cause, _) = trips(ten_and_then(|n| f32::from(n / 2))).unwrap();
        assert!(cause == Cause::SamplesOld && (25..60).contains(&n), "{n}");
        // One lost sample in a hundred does not trip.
        assert_eq!(trips((0..10_000_u16).map(|n| (f32::from(n + n / 100), NONE))), None);
    }

    #[test]
    fn counters_of_any_length_begin_again_at_zero() {
        for last in [1, 7, 255, 65_535_u32] {
            let counter = (0..300_000_u32).map(|n| ((n % (last + 1)) as f32, NONE));
            assert_eq!(trips(counter), None, "{last}");
        }
        // From below zero it does not begin again but skips.
        let mut state = TimingState::default();
        let mut error =
            |alive: f32| timing().step(&mut state, alive, NONE).map(|error| error == TimingError::Skipped);
        assert_eq!([-9.0, -8.0, 0.0, 1.0].map(&mut error), [None, None, Some(true), None]);
        let never_begins = core::iter::repeat_n((0.0, NONE), 100);
        assert_eq!(trips(never_begins).map(|(_, cause, _)| cause), Some(Cause::SamplesOld));
    }

    // SR-15
    #[test]
    fn a_counter_that_stops_is_noticed_beyond_the_exact_whole_numbers() {
        for last in [16_777_215.0_f32, 16_777_216.0, 1e9] {
            let stands = core::iter::repeat_n((last, NONE), 100);
            assert_eq!(trips(stands), Some((11, Cause::SamplesOld, true)), "{last}");
        }
    }

    // SR-15
    #[test]
    fn a_period_that_is_off_trips() {
        let periods =
            |deviates: f32| (0..100).map(move |n| (NONE, if n < 10 { 1e-3 } else { deviates * 1e-3 }));
        for (deviates, expected) in [
            (0.95, None),
            (1.09, None),
            (0.85, Some((20, Cause::SamplePeriod, false))),
            (1.2, Some((20, Cause::SamplePeriod, false))),
            (f32::INFINITY, Some((20, Cause::SamplePeriod, false))),
            (f32::NAN, Some((20, Cause::SamplePeriod, false))),
        ] {
            assert_eq!(trips(periods(deviates)), expected, "{deviates}");
        }
        // Also if the first one is.
        let always = core::iter::repeat_n((NONE, 1.2e-3), 100);
        assert_eq!(trips(always), Some((10, Cause::SamplePeriod, false)));
    }

    /// Lost samples have been counted one by one. The first new one then skips, and its period is that of the gap.
    // SR-15
    #[test]
    fn the_first_sample_after_a_gap_is_not_one_more_bad_sample() {
        let gap = |length: u16, during: (f32, f32), first: (f32, f32)| {
            let begun = (0..10_u16).map(|n| (f32::from(n), 1e-3));
            let gap = core::iter::repeat_n(during, usize::from(length));
            let after = (1..200_u16).map(move |n| (first.0 + f32::from(n), 1e-3));
            begun.chain(gap).chain([first]).chain(after)
        };
        // Nothing is known of a lost sample, or the last one is repeated.
        for during in [(NONE, NONE), (9.0, NONE), (9.0, 1e-3)] {
            // The counter went on in its source, waited, or is that of a source that has started anew.
            for counter in [20.0, 10.0, 0.0, 5.0] {
                for period in [1e-3, 11e-3] {
                    let first = (counter, period);
                    assert_eq!(trips(gap(10, during, first)), None, "{during:?} {first:?}");
                    assert_eq!(
                        trips(gap(11, during, first)).map(|(n, ..)| n),
                        Some(20),
                        "{during:?} {first:?}"
                    );
                }
            }
        }
        // A second one that skips is bad.
        let twice = gap(10, (NONE, NONE), (20.0, 1e-3)).map(|(n, t)| (if n > 20.0 { n + 5.0 } else { n }, t));
        assert_eq!(trips(twice), Some((21, Cause::SamplesOld, false)));
    }

    #[test]
    fn bad_counters_and_bad_periods_count_together() {
        // One sample in three skips, another one comes late.
        let samples = |skips: bool, late: bool| {
            (0..1000_u16).map(move |n| {
                let alive = n + if skips { n / 3 } else { 0 };
                (f32::from(alive), if late && n % 3 == 1 { 1.2e-3 } else { 1e-3 })
            })
        };
        assert_eq!(trips(samples(true, false)), None);
        assert_eq!(trips(samples(false, true)), None);
        assert!(trips(samples(true, true)).is_some_and(|(n, _, old)| (10..60).contains(&n) && !old));
    }

    #[test]
    fn missing_counters_and_periods_are_not_checked() {
        assert_eq!(trips(core::iter::repeat_n((NONE, NONE), 1000)), None);
    }
}
