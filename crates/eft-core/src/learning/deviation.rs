//! Standard deviations of the estimates, by their least squares: the information that was taken in, and the mean square
//! of what the models leave unexplained of it.

use crate::compensation::Deviations;
use crate::learning::checkpoint::Evidence;
use crate::learning::flow_gain::{FlowGainEstimator, FlowGainState};
use crate::learning::valve::{ValveEstimator, ValveState};
use crate::number::Real;

/// Constants of the standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation<T> {
    /// Time (s) for which an error lasts in the estimators' band: as many windows of noise say what one would.
    pub(crate) correlation: T,
}

impl<T: Real> Deviation<T> {
    /// Takes in the asked opening (1) of one window and what the models missed of it: of the flow (m³/s) and of the
    /// spool (1). `weight` is the window's time (s), the older ones are kept by the share `keep`.
    pub(crate) fn take(
        &self,
        evidence: &mut Evidence<T>,
        asked: T,
        [flow, spool]: [T; 2],
        [weight, keep]: [T; 2],
    ) {
        evidence.time = keep * evidence.time + weight;
        evidence.newer_openings = keep * keep * evidence.newer_openings + weight * asked * asked;
        evidence.flow_errors = keep * evidence.flow_errors + weight * flow * flow;
        evidence.spool_errors = keep * evidence.spool_errors + weight * spool * spool;
    }

    /// By what has been taken in; infinite where nothing has. What an estimate in use is away from the one that was found,
    /// by a bound or a limited rate, counts in.
    pub(crate) fn of(
        &self,
        evidence: &Evidence<T>,
        (flow_gain, found_flow): (&FlowGainEstimator<T>, &FlowGainState<T>),
        (valve, found_valve): (&ValveEstimator<T>, &ValveState<T>),
    ) -> Deviations<T> {
        let zero = T::splat(0.0);
        if !(evidence.time > zero && evidence.openings > zero) {
            return Deviations::unknown();
        }
        // A sum that forgets scatters less than one over the same time: its older errors count less.
        let per_time = self.correlation * evidence.newer_openings / (evidence.time * evidence.openings);
        let (flow, spool) = (per_time * evidence.flow_errors, per_time * evidence.spool_errors);
        let [gain, delay] = valve.spread(evidence);
        let deviation = |variance: T, away: T| (variance + away * away).sqrt();
        let [gain_away, delay_away] = found_valve.away;
        Deviations {
            flow_gain: deviation(flow * flow_gain.spread(evidence), found_flow.away),
            valve_gain: deviation(spool * gain, gain_away),
            response_delay: deviation(spool * delay, delay_away),
        }
    }
}
