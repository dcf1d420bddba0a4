//! Flow-gain estimator: the flow that the actuator shows over the flow that the table predicts.
//!
//! Least squares with the model's own spool as instrument: it follows the valve command, so the spool sensor's noise
//! is not in it, and noise in the prediction does not pull the estimate down as it would in plain least squares.

use crate::evidence::Evidence;
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
    pub(crate) gain: S,
    pub(crate) per_gain: S,
    /// What the last estimate had too much or too little to be believed (1).
    pub(crate) beyond: S,
}

impl<S: Scalar> Default for FlowGainState<S> {
    fn default() -> Self {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        Self { gain: one, per_gain: one, beyond: zero }
    }
}

impl<S: Scalar> FlowGainEstimator<S> {
    /// Takes in one step's flow and prediction (m³/s) at a weight (the instrument × time), the older ones kept by the
    /// share `keep`, and goes towards the `θ` that explains them, within its bounds, at a limited rate.
    #[inline(always)]
    pub(crate) fn step(
        &self,
        state: &mut FlowGainState<S>,
        evidence: &mut Evidence<S>,
        flow: S,
        predicted: S,
        [weight, keep]: [S; 2],
        on: S::Mask,
    ) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let sum = keep * evidence.predicted + weight * predicted;
        // Instrument and prediction have the same sign unless a sensor has the wrong one.
        let sum = S::select(sum.gt(zero), sum, zero);
        let excess = keep * evidence.excess + weight * (flow - predicted);
        let raw = one + excess / (sum + self.prior);
        let target = raw.limit(self.lowest, self.highest);
        let gain = target.limit(state.gain - self.change, state.gain + self.change);
        evidence.predicted = S::select(on, sum, evidence.predicted);
        evidence.excess = S::select(on, excess, evidence.excess);
        state.gain = S::select(on, gain, state.gain);
        state.beyond = S::select(on, (raw - target).abs(), state.beyond);
    }
}

impl<S: Scalar> FlowGainState<S> {
    /// Brings the reciprocal up to the gain.
    #[inline(always)]
    pub(crate) fn invert(&mut self) {
        self.per_gain = S::splat(1.0) / self.gain;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ESTIMATOR: FlowGainEstimator<f64> =
        FlowGainEstimator { prior: 1e-9, lowest: 0.7, highest: 1.35, change: 1e-3 };

    fn after(windows: u32, flow: impl Fn(f64) -> f64) -> FlowGainState<f64> {
        let (mut state, mut evidence) = (FlowGainState::default(), Evidence::default());
        for n in 0..windows {
            let predicted = 1e-3 * (0.1 * f64::from(n)).sin();
            ESTIMATOR.step(&mut state, &mut evidence, flow(predicted), predicted, [predicted, 0.99], true);
        }
        state.invert();
        state
    }

    #[test]
    fn the_ratio_is_found_at_a_limited_rate() {
        assert!((after(21, |q| 1.08 * q).gain - 1.02).abs() < 1e-9);
        let found = after(500, |q| 1.08 * q);
        assert!((found.gain - 1.08).abs() < 1e-3 && found.beyond.abs() < 1e-12);
        assert!((found.per_gain * found.gain - 1.0).abs() < 1e-15);
    }

    #[test]
    fn what_lies_beyond_the_bounds_counts_as_the_bound_and_is_told() {
        for (wrong, bound) in [(-1.0, 0.7), (0.0, 0.7), (0.5, 0.7), (2.0, 1.35)] {
            let state = after(1000, |q| wrong * q);
            assert!((state.gain - bound).abs() < 1e-9 && state.beyond > 0.15, "{wrong}: {state:?}");
        }
    }

    #[test]
    fn noise_of_the_prediction_does_not_pull_it_down() {
        let (mut state, mut evidence) = (FlowGainState::default(), Evidence::default());
        for n in 0..20_000_u32 {
            let truth = 1e-3 * (0.1 * f64::from(n)).sin();
            // As large as the signal, but not in the instrument.
            let noise = 1e-3 * (f64::from(n) * 12.9898).sin();
            ESTIMATOR.step(&mut state, &mut evidence, 1.1 * truth, truth + noise, [truth, 0.9999], true);
        }
        assert!((state.gain - 1.1).abs() < 5e-3, "{}", state.gain);
    }
}
