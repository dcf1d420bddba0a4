//! Valve estimator: response delay and gain of the spool behind its command.
//!
//! The measured command, taken back through the lead network, is the opening that a perfect inverse would give. What
//! the spool does instead is explained by a gain and a further delay, by least squares. The regressors come from
//! the command, which carries no sensor noise of the spool, so noise does not pull the delay down.

use crate::evidence::Evidence;
use crate::lead::LeadNetwork;
use crate::scalar::{Scalar, pack_numbers};

/// Constants of the estimate; delays in s, periods in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValveEstimator<S> {
    /// Unit opening per V by the configuration.
    pub(crate) valve_gain: S,
    /// DC gain of the lead network (V per unit opening) by the configuration.
    pub(crate) lead_gain: S,
    /// Lag of Tustin's lead network per response delay, 2α/(1 − α).
    pub(crate) lag_per_delay: S,
    /// Sample period of the lead network.
    pub(crate) sample: S,
    /// Period of the estimator.
    pub(crate) period: S,
    /// 1/`period`.
    pub(crate) per_period: S,
    /// Response delay by the configuration.
    pub(crate) nominal_delay: S,
    /// Delay of the velocity, which the lead network makes up for besides.
    pub(crate) velocity_delay: S,
    /// Delay between the lead network's output and the sample of the valve command that contains it.
    pub(crate) sampling_delay: S,
    /// Weight of the belief in the configured gain.
    pub(crate) gain_prior: S,
    /// Weight of the belief in the configured delay (per square of the period).
    pub(crate) delay_prior: S,
    /// Bounds of the spool's gain over the configured one (1).
    pub(crate) lowest_gain: S,
    /// See `lowest_gain`.
    pub(crate) highest_gain: S,
    /// Bounds of the delay.
    pub(crate) lowest_delay: S,
    /// See `lowest_delay`.
    pub(crate) highest_delay: S,
    /// Largest change of the gain in a step (1).
    pub(crate) gain_change: S,
    /// Largest change of the delay in a step.
    pub(crate) delay_change: S,
}

pack_numbers!(ValveEstimator: valve_gain, lead_gain, lag_per_delay, sample, period, per_period, nominal_delay, velocity_delay, sampling_delay, gain_prior, delay_prior, lowest_gain, highest_gain, lowest_delay, highest_delay, gain_change, delay_change);

/// What the estimator remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct ValveState<S> {
    opening: S,
    washout: S,
    found_gain: S,
    found_delay: S,
    gain_beyond: S,
    pub(crate) gain: S,
    pub(crate) delay: S,
    /// How far the last estimates lay beyond their bounds, both together.
    pub(crate) beyond: S,
}

impl<S: Scalar> ValveState<S> {
    /// The opening (1) that was last asked.
    pub(crate) fn opening(&self) -> S {
        self.opening
    }

    pub(crate) fn new(delay: S) -> Self {
        let zero = S::splat(0.0);
        Self {
            opening: zero,
            washout: zero,
            found_gain: S::splat(1.0),
            found_delay: delay,
            gain_beyond: zero,
            gain: S::splat(1.0),
            delay,
            beyond: zero,
        }
    }
}

impl<S: Scalar> ValveEstimator<S> {
    /// Works out the opening (1) that the lead network was asked for when it gave this valve command (V): its inverse,
    /// by Tustin at the estimator's period.
    #[inline(always)]
    pub(crate) fn asked(&self, state: &mut ValveState<S>, valve_command: S, restart: S::Mask) {
        let input = self.valve_gain * valve_command;
        let delay = state.delay + self.velocity_delay;
        let lag = self.lag_per_delay * delay;
        let lead = delay + delay;
        let sum = lag + self.period;
        let opening =
            (sum * input - (lag - self.period) * state.washout + lead * state.opening) / (sum + lead);
        state.opening = S::select(restart, input, opening);
        state.washout = input - state.opening;
    }

    /// Takes in one step: the asked opening (1) and its change, the measured spool (1), all through one filter.
    /// `weight` is the step's time (s), the older ones are kept by the share `keep`.
    #[inline(always)]
    pub(crate) fn take(
        &self,
        state: &ValveState<S>,
        evidence: &mut Evidence<S>,
        [asked, change]: [S; 2],
        spool: S,
        [weight, keep]: [S; 2],
    ) {
        let known =
            (state.delay + self.velocity_delay - self.nominal_delay + self.sampling_delay) * self.per_period;
        let error = weight * (spool - asked - known * change);
        let sums = evidence;
        sums.openings = keep * sums.openings + weight * asked * asked;
        sums.crossed = keep * sums.crossed + weight * asked * change;
        sums.changes = keep * sums.changes + weight * change * change;
        sums.on_opening = keep * sums.on_opening + error * asked;
        sums.on_change = keep * sums.on_change - error * change;
    }

    /// Gain and delay that explain what was taken in, the gain within its bounds.
    #[inline(always)]
    pub(crate) fn solve(&self, state: &mut ValveState<S>, sums: &Evidence<S>) {
        let openings = sums.openings + self.gain_prior;
        let changes = sums.changes + self.delay_prior;
        let determinant = openings * changes - sums.crossed * sums.crossed;
        let per = S::splat(1.0) / determinant;
        let excess = (changes * sums.on_opening + sums.crossed * sums.on_change) * per;
        let further = (openings * sums.on_change + sums.crossed * sums.on_opening) * per;
        // The priors keep the determinant positive but for rounding; then nothing is known.
        let known = determinant.gt(S::splat(0.0));
        let gain = S::select(known, S::splat(1.0) + excess, state.gain);
        state.found_gain = gain.limit(self.lowest_gain, self.highest_gain);
        state.gain_beyond = (gain - state.found_gain).abs();
        state.found_delay = S::select(known, self.nominal_delay + self.period * further, state.delay);
    }

    /// Goes to what was found, the delay within its bounds, both at a limited rate.
    #[inline(always)]
    pub(crate) fn correct(&self, state: &mut ValveState<S>, on: S::Mask) {
        let gain = state.found_gain;
        let delay = state.found_delay.limit(self.lowest_delay, self.highest_delay);
        let beyond = state.gain_beyond + (state.found_delay - delay).abs();
        let gain = gain.limit(state.gain - self.gain_change, state.gain + self.gain_change);
        let delay = delay.limit(state.delay - self.delay_change, state.delay + self.delay_change);
        state.gain = S::select(on, gain, state.gain);
        state.delay = S::select(on, delay, state.delay);
        state.beyond = S::select(on, beyond, state.beyond);
    }

    /// The lead network for the estimate, at a compensation level (1) on top of the configured one.
    #[inline(always)]
    pub(crate) fn lead(&self, state: &ValveState<S>, level: S) -> LeadNetwork<S> {
        let delay = state.delay + self.velocity_delay;
        let lag = self.lag_per_delay * delay;
        let per = S::splat(1.0) / (lag + self.sample);
        let lead = delay + delay;
        LeadNetwork::of((lag - self.sample) * per, lead * per, self.lead_gain * level / state.gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ESTIMATOR: ValveEstimator<f64> = ValveEstimator {
        valve_gain: 0.1,
        lead_gain: 12.4,
        lag_per_delay: 2.0 / 9.0,
        sample: 1.0 / 4096.0,
        period: 1.0 / 256.0,
        per_period: 256.0,
        nominal_delay: 5e-3,
        velocity_delay: 0.0,
        sampling_delay: 1.0 / 4096.0,
        gain_prior: 1e-9,
        delay_prior: 1e-9,
        lowest_gain: 0.8,
        highest_gain: 1.25,
        lowest_delay: 1e-3,
        highest_delay: 2e-2,
        gain_change: 1e-3,
        delay_change: 1e-4,
    };

    /// The estimate of a spool that follows what was asked by a gain and a delay (s).
    fn found(gain: f64, delay: f64) -> ValveState<f64> {
        let (mut state, mut evidence) = (ValveState::new(ESTIMATOR.nominal_delay), Evidence::default());
        for n in 0..2000_u32 {
            let at = |n: f64| 0.2 * (0.04 * n).sin();
            let (asked, change) = (at(f64::from(n) - 0.5), at(f64::from(n)) - at(f64::from(n) - 1.0));
            // The asked opening comes through the inverse of the network in use, one sample before the command.
            let late = delay - ESTIMATOR.sampling_delay - state.delay;
            let spool = gain * asked - late * ESTIMATOR.per_period * change;
            ESTIMATOR.take(&state, &mut evidence, [asked, change], spool, [ESTIMATOR.period, 0.99]);
            ESTIMATOR.solve(&mut state, &evidence);
            ESTIMATOR.correct(&mut state, true);
        }
        state
    }

    #[test]
    fn gain_and_delay_are_found_and_bounded() {
        let state = found(1.04, 6.5e-3);
        assert!((state.gain - 1.04).abs() < 1e-4 && (state.delay - 6.5e-3).abs() < 1e-5, "{state:?}");
        assert!(state.beyond.abs() < 1e-12);
        let state = found(1.5, 5e-3);
        assert!((state.gain - 1.25).abs() < 1e-12 && state.beyond > 0.2, "{state:?}");
    }

    #[test]
    fn network_and_inverse_undo_each_other() {
        let mut estimator = ESTIMATOR;
        estimator.period = estimator.sample;
        let mut state = ValveState::new(estimator.nominal_delay);
        let lead = estimator.lead(&state, 1.0);
        let mut network = LeadNetwork::at_rest(0.0);
        for n in 0..3000_u32 {
            let opening = 0.3 * (0.01 * f64::from(n)).sin();
            // The network's voltage goes through the proportional gain, which its own gain is divided by.
            let voltage = lead.step(&mut network, opening) / (estimator.lead_gain * estimator.valve_gain);
            estimator.asked(&mut state, voltage, n == 0);
            if n > 500 {
                assert!((state.opening() - opening).abs() < 1e-4, "{n}");
            }
        }
    }
}
