//! The spool compared with its command, which passes through a model of the valve.

use crate::number::Real;
use crate::protection::plausibility::sums::{envelope, follow, larger, opposed};
use crate::protection::plausibility::{Known, Plausibility, PlausibilityState};

/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
pub(super) const VALVE: f64 = 0.3;

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
