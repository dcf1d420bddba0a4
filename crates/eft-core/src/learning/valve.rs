//! Valve estimator: response delay and gain of the spool behind its command.
//!
//! The measured command, taken back through the lead network, is the opening that a perfect inverse would give. What
//! the spool does instead is explained by a gain and a further delay, by least squares. The regressors come from
//! the command, which carries no sensor noise of the spool, so noise does not pull the delay down.

use crate::compensation::LeadNetwork;
use crate::learning::checkpoint::Evidence;
use crate::number::Real;

/// Constants of the estimate; delays in s, periods in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValveEstimator<T> {
    /// Unit opening per V by the configuration.
    pub(crate) valve_gain: T,
    /// DC gain of the lead network (V per unit opening) by the configuration.
    pub(crate) lead_gain: T,
    /// Lag of Tustin's lead network per response delay, 2α/(1 − α).
    pub(crate) lag_per_delay: T,
    /// Sample period of the lead network.
    pub(crate) sample: T,
    /// Period of the estimator.
    pub(crate) period: T,
    /// 1/`period`.
    pub(crate) per_period: T,
    /// Response delay by the configuration.
    pub(crate) nominal_delay: T,
    /// Delay of the velocity, which the lead network makes up for besides.
    pub(crate) velocity_delay: T,
    /// Delay between the lead network's output and the sample of the valve command that contains it.
    pub(crate) sampling_delay: T,
    /// Weight of the belief in the configured gain.
    pub(crate) gain_prior: T,
    /// Weight of the belief in the configured delay (per square of the period).
    pub(crate) delay_prior: T,
    /// Bounds of the spool's gain over the configured one (1).
    pub(crate) gain_bounds: [T; 2],
    /// Bounds of the delay.
    pub(crate) delay_bounds: [T; 2],
    /// Largest change of the gain in a step (1).
    pub(crate) gain_change: T,
    /// Largest change of the delay in a step.
    pub(crate) delay_change: T,
}

/// What the estimator remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct ValveState<T> {
    opening: T,
    washout: T,
    pub(crate) gain: T,
    pub(crate) delay: T,
    /// How far the last estimates lay beyond their bounds, both together.
    pub(crate) beyond: T,
    /// How far gain (1) and delay (s) are from them.
    pub(crate) away: [T; 2],
}

impl<T: Real> ValveState<T> {
    /// The opening (1) that was last asked.
    pub(crate) fn opening(&self) -> T {
        self.opening
    }

    pub(crate) fn new(delay: T) -> Self {
        let zero = T::splat(0.0);
        Self { opening: zero, washout: zero, gain: T::splat(1.0), delay, beyond: zero, away: [zero; 2] }
    }
}

impl<T: Real> ValveEstimator<T> {
    /// Works out the opening (1) that the lead network was asked for when it gave this valve command (V): its inverse,
    /// by Tustin at the estimator's period.
    pub(crate) fn asked(&self, state: &mut ValveState<T>, valve_command: T, restart: bool) {
        let input = self.valve_gain * valve_command;
        let delay = state.delay + self.velocity_delay;
        let lag = self.lag_per_delay * delay;
        let lead = delay + delay;
        let sum = lag + self.period;
        let opening =
            (sum * input - (lag - self.period) * state.washout + lead * state.opening) / (sum + lead);
        state.opening = if restart { input } else { opening };
        state.washout = input - state.opening;
    }

    /// Takes in one step: the asked opening (1) and its change, the measured spool (1), all through one filter.
    /// `weight` is the step's time (s), the older ones are kept by the share `keep`.
    pub(crate) fn take(
        &self,
        state: &ValveState<T>,
        evidence: &mut Evidence<T>,
        [asked, change]: [T; 2],
        spool: T,
        [weight, keep]: [T; 2],
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

    /// Goes towards the gain and the delay that explain what was taken in.
    pub(crate) fn solve(&self, state: &mut ValveState<T>, sums: &Evidence<T>) {
        let openings = sums.openings + self.gain_prior;
        let changes = sums.changes + self.delay_prior;
        let determinant = openings * changes - sums.crossed * sums.crossed;
        let per = T::splat(1.0) / determinant;
        let excess = (changes * sums.on_opening + sums.crossed * sums.on_change) * per;
        let further = (openings * sums.on_change + sums.crossed * sums.on_opening) * per;
        // The priors keep the determinant positive but for rounding; then nothing is known.
        let known = determinant > T::splat(0.0);
        let found = if known {
            [T::splat(1.0) + excess, self.nominal_delay + self.period * further]
        } else {
            [state.gain, state.delay]
        };
        self.approach(state, found);
    }

    /// Goes towards a gain (1) and a delay (s), within their bounds, at a limited rate.
    fn approach(&self, state: &mut ValveState<T>, found: [T; 2]) {
        let ([raw_gain, raw_delay], [least, most], [shortest, longest]) =
            (found, self.gain_bounds, self.delay_bounds);
        let (gain, delay) = (raw_gain.limit(least, most), raw_delay.limit(shortest, longest));
        state.beyond = (raw_gain - gain).abs() + (raw_delay - delay).abs();
        state.gain = gain.limit(state.gain - self.gain_change, state.gain + self.gain_change);
        state.delay = delay.limit(state.delay - self.delay_change, state.delay + self.delay_change);
        state.away = [raw_gain - state.gain, raw_delay - state.delay];
    }

    /// What the estimate leaves unexplained of the measured spool (1).
    pub(crate) fn missed(&self, state: &ValveState<T>, [asked, change]: [T; 2], spool: T) -> T {
        spool - state.gain * asked - (self.velocity_delay + self.sampling_delay) * self.per_period * change
    }

    /// Variances of gain (1) and delay (s²) per variance of the spool and per time over which it lasts.
    pub(crate) fn spread(&self, sums: &Evidence<T>) -> [T; 2] {
        let (openings, changes) = (sums.openings + self.gain_prior, sums.changes + self.delay_prior);
        let per = T::splat(1.0) / (openings * changes - sums.crossed * sums.crossed);
        [changes * per, openings * per * (self.period * self.period)]
    }

    /// The lead network for the estimate, at a compensation level (1) on top of the configured one.
    pub(crate) fn lead(&self, state: &ValveState<T>, level: T) -> LeadNetwork<T> {
        let delay = state.delay + self.velocity_delay;
        let lag = self.lag_per_delay * delay;
        let per = T::splat(1.0) / (lag + self.sample);
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
        gain_bounds: [0.8, 1.25],
        delay_bounds: [1e-3, 2e-2],
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
