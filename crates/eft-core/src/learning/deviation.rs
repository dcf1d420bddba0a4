//! Standard deviations of the estimates, by their least squares: the information that was taken in, and the mean square
//! of what the models leave unexplained of it.

use crate::compensation::Deviations;
use crate::integrity::integrity;
use crate::learning::checkpoint::Evidence;
use crate::learning::least_squares::{Estimate, GainAndDelay, Priors};
use crate::number::Real;

/// Constants of the standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation<T> {
    /// Time (s) for which an error lasts in the estimators' band: as many windows of noise say what one would.
    pub(crate) correlation: T,
}
integrity!(Deviation<T>: correlation);

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
        (flow, found_flow): (&Priors<T>, &GainAndDelay<T>),
        (valve, found_valve): (&Priors<T>, &GainAndDelay<T>),
    ) -> Deviations<T> {
        let (zero, squares) = (T::splat(0.0), &evidence.valve.matrix);
        let [[openings, _], _] = *squares;
        if !(evidence.time > zero && openings > zero) {
            return Deviations::unknown();
        }
        // A sum that forgets scatters less than one over the same time: its older errors count less.
        let per_time = self.correlation * evidence.newer_openings / (evidence.time * openings);
        let [flow_gain, velocity_delay] = flow.spread(&evidence.flow, squares);
        let [valve_gain, response_delay] = valve.spread(&evidence.valve, squares);
        let deviation = |errors: T, spread: T, estimate: &Estimate<T>| {
            (per_time * errors * spread + estimate.away * estimate.away).sqrt()
        };
        let (flow, spool) = (evidence.flow_errors, evidence.spool_errors);
        Deviations {
            flow_gain: deviation(flow, flow_gain, &found_flow.gain),
            valve_gain: deviation(spool, valve_gain, &found_valve.gain),
            response_delay: deviation(spool, response_delay, &found_valve.delay),
            velocity_delay: deviation(flow, velocity_delay, &found_flow.delay),
        }
    }
}
