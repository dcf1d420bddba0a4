//! Flow estimator: gain and delay of the actuator's measured flow relative to the flow that the table predicts.
//!
//! The delay `δ` is that of the measured velocity after the measured spool: `q(t) = θ·p(t − δ)`. Both signals are shifted
//! by half of it, `q + ½δ·q̇ = θ·(p − ½δ·ṗ)`. The amplitude is then exact, and the phase error is of third order.
//!
//! The instruments are the spool of a valve model and its rate. They follow the valve command and contain no noise of the
//! spool and velocity sensors. The noise therefore does not bias the estimates, as it would in ordinary least squares.

use crate::integrity::integrity;
use crate::learning::least_squares::{GainAndDelay, LeastSquares, Priors, Weight};
use crate::number::Real;

/// The estimator of the gain `θ` and the velocity's delay after the spool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowEstimator<T> {
    pub(crate) priors: Priors<T>,
}
integrity!(FlowEstimator<T>: priors);

/// A window's flows (m³/s) in the estimators' band.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct FlowSample<T> {
    /// The actuator's measured flow.
    pub(crate) measured: T,
    /// The flow that the table predicts.
    pub(crate) predicted: T,
    /// Its change by a delay of one window, the regressor of the delay.
    pub(crate) delay_regressor: T,
    /// The part that the estimates leave unexplained.
    pub(crate) residual: T,
}

impl<T: Real> FlowEstimator<T> {
    /// From a window's measured and predicted flow (m³/s), each with its change over a window.
    pub(crate) fn sample(
        &self,
        state: &GainAndDelay<T>,
        [measured, measured_change]: [T; 2],
        [predicted, predicted_change]: [T; 2],
    ) -> FlowSample<T> {
        let gain = state.gain.value;
        let delay_regressor = T::splat(-0.5) * (measured_change + gain * predicted_change);
        let residual =
            measured - gain * predicted - state.delay.value * self.priors.per_period * delay_regressor;
        FlowSample { measured, predicted, delay_regressor, residual }
    }

    /// Shifts a window's measured mean flow and a second flow to one instant, by a lag on the earlier one. A lag does
    /// not overshoot, unlike an extrapolation over more than a window. The lag's loss of amplitude at the motion's
    /// mean-square frequency (1/s²) is compensated.
    pub(crate) fn synchronize(
        &self,
        state: &GainAndDelay<T>,
        lagged: [T; 2],
        now: [T; 2],
        square: T,
    ) -> ([T; 2], [T; 2]) {
        let (one, delay) = (T::splat(1.0), state.delay.value.abs());
        let share = one / (one + delay * self.priors.per_period);
        let back = one + T::splat(0.5) * square * delay * (delay + self.priors.period);
        let positive = state.delay.value > T::splat(0.0);
        let (shares, gains) =
            if positive { ([one, share], [one, back]) } else { ([share, one], [back, one]) };
        let ([measured, flow], [measured_share, flow_share], [measured_now, flow_now]) =
            (lagged, shares, now);
        let [measured_gain, flow_gain] = gains;
        let (measured, flow) =
            (measured + measured_share * (measured_now - measured), flow + flow_share * (flow_now - flow));
        ([measured, flow], [measured_gain * measured, flow_gain * flow])
    }

    /// Adds a window with its instruments: an opening (1) and its decrease over a window.
    pub(crate) fn add(
        &self,
        sums: &mut LeastSquares<T>,
        s: &FlowSample<T>,
        instruments: [T; 2],
        weight: Weight<T>,
    ) {
        let signal =
            s.measured - s.predicted - self.priors.nominal_delay * self.priors.per_period * s.delay_regressor;
        sums.add(instruments, [s.predicted, s.delay_regressor], signal, weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::least_squares::{Range, Weight};

    const PRIORS: Priors<f64> = Priors {
        period: 1.0 / 256.0,
        per_period: 256.0,
        nominal_delay: 1e-3,
        weights: [1e-12; 2],
        spread: [0.0; 2],
        gain: Range { bounds: [0.7, 1.35], change: 1e-3 },
        delay: Range { bounds: [-5e-3, 1e-2], change: 1e-4 },
    };
    const ESTIMATOR: FlowEstimator<f64> = FlowEstimator { priors: PRIORS };

    /// The estimate from a flow over time (s). The instrument is a sine of 2 Hz, the prediction 1e-3 of it with noise.
    fn after(windows: u32, noise: f64, flow: impl Fn(f64) -> f64) -> GainAndDelay<f64> {
        let (mut state, mut sums) = (PRIORS.at_rest(), LeastSquares::default());
        let (mut measured, mut predicted) = ([0.0; 2], [0.0; 2]);
        for n in 0..windows {
            let time = f64::from(n) * PRIORS.period;
            let now = [flow(time), wave(time) + noise * (f64::from(n) * 12.9898).sin()];
            // Value midway between two samples, and their difference.
            let between = |last: f64, now: f64| [0.5 * (last + now), now - last];
            let sample =
                ESTIMATOR.sample(&state, between(measured[0], now[0]), between(predicted[0], now[1]));
            let [opening, change] = between(wave(time - PRIORS.period), wave(time));
            (measured[0], predicted[0]) = (now[0], now[1]);
            ESTIMATOR.add(&mut sums, &sample, [opening, -change], Weight { time: 1.0, forgetting: 0.999 });
            PRIORS.solve(&mut state, &sums);
        }
        state
    }

    fn wave(time: f64) -> f64 {
        1e-3 * (core::f64::consts::TAU * 2.0 * time).sin()
    }

    #[test]
    fn gain_and_delay_are_found_at_a_limited_rate() {
        assert!((after(21, 0.0, |t| 1.08 * wave(t)).gain.value - 1.02).abs() < 2e-3);
        for delay in [-3e-3, 0.0, 2e-3, 8e-3] {
            let found = after(4000, 0.0, |t| 1.08 * wave(t - delay));
            assert!((found.gain.value - 1.08).abs() < 1e-3, "{found:?}");
            assert!((found.delay.value - delay).abs() < 2e-5, "{delay}: {found:?}");
            assert!(found.gain.beyond < 1e-12 && found.delay.beyond < 1e-12);
        }
    }

    #[test]
    fn results_beyond_the_bounds_are_bounded_and_reported() {
        for (wrong, bound) in [(0.0, 0.7), (0.5, 0.7), (2.0, 1.35)] {
            let state = after(2000, 0.0, |t| wrong * wave(t));
            assert!(
                (state.gain.value - bound).abs() < 1e-9 && state.gain.beyond > 0.15,
                "{wrong}: {state:?}"
            );
        }
        for (delay, bound) in [(-9e-3, -5e-3), (16e-3, 1e-2)] {
            let state = after(2000, 0.0, |t| wave(t - delay));
            assert!((state.delay.value - bound).abs() < 1e-9 && state.delay.beyond > 1e-3, "{state:?}");
        }
    }

    #[test]
    fn noise_of_the_prediction_causes_no_bias() {
        // Noise as large as the signal, but not in the instrument.
        let state = after(20_000, 1e-3, |t| 1.1 * wave(t - 2e-3));
        assert!((state.gain.value - 1.1).abs() < 1e-2, "{state:?}");
        assert!((state.delay.value - 2e-3).abs() < 2e-4, "{state:?}");
    }
}
