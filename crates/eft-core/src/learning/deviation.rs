//! Standard deviations of the estimates: the scatter by noise, and the size of the models' systematic errors.
//!
//! The scatter follows from the least squares: their information, and the mean square of the residuals. The systematic
//! errors are the same in every test. At the motion's frequency `ω` the models contain a delay `T` to the first power of
//! `ωT`:
//!
//! - The phase of the lead network for a delay `T` is `ωT·(1 − (1/3 + α/(1 − α)²)·(ωT)²)`. A spool of two or three stages
//!   differs from its model by as much, in gain and delay.
//! - The model applies the velocity's delay `δ` to the whole flow. The flows of leakage and of the oil's compression follow
//!   from the force, so their delay differs by `δ` and by the half sample between the mean of a force and its change. The
//!   oil's flow is in phase with the piston's: its share of the flow is the relative error of the delay. The leakage is in
//!   quadrature: its share times `ωδ` is the error of the flow gain.
//! - The null offset `b` is found beside the mean `s` of the spool's reading minus its gain `g` times the commanded opening,
//!   `b = (b₀ - s)/g` with `s = (1 - g)·b₀`: an error of `g` has no effect, unless it changes. As `s` is an average over `τ`,
//!   a change of `g` by `Δ` during the memory `m` of the null offset changes it by `b·(Δ/g)·τ/m`. The systematic error of
//!   `g` increases with the frequency, so `Δ` is about the standard deviation of `g`.

use crate::compensation::Deviations;
use crate::integrity::integrity;
use crate::learning::checkpoint::Evidence;
use crate::learning::least_squares::{GainAndDelay, Priors};
use crate::number::Real;

/// Constants of the standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation<T> {
    /// Correlation time (s) of an error in the estimators' band. The windows within it count as one.
    pub(crate) correlation: T,
    /// Duration (s) of an error of the flow curve over twice the time (s) that averages the offset of the spool's sensor.
    pub(crate) mean_correlation: T,
    /// Square of the opening (1) per square of a flow (m³/s).
    pub(crate) per_square_flow: T,
    /// Half a sample (s).
    pub(crate) half_sample: T,
    /// Square of the frequency (1/s²) below which the leakage exceeds the oil's flow; positive.
    pub(crate) leaks_below: T,
    /// Share of `(ωT)²` by which the phase of the lead network for a delay `T` differs from `ωT`.
    pub(crate) of_phase: T,
}
integrity!(Deviation<T>: correlation, mean_correlation, per_square_flow, half_sample, leaks_below, of_phase);

/// Squares of the systematic errors: of flow gain (1), valve gain (1), response delay (s) and velocity delay (s).
#[derive(Debug, Clone, Copy)]
pub(super) struct LeftOut<T> {
    pub(super) flow_gain: T,
    pub(super) valve_gain: T,
    pub(super) response_delay: T,
    pub(super) velocity_delay: T,
}

impl<T: Real> Deviation<T> {
    /// Adds one window: the commanded opening (1), the flow (m³/s) that compressed the oil, and the residuals of flow
    /// (m³/s) and spool (1). `weight` is the window's time (s); `keep` is the remaining share of the older sums.
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

    /// The standard deviations at the motion's mean-square frequency (1/s²); infinite without evidence. They include
    /// the difference between the estimate in use and the one found, which a bound or a limited rate causes. `of_null`
    /// is the variance of the null offset by the flow, and its error (1) per relative error of the spool's gain. `share` is
    /// the [share](super::flow_curve::FlowCurve::share) of the flow gain that follows from the departures (1).
    pub(crate) fn of(
        &self,
        evidence: &Evidence<T>,
        square: T,
        (flow, found_flow): (&Priors<T>, &GainAndDelay<T>),
        (valve, found_valve): (&Priors<T>, &GainAndDelay<T>),
        [of_null, late_gain]: [T; 2],
        share: T,
    ) -> Deviations<T> {
        let (zero, squares) = (T::splat(0.0), &evidence.valve.matrix);
        let [[openings, _], _] = *squares;
        if !(evidence.time > zero && openings > zero) {
            return Deviations::unknown();
        }
        let late = self.late(found_flow);
        let not_late = self.per_square_flow * evidence.compressed / openings * late * late;
        let left_out = self.left_out(not_late, square, found_flow, found_valve);
        // A sum with forgetting scatters less than a sum over the same time, because its older errors have less weight.
        let per_time = self.correlation * evidence.newer_openings / (evidence.time * openings);
        let [flow_gain, velocity_delay] = flow.spread(&evidence.flow, squares);
        let [valve_gain, response_delay] = valve.spread(&evidence.valve, squares);
        let deviation = |errors: T, spread: T, left_out: T, away: T| {
            (per_time * errors * spread + left_out + away * away).sqrt()
        };
        let (flow, spool) = (evidence.flow_errors, evidence.spool_errors);
        let valve_gain = deviation(spool, valve_gain, left_out.valve_gain, found_valve.gain.away);
        let flow_away = found_flow.gain.away - share * found_flow.gain.value;
        let by_gain = late_gain * valve_gain / found_valve.gain.value;
        Deviations {
            flow_gain: deviation(flow, flow_gain, left_out.flow_gain, flow_away),
            valve_gain,
            response_delay: deviation(spool, response_delay, left_out.response_delay, found_valve.delay.away),
            velocity_delay: deviation(flow, velocity_delay, left_out.velocity_delay, found_flow.delay.away),
            null_offset: (of_null + self.of_mean(evidence) + by_gain * by_gain).sqrt(),
        }
    }

    /// Variance of the mean opening of the spool relative to the commanded one (1), an average over some time.
    pub(super) fn of_mean(&self, evidence: &Evidence<T>) -> T {
        self.mean_correlation * evidence.spool_errors / evidence.time
    }

    /// Mean square (1) of the spool's residual that the valve model does not explain by twice its systematic error, at the
    /// motion's mean-square frequency (1/s²). A disturbance of the spool's sensor causes it.
    pub(super) fn of_sensor(&self, evidence: &Evidence<T>, square: T, valve: &GainAndDelay<T>) -> T {
        let [[openings, _], _] = evidence.valve.matrix;
        let of_model = T::splat(2.0) * self.of_spool(square, valve);
        let beyond = evidence.spool_errors - of_model * of_model * openings;
        if beyond > T::splat(0.0) { beyond / evidence.time } else { T::splat(0.0) }
    }

    /// Systematic error of the valve model (1) relative to the spool's motion.
    fn of_spool(&self, square: T, valve: &GainAndDelay<T>) -> T {
        self.of_phase * square * valve.delay.value * valve.delay.value
    }

    /// The systematic errors at the motion's mean-square frequency (1/s²). `not_late` (s²) is the square of
    /// [`late`](Self::late), times the square of the share of leakage and oil in the flow.
    pub(super) fn left_out(
        &self,
        not_late: T,
        square: T,
        flow: &GainAndDelay<T>,
        valve: &GainAndDelay<T>,
    ) -> LeftOut<T> {
        let of_spool = self.of_spool(square, valve);
        let (of_gain, of_response) = (of_spool * valve.gain.value, of_spool * valve.delay.value);
        let leak = not_late * self.leaks(square);
        LeftOut {
            flow_gain: square * leak * flow.gain.value * flow.gain.value,
            valve_gain: of_gain * of_gain,
            response_delay: of_response * of_response,
            velocity_delay: not_late - leak,
        }
    }

    /// Share (1) of the leakage in the square of the flow of leakage and oil, at a mean-square frequency (1/s²).
    pub(super) fn leaks(&self, square: T) -> T {
        self.leaks_below / (self.leaks_below + square)
    }

    /// Difference (s) between the velocity's delay and the delay of the flows that follow from the force.
    pub(super) fn late(&self, flow: &GainAndDelay<T>) -> T {
        flow.delay.value.abs() + self.half_sample
    }
}
