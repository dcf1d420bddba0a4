//! When a window's evidence counts, and for how long.

use crate::scalar::{Mask, Scalar, pack_numbers};

/// Constants of the judgement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trust<S> {
    /// Openings (1) beyond which the valve is taken to be saturated.
    pub(crate) linear_range: S,
    /// Square of the opening (1) below which nothing is learned.
    pub(crate) excitation: S,
    /// Weight of a squared change per step in that comparison.
    pub(crate) change_weight: S,
    /// Square of the opening (1) per square of a flow (m³/s), for comparing the two models' errors.
    pub(crate) per_square_flow: S,
    /// Share of the way the errors' averages go in a step.
    pub(crate) average: S,
    /// Part of the signals' squares that the models' errors may have.
    pub(crate) error_share: S,
    /// Period of the estimators (s).
    pub(crate) period: S,
    /// Evidence (s, of squared opening × time) that is never forgotten.
    pub(crate) kept: S,
    /// Evidence (s) at which half of the shortest memory is reached.
    pub(crate) half: S,
    /// Share forgotten in a step at the most.
    pub(crate) forgotten: S,
    /// Windows without learning after a fault.
    pub(crate) quarantine: S,
}

pack_numbers!(Trust: linear_range, excitation, change_weight, per_square_flow, average, error_share, period, kept, half, forgotten, quarantine);

/// What the judgement remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct TrustState<S> {
    signal: S,
    error: S,
    evidence: S,
    /// Windows left without learning.
    pub(crate) quarantine: S,
    /// Share of the older evidence that stays.
    pub(crate) keep: S,
    /// Time (s) that the window's evidence counts for.
    pub(crate) weight: S,
}

impl<S: Scalar> Default for TrustState<S> {
    fn default() -> Self {
        let zero = S::splat(0.0);
        Self {
            signal: zero,
            error: zero,
            evidence: zero,
            quarantine: zero,
            keep: S::splat(1.0),
            weight: zero,
        }
    }
}

impl<S: Scalar> Trust<S> {
    /// Takes in what both models leave unexplained: flow against its prediction (m³/s, and the flow gain `θ` on it),
    /// spool against what was asked (1).
    #[inline(always)]
    pub(crate) fn compare(
        &self,
        state: &mut TrustState<S>,
        flow: S,
        predicted: S,
        gain: S,
        spool: S,
        asked: S,
    ) {
        let flow_error = flow - gain * predicted;
        let spool_error = spool - asked;
        let error = self.per_square_flow * (flow_error * flow_error) + spool_error * spool_error;
        let signal =
            self.per_square_flow * (flow * flow + predicted * predicted) + spool * spool + asked * asked;
        state.error = state.error + self.average * (error - state.error);
        state.signal = state.signal + self.average * (signal - state.signal);
    }

    /// One window less to wait, or all of them again.
    #[inline(always)]
    pub(crate) fn settle(&self, state: &mut TrustState<S>, again: S::Mask) {
        let left = state.quarantine - S::splat(1.0);
        let left = S::select(left.gt(S::splat(0.0)), left, S::splat(0.0));
        state.quarantine = S::select(again, self.quarantine, left);
    }

    /// Whether the window can be believed: not where the models do not explain it, nor for a while after that. `fresh`
    /// is where it is whole.
    #[inline(always)]
    pub(crate) fn judge(&self, state: &mut TrustState<S>, fresh: S::Mask) {
        let zero = S::splat(0.0);
        let settled = !state.quarantine.gt(zero) & fresh;
        let consistent = state.error.le(self.error_share * state.signal);
        let suspicious = state.signal.gt(self.excitation) & !consistent & settled;
        state.quarantine = S::select(suspicious, self.quarantine, state.quarantine);
        state.weight = S::select(consistent & settled, self.period, zero);
    }

    /// Whether its evidence counts: enough must have been asked, and neither opening (1, measured and asked, before
    /// the filters) be near its end. And how much of the older evidence stays beside it.
    #[inline(always)]
    pub(crate) fn weigh(&self, state: &mut TrustState<S>, openings: [S; 2], asked: S, asked_change: S) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let [measured, wanted] = openings;
        let square = asked * asked;
        let moved = square + self.change_weight * (asked_change * asked_change);
        let (measured, wanted) = (measured.abs(), wanted.abs());
        let wider = S::select(measured.gt(wanted), measured, wanted);
        let linear = S::select(wider.lt(self.linear_range), state.weight, zero);
        state.weight = S::select(moved.gt(self.excitation), linear, zero);
        let on = state.weight.gt(zero);
        if !on.any() {
            return;
        }
        let above = state.evidence - self.kept;
        let share = S::select(above.gt(zero), self.forgotten * above / (state.evidence + self.half), zero);
        state.keep = S::select(on, one - share, one);
        let evidence = state.keep * state.evidence + square * self.period;
        state.evidence = S::select(on, evidence, state.evidence);
    }
}
