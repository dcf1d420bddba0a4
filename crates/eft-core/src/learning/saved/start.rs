//! A learner that starts from a saved calibration.

use super::SavedCalibration;
use super::check::check_deviations;
use crate::compensation::{NODES, PIECES};
use crate::error::ConfigError;
use crate::learning::checkpoint::{Checkpoints, Evidence};
use crate::learning::deviation::Deviation;
use crate::learning::flow_curve::{Known, Memory};
use crate::learning::learner::{Learner, LearnerState};
use crate::learning::least_squares::{Estimate, GainAndDelay, LeastSquares, Priors, Range};
use crate::number::Real;

impl<T: Real, const N: usize> Learner<T, N> {
    /// A learner at rest with the saved estimates and their evidence. A channel that begins
    /// [with its first calibration](crate::Channel::at_rest_with) uses them from the first tick. Otherwise they take
    /// effect at the first tick of the third window. A learner that does not adapt, and data without evidence, give
    /// [`at_rest`](Self::at_rest). New windows replace the evidence like any other.
    ///
    /// # Errors
    /// Another version; a flow table with another greatest flow; an estimate beyond the learner's bounds; a mean
    /// beyond that of the largest signals, or that no motion has; means whose standard deviations are not finite; a
    /// departure of more than a fifth of its flow. Each by name.
    pub fn start_from(&self, saved: &SavedCalibration) -> Result<LearnerState<T>, ConfigError> {
        let mut state = self.at_rest();
        self.check(saved)?;
        if !(self.adapts && T::from_f64(saved.excitation) > T::splat(0.0)) {
            return Ok(state);
        }
        let away = &saved.evidence.distances;
        state.flow = self
            .flow
            .priors
            .at([saved.flow_gain, saved.velocity_delay], [away.flow_gain, away.velocity_delay]);
        state.valve.found = self
            .valve
            .priors
            .at([saved.valve_gain, saved.response_delay], [away.valve_gain, away.response_delay]);
        state.evidence = self.evidence(saved, &state.flow, &state.valve.found);
        if self.corrects {
            self.start_curve(&mut state, saved);
        }
        let square = self.valve.mean_square_frequency(&state.evidence.valve);
        let gain_increase = self.valve.gain_increase(&state.valve.found, square);
        state.curve.disturbance = Deviation::disturbance(&state.evidence, gain_increase);
        state.deviations = self.deviations(&state, square, gain_increase);
        check_deviations(&state.deviations)?;
        state.checkpoints = Checkpoints::of(&state.evidence);
        Ok(state)
    }

    /// The sums of these means.
    fn evidence(
        &self,
        saved: &SavedCalibration,
        flow: &GainAndDelay<T>,
        valve: &GainAndDelay<T>,
    ) -> Evidence<T> {
        let of = T::from_f64;
        let (e, all) = (&saved.evidence, saved.excitation);
        let period = self.valve.priors.period.to_f64();
        let opening_change = of(-all * e.growth * period);
        let squares = [
            [of(all), opening_change],
            [opening_change, of(all * e.mean_square_frequency * period * period)],
        ];
        let flows = [
            [of(all * e.flow), of(-all * e.flow_rate * period)],
            [of(-all * e.rate_flow * period), of(all * e.rate_flow_rate * period * period)],
        ];
        Evidence {
            flow: LeastSquares::of(&self.flow.priors, flows, flow),
            valve: LeastSquares::of(&self.valve.priors, squares, valve),
            amount: of(all),
            newer_openings: of(all * e.mean_weight),
            time: of(e.time),
            flow_errors: of(e.time * e.flow_error * e.flow_error),
            spool_errors: of(e.time * e.spool_error * e.spool_error),
            compressed: of(all * e.compressed_flow * e.compressed_flow),
            ..Evidence::default()
        }
    }

    /// Sets the correction of the curve.
    fn start_curve(&self, state: &mut LearnerState<T>, saved: &SavedCalibration) {
        let (of, curve, step) = (T::from_f64, &saved.curve, self.curve.grid.step);
        let per_step = 1.0 / step.to_f64();
        let known = Known {
            mean_square: of(curve.error * per_step * (curve.error * per_step)),
            asymmetry: [of(curve.asymmetry), of(curve.asymmetry_deviation)],
            common: of(curve.mean_departure),
            share: of(curve.flow_gain_share),
            openings: of(saved.excitation) * self.flow.priors.per_period,
            sensor: of(curve.sensor_offset),
            null: [of(saved.null_offset - self.known_null()), of(saved.evidence.distances.null_offset)],
            memory: Memory {
                time: of(curve.time),
                null_time: of(curve.null_time),
                null_coupling: of(curve.null_coupling),
            },
        };
        let evidence = &mut state.evidence.curve;
        evidence.departures = steps(&curve.departures, per_step);
        let stated = steps(&curve.departure_deviations, per_step).map(|deviation: T| deviation * deviation);
        state.curve.nodes.variances = self.curve.filter_variances(&stated, &evidence.departures);
        let gains = [state.flow.gain.value, self.flow_gain];
        self.curve.start((&mut state.curve, evidence), &known, gains);
        // The map increases after every step of the construction.
        for _ in 0..NODES * NODES {
            state.curve.nodes.refresh_next(&evidence.departures, evidence.asymmetry, step);
        }
    }
}

/// Flows (m³/s) of the nodes in steps. Those at the ends and at zero have no departure.
fn steps<T: Real>(flows: &[f64; NODES], per_step: f64) -> [T; NODES] {
    let mut node = 0;
    flows.map(|flow| {
        let inner = node > 0 && node < PIECES;
        node += 1;
        T::from_f64(if inner { flow * per_step } else { 0.0 })
    })
}

impl<T: Real> Priors<T> {
    /// A gain (1) and a delay (s), within their bounds, and the distances of the last results from them.
    fn at(&self, [gain, delay]: [f64; 2], [gain_distance, delay_distance]: [f64; 2]) -> GainAndDelay<T> {
        GainAndDelay { gain: self.gain.at(gain, gain_distance), delay: self.delay.at(delay, delay_distance) }
    }
}

impl<T: Real> Range<T> {
    /// An estimate within the bounds, at a distance from its last result.
    fn at(&self, value: f64, distance: f64) -> Estimate<T> {
        let [least, most] = self.bounds;
        let (value, away) = (T::from_f64(value).limit(least, most), T::from_f64(distance));
        let result = value + away;
        Estimate { value, away, beyond: (result - result.limit(least, most)).abs() }
    }
}

impl<T: Real> LeastSquares<T> {
    /// Sums whose result is what the estimates are to follow.
    fn of(priors: &Priors<T>, matrix: [[T; 2]; 2], found: &GainAndDelay<T>) -> Self {
        let ([[a, b], [c, d]], [gain_prior, delay_prior]) = (matrix, priors.weights);
        let further = found.gain.value + found.gain.away - T::splat(1.0);
        let late = (found.delay.value + found.delay.away - priors.nominal_delay) * priors.per_period;
        Self {
            matrix,
            right: [(a + gain_prior) * further + b * late, c * further + (d + delay_prior) * late],
        }
    }
}
