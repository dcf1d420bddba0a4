//! The spool compared with its command, which passes through a model of the valve.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::plausibility::sums::{Sum, envelope, follow, larger, opposed};
use crate::protection::plausibility::{Known, Plausibility, PlausibilityState};

/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
pub(super) const VALVE: f64 = 0.3;

/// The limits of the comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StrokeLimits<T> {
    /// Coefficient (1) of the valve model's two lags.
    pub(in crate::protection) lag: T,
    /// Differences (1) by noise and offsets, and by noise in a motion against the command.
    pub(in crate::protection) drift: T,
    pub(in crate::protection) against_drift: T,
    /// Limits (s) of the sums.
    pub(in crate::protection) difference: T,
    pub(in crate::protection) against: T,
}
integrity!(StrokeLimits<T>: lag, drift, against_drift, difference, against);

/// The state of the comparison: openings (1).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Stroke<T> {
    /// The valve model's opening after its first lag and after both.
    pub(super) first: T,
    pub(super) opening: T,
    /// Low-passed: the valve model's opening and the spool's, and their means.
    pub(super) asked: T,
    pub(super) reached: T,
    pub(super) asked_mean: T,
    pub(super) reached_mean: T,
    /// Envelope of the larger opening.
    pub(super) widest: T,
    /// Sums (s) of the difference, and of a motion against the command.
    pub(super) difference: Sum<T>,
    pub(super) against: Sum<T>,
}
integrity!(Stroke<T>: first, opening, asked, reached, asked_mean, reached_mean, widest, difference, against);

impl<T: Real> Stroke<T> {
    /// The state of a spool at rest at an opening (1).
    pub(super) fn at(opening: T) -> Self {
        let [first, asked, reached, asked_mean, reached_mean] = [opening; 5];
        Self { first, opening, asked, reached, asked_mean, reached_mean, ..Self::default() }
    }
}

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// The opening that should follow from the valve command.
    #[inline(always)]
    pub(super) fn pass_through_valve(&self, state: &mut PlausibilityState<T>, known: &Known<T>) {
        if known.valve_command.is_finite() {
            let one = T::splat(1.0);
            let asked = (known.valve_gain * self.valve_gain * known.valve_command).limit(-one, one);
            let asked = follow(&mut state.stroke.first, self.stroke.lag, asked);
            follow(&mut state.stroke.opening, self.stroke.lag, asked);
        }
    }

    /// Adds a tick's spool opening (1).
    #[inline(always)]
    pub(super) fn add_stroke(&self, state: &mut PlausibilityState<T>, spool: T, known: &Known<T>) {
        if !known.valve_command.is_finite() {
            return;
        }
        let (limits, sums) = (&self.stroke, &mut state.stroke);
        let asked = follow(&mut sums.asked, self.slow, sums.opening);
        let reached = follow(&mut sums.reached, self.slow, spool);
        let seen = envelope(&mut sums.widest, self.decay, larger(asked.abs(), reached.abs()));
        let tolerance = T::splat(VALVE) * seen + limits.drift;
        sums.difference.add(self.period * (reached - asked), self.period * tolerance, limits.difference);
        // A null bias is no part of the swings about their means.
        let asked = asked - follow(&mut sums.asked_mean, self.slow, asked);
        let moved = reached - follow(&mut sums.reached_mean, self.slow, reached);
        let change = self.period * opposed(asked, moved);
        sums.against.add(change, self.period * limits.against_drift, limits.against);
        sums.against.below = T::splat(0.0);
    }
}
