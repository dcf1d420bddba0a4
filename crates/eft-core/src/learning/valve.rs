//! Valve estimator: response delay and gain of the spool after its command.
//!
//! The inverse of the lead network converts the measured command to the opening of a perfect inverse. Least squares find
//! the gain and the further delay of the measured spool. The regressors come from the command, which contains no noise of
//! the spool's sensor, so noise does not bias the delay.

use crate::compensation::LeadNetwork;
use crate::integrity::integrity;
use crate::learning::least_squares::{GainAndDelay, LeastSquares, Priors, Weight};
use crate::learning::tuning::{FASTEST, LARGEST_DEFICIT};
use crate::number::Real;

/// Constants of the estimate; delays in s, periods in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ValveEstimator<T> {
    /// Configured unit opening per V.
    pub(crate) valve_gain: T,
    /// Configured DC gain of the lead network (V per unit opening).
    pub(crate) lead_gain: T,
    /// Lag of Tustin's lead network per response delay, 2α/(1 − α).
    pub(crate) lag_per_delay: T,
    /// Share by which the phase of a lead network falls short of its delay's, over the square of the phase. The gain of a valve with
    /// its network increases by about as much.
    pub(crate) phase_deficit: T,
    /// Sample period of the lead network.
    pub(crate) sample: T,
    /// Delay between the lead network's output and the sample of the valve command that contains it.
    pub(crate) sampling_delay: T,
    /// Priors of the spool's gain over the configured one, and of its delay after the lead network's output.
    pub(crate) priors: Priors<T>,
}
integrity!(ValveEstimator<T>: valve_gain, lead_gain, lag_per_delay, phase_deficit, sample, sampling_delay, priors);

/// The state of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct ValveState<T> {
    opening: T,
    washout: T,
    pub(crate) found: GainAndDelay<T>,
}
integrity!(ValveState<T>: opening, washout, found);

impl<T: Real> ValveState<T> {
    /// The last commanded opening (1).
    pub(crate) fn opening(&self) -> T {
        self.opening
    }
}

impl<T: Real> ValveEstimator<T> {
    /// The configured values.
    pub(crate) fn at_rest(&self) -> ValveState<T> {
        let zero = T::splat(0.0);
        ValveState { opening: zero, washout: zero, found: self.priors.at_rest() }
    }

    /// Computes the commanded opening (1) from that behind the lead network (1), by the inverse of a network for the
    /// valve alone. It is discretised by Tustin at the estimator's period.
    pub(crate) fn invert_lead(&self, state: &mut ValveState<T>, input: T, restart: bool) {
        let delay = state.found.delay.value;
        let lag = self.lag_per_delay * delay;
        let lead = delay + delay;
        let sum = lag + self.priors.period;
        let opening =
            (sum * input - (lag - self.priors.period) * state.washout + lead * state.opening) / (sum + lead);
        state.opening = if restart { input } else { opening };
        state.washout = input - state.opening;
    }

    /// Adds one step: the commanded opening (1) and its decrease, and the measured spool (1), all through the same
    /// filter.
    pub(crate) fn add(
        &self,
        state: &ValveState<T>,
        sums: &mut LeastSquares<T>,
        [commanded, decrease]: [T; 2],
        spool: T,
        weight: Weight<T>,
    ) {
        let known_delay = (state.found.delay.value - self.priors.nominal_delay
            + state.found.gain.value * self.sampling_delay)
            * self.priors.per_period;
        let regressors = [commanded, decrease];
        sums.add(regressors, regressors, spool - commanded + known_delay * decrease, weight);
    }

    /// The part of the measured spool (1) that the estimate leaves unexplained.
    pub(crate) fn residual(&self, state: &ValveState<T>, [commanded, decrease]: [T; 2], spool: T) -> T {
        spool - state.found.gain.value * (commanded - self.sampling_delay * self.priors.per_period * decrease)
    }

    /// The lead network for the valve and a velocity that is late (s), at a compensation level (1) on top of the
    /// configured one. The valve's gain and delay are those for which a network for the valve alone is exact at the
    /// motion's mean-square frequency (1/s²). There the additional increase of the amplitude by this network is removed,
    /// and its delay makes up for the phase by which it falls short of both.
    pub(crate) fn lead(
        &self,
        estimate: &GainAndDelay<T>,
        square: T,
        velocity_delay: T,
        level: T,
    ) -> LeadNetwork<T> {
        let [shortest, _] = self.priors.delay.bounds;
        // Bounded, for sums that are not finite. Without a sign its root needs no check.
        let square = square.abs();
        let square = if square < T::splat(FASTEST) { square } else { T::splat(FASTEST) };
        let valve = estimate.delay.value;
        let both = valve + velocity_delay;
        // The phase of a network falls short by a share of the third power of its delay.
        let deficit = (self.phase_deficit * square * (both * (both + valve) + valve * valve)).abs();
        let deficit = if deficit < T::splat(LARGEST_DEFICIT) { deficit } else { T::splat(LARGEST_DEFICIT) };
        let delay = both + deficit * velocity_delay;
        let delay = if delay > shortest { delay } else { shortest };
        let added = self.amplitude(delay, square) / self.amplitude(valve, square);
        let lag = self.lag_per_delay * delay;
        let per = T::splat(1.0) / (lag + self.sample);
        let gain = self.lead_gain * level / (estimate.gain.value * added.sqrt());
        LeadNetwork::of((lag - self.sample) * per, (delay + delay) * per, gain)
    }

    /// Increase of the valve's gain (1) from low frequencies to a mean-square frequency (1/s²), over the gain.
    pub(crate) fn gain_increase(&self, estimate: &GainAndDelay<T>, square: T) -> T {
        self.phase_deficit * square * estimate.delay.value * estimate.delay.value
    }

    /// The motion's mean-square frequency (1/s²).
    pub(crate) fn mean_square_frequency(&self, sums: &LeastSquares<T>) -> T {
        let [[openings, _], [_, changes]] = sums.matrix;
        let [prior, _] = self.priors.weights;
        let per_period = self.priors.per_period;
        changes / (openings + prior) * (per_period * per_period)
    }

    /// Square of a lead network's amplitude (1) for a delay (s), at the square of a frequency (1/s²).
    fn amplitude(&self, delay: T, square: T) -> T {
        let (one, lag) = (T::splat(1.0), T::splat(0.5) * self.lag_per_delay * delay);
        let lead = delay + lag;
        (one + square * (lead * lead)) / (one + square * (lag * lag))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::least_squares::Range;

    const ESTIMATOR: ValveEstimator<f64> = ValveEstimator {
        valve_gain: 0.1,
        lead_gain: 12.4,
        lag_per_delay: 2.0 / 9.0,
        phase_deficit: 1.0 / 3.0 + 0.1 / 0.81,
        sample: 1.0 / 4096.0,
        sampling_delay: 1.0 / 4096.0,
        priors: Priors {
            period: 1.0 / 256.0,
            per_period: 256.0,
            nominal_delay: 5e-3,
            weights: [1e-9; 2],
            spread: [0.0; 2],
            gain: Range { bounds: [0.8, 1.25], change: 1e-3 },
            delay: Range { bounds: [1e-3, 2e-2], change: 1e-4 },
        },
    };

    /// The estimate for a spool that follows the commanded opening with a gain and a delay (s).
    fn found(gain: f64, delay: f64) -> GainAndDelay<f64> {
        let (mut state, mut sums) = (ESTIMATOR.at_rest(), LeastSquares::default());
        let weight = Weight { time: ESTIMATOR.priors.period, forgetting: 0.99 };
        for n in 0..2000_u32 {
            let at = |n: f64| 0.2 * (0.04 * n).sin();
            let (commanded, change) = (at(f64::from(n) - 0.5), at(f64::from(n)) - at(f64::from(n) - 1.0));
            // The commanded opening comes from the inverse of the network in use, one sample before the command.
            let late = delay - ESTIMATOR.sampling_delay - state.found.delay.value;
            let spool = gain * (commanded - late * ESTIMATOR.priors.per_period * change);
            ESTIMATOR.add(&state, &mut sums, [commanded, -change], spool, weight);
            ESTIMATOR.priors.solve(&mut state.found, &sums);
        }
        state.found
    }

    #[test]
    fn gain_and_delay_are_found_and_bounded() {
        for gain in [0.82, 1.04, 1.2] {
            let state = found(gain, 6.5e-3);
            assert!(
                (state.gain.value - gain).abs() < 1e-6 && (state.delay.value - 6.5e-3).abs() < 1e-6,
                "{state:?}"
            );
            assert!(state.gain.beyond + state.delay.beyond < 1e-12);
        }
        let state = found(1.5, 5e-3);
        assert!((state.gain.value - 1.25).abs() < 1e-12 && state.gain.beyond > 0.2, "{state:?}");
    }

    #[test]
    fn a_valve_with_the_found_gain_and_delay_leaves_nothing() {
        // An opening that rises by 0.02 in a window, and a spool that follows one sample after the network's output.
        let state = ESTIMATOR.at_rest();
        let (commanded, rise) = (0.2, 0.02);
        let spool = commanded - rise * ESTIMATOR.sampling_delay / ESTIMATOR.priors.period;
        let residual = |rise: f64| ESTIMATOR.residual(&state, [commanded, -rise], spool);
        assert!(
            residual(-rise).abs() < 1e-15 && residual(rise).abs() > 1e-3,
            "{} {}",
            residual(rise),
            residual(-rise)
        );
    }

    /// Amplitude (1) and phase (rad) of the continuous lead network of a delay (s) at a frequency (1/s).
    fn network(delay: f64, omega: f64) -> (f64, f64) {
        let lag = 0.5 * ESTIMATOR.lag_per_delay * delay * omega;
        let lead = delay * omega + lag;
        ((1.0 + lead * lead).sqrt() / (1.0 + lag * lag).sqrt(), libm::atan(lead) - libm::atan(lag))
    }

    #[test]
    fn at_the_motions_frequency_the_network_has_the_phase_of_both_delays_and_the_valves_amplitude() {
        let estimate = ESTIMATOR.at_rest().found;
        let valve = estimate.delay.value;
        for omega in [10.0, 25.0, 40.0] {
            for late in [-1e-3, 1e-3, 4e-3] {
                let lead = ESTIMATOR.lead(&estimate, omega * omega, late, 1.0);
                // The delay from Tustin's pole.
                let (pole, sample) = (lead.pole(), ESTIMATOR.sample);
                let delay = sample * (1.0 + pole) / (1.0 - pole) / ESTIMATOR.lag_per_delay;
                let ((of_valve, before), (of_both, after)) = (network(valve, omega), network(delay, omega));
                let wanted = omega * late;
                let error = after - before - wanted;
                assert!(error.abs() < 0.03 * wanted.abs(), "{omega} 1/s, {late} s: {error} of {wanted}");
                let amplitude = lead.gain() / ESTIMATOR.lead_gain * of_both / of_valve;
                assert!((amplitude - 1.0).abs() < 1e-9, "{omega} 1/s, {late} s: {amplitude}");
            }
        }
    }

    #[test]
    fn network_and_inverse_undo_each_other() {
        let mut estimator = ESTIMATOR;
        estimator.priors.period = estimator.sample;
        let mut state = estimator.at_rest();
        let lead = estimator.lead(&state.found, 0.0, 0.0, 1.0);
        let mut network = LeadNetwork::at_rest(0.0);
        for n in 0..3000_u32 {
            let opening = 0.3 * (0.01 * f64::from(n)).sin();
            let input = lead.step(&mut network, opening) / estimator.lead_gain;
            estimator.invert_lead(&mut state, input, n == 0);
            if n > 500 {
                assert!((state.opening() - opening).abs() < 1e-4, "{n}");
            }
        }
    }
}
