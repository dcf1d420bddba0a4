//! When a window's evidence counts, and for how long.

use crate::scalar::{Mask, Scalar, pack_numbers};

/// Constants of the judgement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trust<S> {
    /// Openings (1) beyond which the valve is taken to be saturated.
    pub(crate) linear_range: S,
    /// Square of the opening (1) below which nothing is learned.
    pub(crate) excitation: S,
    /// Signal (square of an opening) below which what the models leave unexplained may be noise.
    pub(crate) audible: S,
    /// Weight of a squared change per step in the comparison with `excitation`.
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
    /// What is left of them in the window after that, and a half less.
    pub(crate) just_now: S,
    /// Windows without learning after lost samples, until the low-passes have settled.
    pub(crate) settling: S,
}

pack_numbers!(Trust: linear_range, excitation, audible, change_weight, per_square_flow, average, error_share, period, kept, half, forgotten, quarantine, just_now, settling);

/// What the judgement remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct TrustState<S> {
    signal: S,
    error: S,
    /// Windows left without learning.
    pub(crate) quarantine: S,
    /// Share of the older evidence that stays.
    pub(crate) keep: S,
    /// Time (s) that the window's evidence counts for.
    pub(crate) weight: S,
    /// 1 where something was learned, 0 where not since it was taken back.
    pub(crate) learned: S,
}

impl<S: Scalar> Default for TrustState<S> {
    fn default() -> Self {
        let zero = S::splat(0.0);
        Self { signal: zero, error: zero, quarantine: zero, keep: S::splat(1.0), weight: zero, learned: zero }
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

    /// One window less to wait, or some of them again.
    #[inline(always)]
    pub(crate) fn settle(&self, state: &mut TrustState<S>, again: S::Mask) {
        let left = state.quarantine - S::splat(1.0);
        let least = S::select(again, self.settling, S::splat(0.0));
        state.quarantine = S::select(left.gt(least), left, least);
    }

    /// Believes neither the window that is being filled nor those after it until the low-passes have settled.
    #[inline(always)]
    pub(crate) fn doubt(&self, state: &mut TrustState<S>, about: S::Mask) {
        let least = self.settling + S::splat(1.0);
        state.quarantine = S::select(about & state.quarantine.lt(least), least, state.quarantine);
    }

    /// Whether the window can be believed: not where the models do not explain it, nor for a while after that. `fresh`
    /// is where it is whole.
    #[inline(always)]
    pub(crate) fn judge(&self, state: &mut TrustState<S>, fresh: S::Mask) {
        let zero = S::splat(0.0);
        let settled = !state.quarantine.gt(zero) & fresh;
        let consistent = state.error.le(self.error_share * state.signal);
        let suspicious = state.signal.gt(self.audible) & !consistent & settled;
        state.quarantine = S::select(suspicious, self.quarantine, state.quarantine);
        state.weight = S::select(consistent & settled, self.period, zero);
    }

    /// Whether its evidence counts: enough must have been asked, and neither opening (1, measured and asked, before
    /// the filters) be near its end. And how much of the older evidence stays beside it.
    #[inline(always)]
    pub(crate) fn weigh(
        &self,
        state: &mut TrustState<S>,
        amount: &mut S,
        openings: [S; 2],
        [asked, asked_change]: [S; 2],
    ) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let [measured, wanted] = openings;
        let square = asked * asked;
        let moved = square + self.change_weight * (asked_change * asked_change);
        let (measured, wanted) = (measured.abs(), wanted.abs());
        let wider = S::select(measured.gt(wanted), measured, wanted);
        let linear = S::select(wider.lt(self.linear_range), state.weight, zero);
        state.weight = S::select(moved.gt(self.excitation), linear, zero);
        let on = state.weight.gt(zero);
        state.keep = one;
        if !on.any() {
            return;
        }
        let above = *amount - self.kept;
        let share = S::select(above.gt(zero), self.forgotten * above / (*amount + self.half), zero);
        state.keep = S::select(on, one - share, one);
        state.learned = S::select(on, one, state.learned);
        let evidence = state.keep * *amount + square * self.period;
        *amount = S::select(on, evidence, *amount);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUST: Trust<f64> = Trust {
        linear_range: 0.9,
        excitation: 1e-6,
        audible: 9e-6,
        change_weight: 0.0,
        per_square_flow: 1.0,
        average: 0.1,
        error_share: 0.03,
        period: 0.004,
        kept: 1e-5,
        half: 1e-3,
        forgotten: 0.016,
        quarantine: 20.0,
        just_now: 18.5,
        settling: 4.0,
    };

    fn window((state, amount): (&mut TrustState<f64>, &mut f64), asked: f64, spool: f64) -> bool {
        TRUST.settle(state, false);
        TRUST.compare(state, asked, asked, 1.0, spool, asked);
        TRUST.judge(state, true);
        TRUST.weigh(state, amount, [spool, asked], [asked, 0.0]);
        state.weight > 0.0
    }

    #[test]
    fn only_motion_that_the_models_explain_counts() {
        let (mut state, mut amount) = (TrustState::default(), 0.0);
        assert!(window((&mut state, &mut amount), 0.1, 0.1));
        assert!(!window((&mut state, &mut amount), 5e-4, 5e-4), "too small");
        assert!(!window((&mut state, &mut amount), 0.95, 0.95), "saturated");
        assert!(window((&mut state, &mut amount), 0.1, 0.1));
    }

    #[test]
    fn a_fault_is_waited_out() {
        let (mut state, mut amount) = (TrustState::default(), 0.0);
        while window((&mut state, &mut amount), 0.1, -0.1) {}
        let waited = (0..200).position(|_| window((&mut state, &mut amount), 0.1, 0.1));
        // Until the errors' average has forgotten it, and the quarantine after that.
        assert!(waited.is_some_and(|n| (19..120).contains(&n)), "{waited:?}");
    }

    #[test]
    fn old_evidence_fades_only_as_new_comes() {
        let (mut state, mut amount) = (TrustState::default(), 0.0);
        for _ in 0..1000 {
            window((&mut state, &mut amount), 0.3, 0.3);
        }
        assert!((state.keep - (1.0 - 0.016)).abs() < 0.01, "{}", state.keep);
        let before = amount;
        for _ in 0..1000 {
            window((&mut state, &mut amount), 0.0, 0.0);
        }
        assert!((amount - before).abs() < 1e-15);
    }
}
