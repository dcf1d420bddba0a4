//! Standard deviations of the estimates: the scatter by noise, and the size of what the models leave out.
//!
//! The scatter follows from the least squares: the information that was taken in, and the mean square of what the models
//! leave unexplained of it. What the models leave out is the same in every test. At the motion's frequency `ω` they contain
//! the first power of `ωT` of a delay `T`:
//!
//! - The lead network for a delay `T` turns the phase by `ωT·(1 − (1/3 + α/(1 − α)²)·(ωT)²)`. A spool of two or three stages
//!   differs from its inverse by as much, in gain and delay.
//! - The velocity's delay `δ` counts for the whole flow, but the force shows what leaks and what compresses the oil. The
//!   delay of these flows differs by `δ`, and by the half sample between the mean of a force and its change. The estimated
//!   delay is wrong by the oil's share of the flow, since the oil's flow is in phase with the piston's. What leaks is in
//!   quadrature with it: its share times `ωδ` is the error of the flow gain.

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
    /// Square of the opening (1) per square of a flow (m³/s).
    pub(crate) per_square_flow: T,
    /// Half a sample (s).
    pub(crate) half_sample: T,
    /// Square of the frequency (1/s²) below which more leaks than compresses the oil; positive.
    pub(crate) leaks_below: T,
    /// Share of `(ωT)²` by which the phase of the lead network for a delay `T` differs from `ωT`.
    pub(crate) of_phase: T,
}
integrity!(Deviation<T>: correlation, per_square_flow, half_sample, leaks_below, of_phase);

/// Squares of what the models leave out: of flow gain (1), valve gain (1), response delay (s) and velocity delay (s).
#[derive(Debug, Clone, Copy)]
pub(super) struct LeftOut<T> {
    pub(super) flow_gain: T,
    pub(super) valve_gain: T,
    pub(super) response_delay: T,
    pub(super) velocity_delay: T,
}

impl<T: Real> Deviation<T> {
    /// Takes in the asked opening (1) of one window, the flow (m³/s) that compressed the oil, and what the models missed: of
    /// the flow (m³/s) and of the spool (1). `weight` is the window's time (s), the older ones are kept by the share `keep`.
    pub(crate) fn take(
        &self,
        evidence: &mut Evidence<T>,
        [asked, compressed]: [T; 2],
        [flow, spool]: [T; 2],
        [weight, keep]: [T; 2],
    ) {
        evidence.time = keep * evidence.time + weight;
        evidence.newer_openings = keep * keep * evidence.newer_openings + weight * asked * asked;
        evidence.compressed = keep * evidence.compressed + weight * compressed * compressed;
        evidence.flow_errors = keep * evidence.flow_errors + weight * flow * flow;
        evidence.spool_errors = keep * evidence.spool_errors + weight * spool * spool;
    }

    /// By what has been taken in, at the motion's mean-square frequency (1/s²); infinite where nothing has. What an estimate
    /// in use is away from the one that was found, by a bound or a limited rate, counts in.
    pub(crate) fn of(
        &self,
        evidence: &Evidence<T>,
        square: T,
        (flow, found_flow): (&Priors<T>, &GainAndDelay<T>),
        (valve, found_valve): (&Priors<T>, &GainAndDelay<T>),
    ) -> Deviations<T> {
        let (zero, squares) = (T::splat(0.0), &evidence.valve.matrix);
        let [[openings, _], _] = *squares;
        if !(evidence.time > zero && openings > zero) {
            return Deviations::unknown();
        }
        let late = self.late(found_flow);
        let not_late = self.per_square_flow * evidence.compressed / openings * late * late;
        let left_out = self.left_out(not_late, square, found_flow, found_valve);
        // A sum that forgets scatters less than one over the same time: its older errors count less.
        let per_time = self.correlation * evidence.newer_openings / (evidence.time * openings);
        let [flow_gain, velocity_delay] = flow.spread(&evidence.flow, squares);
        let [valve_gain, response_delay] = valve.spread(&evidence.valve, squares);
        let deviation = |errors: T, spread: T, left_out: T, estimate: &Estimate<T>| {
            (per_time * errors * spread + left_out + estimate.away * estimate.away).sqrt()
        };
        let (flow, spool) = (evidence.flow_errors, evidence.spool_errors);
        Deviations {
            flow_gain: deviation(flow, flow_gain, left_out.flow_gain, &found_flow.gain),
            valve_gain: deviation(spool, valve_gain, left_out.valve_gain, &found_valve.gain),
            response_delay: deviation(spool, response_delay, left_out.response_delay, &found_valve.delay),
            velocity_delay: deviation(flow, velocity_delay, left_out.velocity_delay, &found_flow.delay),
        }
    }

    /// What the models leave out at the motion's mean-square frequency (1/s²). `not_late` (s²) is the square of the time by
    /// which the flow that the force shows is less late, times the square of its share of the flow.
    pub(super) fn left_out(
        &self,
        not_late: T,
        square: T,
        flow: &GainAndDelay<T>,
        valve: &GainAndDelay<T>,
    ) -> LeftOut<T> {
        let response = valve.delay.value;
        let of_spool = self.of_phase * square * response * response;
        let (of_gain, of_response) = (of_spool * valve.gain.value, of_spool * response);
        let leak = not_late * self.leaks(square);
        LeftOut {
            flow_gain: square * leak * flow.gain.value * flow.gain.value,
            valve_gain: of_gain * of_gain,
            response_delay: of_response * of_response,
            velocity_delay: not_late - leak,
        }
    }

    /// Share (1) of what leaks in the square of the flow that the force shows, at a mean-square frequency (1/s²).
    pub(super) fn leaks(&self, square: T) -> T {
        self.leaks_below / (self.leaks_below + square)
    }

    /// By how much (s) the flow that the force shows is less late than the velocity.
    pub(super) fn late(&self, flow: &GainAndDelay<T>) -> T {
        flow.delay.value.abs() + self.half_sample
    }
}
