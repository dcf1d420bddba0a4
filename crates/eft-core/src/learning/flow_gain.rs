//! Flow-gain estimator: the flow that the actuator shows over the flow that the table predicts.
//!
//! Least squares with the model's own spool as instrument: it follows the valve command, so the spool sensor's noise
//! is not in it, and noise in the prediction does not pull the estimate down as it would in plain least squares.

use crate::learning::checkpoint::Evidence;
use crate::number::Real;

/// Bounds and prior of the estimate `θ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowGainEstimator<T> {
    /// Weight of the belief that `θ` is 1 (m³, of predicted flow × instrument × time).
    pub(crate) prior: T,
    /// Bounds of `θ` (1).
    pub(crate) bounds: [T; 2],
    /// Largest change of `θ` in a step (1).
    pub(crate) change: T,
}

/// What the estimator remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct FlowGainState<T> {
    /// `θ` (1).
    pub(crate) gain: T,
    /// How far the last estimate lay beyond its bounds (1).
    pub(crate) beyond: T,
    /// How far `θ` is from it (1).
    pub(crate) away: T,
}

impl<T: Real> Default for FlowGainState<T> {
    fn default() -> Self {
        Self { gain: T::splat(1.0), beyond: T::splat(0.0), away: T::splat(0.0) }
    }
}

impl<T: Real> FlowGainEstimator<T> {
    /// Takes in one step's flow and prediction (m³/s) at a weight (the instrument × time), the older ones kept by the
    /// share `keep`, and goes towards the `θ` that explains them, within its bounds, at a limited rate.
    pub(crate) fn step(
        &self,
        state: &mut FlowGainState<T>,
        evidence: &mut Evidence<T>,
        flow: T,
        predicted: T,
        [weight, keep]: [T; 2],
    ) {
        let (zero, [lowest, highest]) = (T::splat(0.0), self.bounds);
        let sum = keep * evidence.predicted + weight * predicted;
        // Instrument and prediction have the same sign unless a sensor has the wrong one.
        evidence.predicted = if sum > zero { sum } else { zero };
        evidence.excess = keep * evidence.excess + weight * (flow - predicted);
        let raw = T::splat(1.0) + evidence.excess / (evidence.predicted + self.prior);
        let target = raw.limit(lowest, highest);
        state.gain = target.limit(state.gain - self.change, state.gain + self.change);
        state.beyond = (raw - target).abs();
        state.away = raw - state.gain;
    }

    /// Variance of `θ` per variance of the flow and per time over which it lasts.
    pub(crate) fn spread(&self, evidence: &Evidence<T>) -> T {
        let predicted = evidence.predicted + self.prior;
        evidence.openings / (predicted * predicted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ESTIMATOR: FlowGainEstimator<f64> =
        FlowGainEstimator { prior: 1e-9, bounds: [0.7, 1.35], change: 1e-3 };

    fn after(windows: u32, flow: impl Fn(f64) -> f64) -> FlowGainState<f64> {
        let (mut state, mut evidence) = (FlowGainState::default(), Evidence::default());
        for n in 0..windows {
            let predicted = 1e-3 * (0.1 * f64::from(n)).sin();
            ESTIMATOR.step(&mut state, &mut evidence, flow(predicted), predicted, [predicted, 0.99]);
        }
        state
    }

    #[test]
    fn the_ratio_is_found_at_a_limited_rate() {
        assert!((after(21, |q| 1.08 * q).gain - 1.02).abs() < 1e-9);
        let found = after(500, |q| 1.08 * q);
        assert!((found.gain - 1.08).abs() < 1e-3 && found.beyond.abs() < 1e-12);
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
            ESTIMATOR.step(&mut state, &mut evidence, 1.1 * truth, truth + noise, [truth, 0.9999]);
        }
        assert!((state.gain - 1.1).abs() < 5e-3, "{}", state.gain);
    }
}
