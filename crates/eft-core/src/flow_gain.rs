//! Flow-gain estimator: the flow that the actuator shows over the flow that the table predicts.
//!
//! Least squares with the model's own spool as instrument: it follows the valve command, so the spool sensor's noise
//! is not in it, and noise in the prediction does not pull the estimate down as it would in plain least squares.

use crate::scalar::{Scalar, pack_numbers};

/// Bounds and prior of the estimate `θ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowGainEstimator<S> {
    /// Weight of the belief that `θ` is 1 (m³, of predicted flow × instrument × time).
    pub(crate) prior: S,
    /// Lowest `θ` that is believed (1).
    pub(crate) lowest: S,
    /// Highest `θ` that is believed (1).
    pub(crate) highest: S,
    /// Largest change of `θ` in a step (1).
    pub(crate) change: S,
}

pack_numbers!(FlowGainEstimator: prior, lowest, highest, change);

/// What the estimator remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct FlowGainState<S> {
    predicted: S,
    excess: S,
    pub(crate) gain: S,
    pub(crate) per_gain: S,
}

impl<S: Scalar> Default for FlowGainState<S> {
    fn default() -> Self {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        Self { predicted: zero, excess: zero, gain: one, per_gain: one }
    }
}

impl<S: Scalar> FlowGainEstimator<S> {
    /// Takes in one step's flow and prediction (m³/s) at a weight (the instrument × time; zero leaves the estimate as
    /// it is), the older ones kept by the share `keep`. True where the estimate is not believed.
    #[inline(always)]
    pub(crate) fn step(
        &self,
        state: &mut FlowGainState<S>,
        flow: S,
        predicted: S,
        weight: S,
        keep: S,
        on: S::Mask,
    ) -> S::Mask {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let sum = keep * state.predicted + weight * predicted;
        // Instrument and prediction have the same sign unless a sensor has the wrong one.
        let sum = S::select(sum.gt(zero), sum, zero);
        let excess = keep * state.excess + weight * (flow - predicted);
        let raw = one + excess / (sum + self.prior);
        let believed = raw.ge(self.lowest) & raw.le(self.highest);
        let target = S::select(believed, raw, one);
        let gain = target.limit(state.gain - self.change, state.gain + self.change);
        let next =
            Self::select(on, FlowGainState { predicted: sum, excess, gain, per_gain: one / gain }, *state);
        *state = next;
        on & !believed
    }

    #[inline(always)]
    fn select(mask: S::Mask, yes: FlowGainState<S>, no: FlowGainState<S>) -> FlowGainState<S> {
        FlowGainState {
            predicted: S::select(mask, yes.predicted, no.predicted),
            excess: S::select(mask, yes.excess, no.excess),
            gain: S::select(mask, yes.gain, no.gain),
            per_gain: S::select(mask, yes.per_gain, no.per_gain),
        }
    }
}
