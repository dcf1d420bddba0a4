//! The gate: whether and how long a window's evidence counts.
//!
//! The test ratio is the models' unexplained part over the allowed part, both averaged. Above 1 nothing is learned. If the
//! signal is large enough for a judgement, a hold-off follows.

#[cfg(test)]
mod tests;

use crate::integrity::integrity;
use crate::learning::flow::FlowSample;
use crate::learning::least_squares::Weight;
use crate::learning::tuning::{GATE_CAUTION, GATE_SIGNAL};
use crate::number::Real;

/// Constants of the gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gate<T> {
    /// Opening (1) from the known null beyond which the valve counts as saturated.
    pub(crate) linear_range: T,
    /// Square of the opening (1) below which nothing is learned.
    pub(crate) excitation: T,
    /// Weight of a squared change per step in the comparison with `excitation`.
    pub(crate) change_weight: T,
    /// Square of the opening (1) per square of a flow (m³/s), for comparing the two models' errors.
    pub(crate) per_square_flow: T,
    /// Share of the difference between input and average by which an average changes in a step.
    pub(crate) average: T,
    /// Allowed squared error of the models over the signals' squares (1).
    pub(crate) threshold: T,
    /// Period of the learner (s).
    pub(crate) period: T,
    /// Evidence (s, of squared opening × time) that is never forgotten.
    pub(crate) kept: T,
    /// Evidence (s) at which half of the shortest memory is reached.
    pub(crate) half: T,
    /// Largest share that is forgotten in a step.
    pub(crate) forgotten: T,
    /// Windows without learning after a rejection.
    pub(crate) hold_off: u32,
    /// Windows without learning after lost samples, until the low-passes have settled.
    pub(crate) settling: u32,
}
integrity!(Gate<T>: linear_range, excitation, change_weight, per_square_flow, average, threshold, period, kept, half, forgotten, hold_off, settling);

/// The state of the gate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct GateState<T> {
    signal: T,
    error: T,
    /// Remaining windows without learning.
    hold_off: u32,
    /// Whether something was learned since the last rejection.
    learned: bool,
    /// Whether nothing was learned since a rejection. A smaller test ratio is then rejected again.
    cautious: bool,
}
integrity!(GateState<T>: signal, error, hold_off, learned, cautious);

/// The two models' signals of a window, in the estimators' band.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Signals<T> {
    pub(crate) flow: FlowSample<T>,
    /// Measured spool opening (1).
    pub(crate) spool: T,
    /// Commanded opening (1).
    pub(crate) commanded: T,
    /// Its change over the window (1).
    pub(crate) commanded_change: T,
}

/// The gate's decision on a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Verdict {
    /// The models explain it.
    Accepted,
    /// Nothing can be learned from it.
    Passed,
    /// The models no longer explain the measurements. `learned` says whether anything was learned since the last
    /// rejection.
    Rejected { learned: bool },
}

impl<T: Real> Gate<T> {
    /// Shortens the hold-off by one window, but to no fewer than `least` windows.
    pub(crate) fn wait(&self, state: &mut GateState<T>, least: u32) {
        let left = state.hold_off.saturating_sub(1);
        state.hold_off = if left > least { left } else { least };
    }

    /// Adds the unexplained parts of both models and decides. `usable` means that the window is complete and that the
    /// learner adapts.
    pub(crate) fn judge(&self, state: &mut GateState<T>, s: &Signals<T>, usable: bool) -> Verdict {
        let FlowSample { measured, predicted, residual, .. } = s.flow;
        let spool_error = s.spool - s.commanded;
        let error = self.per_square_flow * (residual * residual) + spool_error * spool_error;
        let signal = self.per_square_flow * (measured * measured + predicted * predicted)
            + s.spool * s.spool
            + s.commanded * s.commanded;
        state.error = state.error + self.average * (error - state.error);
        state.signal = state.signal + self.average * (signal - state.signal);
        if state.hold_off > 0 || !usable {
            return Verdict::Passed;
        }
        let allowed = if state.cautious { T::splat(GATE_CAUTION) * self.threshold } else { self.threshold };
        if state.error <= allowed * state.signal {
            return Verdict::Accepted;
        }
        if !(state.signal > T::splat(GATE_SIGNAL) * self.excitation) {
            return Verdict::Passed;
        }
        let learned = state.learned;
        (state.hold_off, state.learned, state.cautious) = (self.hold_off, false, true);
        Verdict::Rejected { learned }
    }

    /// The weight of an accepted window's evidence. The commanded opening must be large enough. The measured and the
    /// commanded opening (1, before the filters) must be away from the stops.
    pub(crate) fn weight(
        &self,
        state: &mut GateState<T>,
        amount: &mut T,
        [measured, commanded]: [T; 2],
        s: &Signals<T>,
    ) -> Weight<T> {
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let square = s.commanded * s.commanded;
        let moved = square + self.change_weight * (s.commanded_change * s.commanded_change);
        let linear = measured.abs() < self.linear_range && commanded.abs() < self.linear_range;
        if !(linear && moved > self.excitation) {
            return Weight { time: zero, forgetting: one };
        }
        let above = *amount - self.kept;
        let forgetting =
            if above > zero { one - self.forgotten * above / (*amount + self.half) } else { one };
        (state.learned, state.cautious) = (true, false);
        *amount = forgetting * *amount + square * self.period;
        Weight { time: self.period, forgetting }
    }
}

impl<T: Real> GateState<T> {
    /// Whether learning is held off.
    pub(crate) fn is_held_off(&self) -> bool {
        self.hold_off > 0
    }

    /// Averaged error over the allowed one (1); 0 without a signal.
    pub(crate) fn test_ratio(&self, gate: &Gate<T>) -> T {
        let allowed = gate.threshold * self.signal;
        if allowed > T::splat(0.0) { self.error / allowed } else { T::splat(0.0) }
    }
}
