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
use crate::learning::least_squares::{GainAndDelay, Priors, Weight};
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
    pub(crate) leakage_corner: T,
    /// Share of `(ωT)²` by which the phase of the lead network for a delay `T` differs from `ωT`.
    pub(crate) phase_deficit: T,
}
integrity!(Deviation<T>: correlation, mean_correlation, per_square_flow, half_sample, leakage_corner, phase_deficit);

/// Squares of the systematic errors: of flow gain (1), valve gain (1), response delay (s) and velocity delay (s).
#[derive(Debug, Clone, Copy)]
pub(super) struct SystematicVariances<T> {
    pub(super) flow_gain: T,
    pub(super) valve_gain: T,
    pub(super) response_delay: T,
    pub(super) velocity_delay: T,
}

impl<T: Real> Deviation<T> {
    /// Adds one window: the commanded opening (1), the flow (m³/s) that compressed the oil, and the residuals of flow
    /// (m³/s) and spool (1).
    pub(crate) fn add(
        &self,
        evidence: &mut Evidence<T>,
        [commanded, compressed]: [T; 2],
        [flow, spool]: [T; 2],
        Weight { time, forgetting }: Weight<T>,
    ) {
        evidence.time = forgetting * evidence.time + time;
        evidence.newer_openings =
            forgetting * forgetting * evidence.newer_openings + time * commanded * commanded;
        evidence.compressed = forgetting * evidence.compressed + time * compressed * compressed;
        evidence.flow_errors = forgetting * evidence.flow_errors + time * flow * flow;
        evidence.spool_errors = forgetting * evidence.spool_errors + time * spool * spool;
    }

    /// The standard deviations at the motion's mean-square frequency (1/s²); infinite without evidence. They include
    /// the difference between the estimate in use and the one found, which a bound or a limited rate causes. `null_variance`
    /// is that of the null offset by the flow, and its error (1) per relative error of the spool's gain. `share` is
    /// the [share](super::flow_curve::FlowCurve::share) of the flow gain that follows from the departures (1).
    pub(crate) fn deviations(
        &self,
        evidence: &Evidence<T>,
        square: T,
        (flow, flow_estimate): (&Priors<T>, &GainAndDelay<T>),
        (valve, valve_estimate): (&Priors<T>, &GainAndDelay<T>),
        [null_variance, null_per_gain]: [T; 2],
        share: T,
    ) -> Deviations<T> {
        let (zero, squares) = (T::splat(0.0), &evidence.valve.matrix);
        let [[openings, _], _] = *squares;
        if !(evidence.time > zero && openings > zero) {
            return Deviations::unknown();
        }
        let lag = self.lag(flow_estimate);
        let lag_square = self.per_square_flow * evidence.compressed / openings * lag * lag;
        let systematic = self.systematic(lag_square, square, flow_estimate, valve_estimate);
        // A sum with forgetting scatters less than a sum over the same time, because its older errors have less weight.
        let per_time = self.correlation * evidence.newer_openings / (evidence.time * openings);
        let [flow_gain, velocity_delay] = flow.variances(&evidence.flow, squares);
        let [valve_gain, response_delay] = valve.variances(&evidence.valve, squares);
        let deviation = |errors: T, scatter: T, systematic: T, distance: T| {
            (per_time * errors * scatter + systematic + distance * distance).sqrt()
        };
        let (flow, spool) = (evidence.flow_errors, evidence.spool_errors);
        let valve_gain = deviation(spool, valve_gain, systematic.valve_gain, valve_estimate.gain.away);
        let flow_distance = flow_estimate.gain.away - share * flow_estimate.gain.value;
        let by_gain = null_per_gain * valve_gain / valve_estimate.gain.value;
        Deviations {
            flow_gain: deviation(flow, flow_gain, systematic.flow_gain, flow_distance),
            valve_gain,
            response_delay: deviation(
                spool,
                response_delay,
                systematic.response_delay,
                valve_estimate.delay.away,
            ),
            velocity_delay: deviation(
                flow,
                velocity_delay,
                systematic.velocity_delay,
                flow_estimate.delay.away,
            ),
            null_offset: (null_variance + self.mean_variance(evidence) + by_gain * by_gain).sqrt(),
        }
    }

    /// Variance of the mean opening of the spool relative to the commanded one (1), an average over some time.
    pub(super) fn mean_variance(&self, evidence: &Evidence<T>) -> T {
        self.mean_correlation * evidence.spool_errors / evidence.time
    }

    /// Mean square (1) of the spool's residual that the valve model does not explain by twice its systematic error, at the
    /// motion's mean-square frequency (1/s²). A disturbance of the spool's sensor causes it.
    pub(super) fn disturbance(&self, evidence: &Evidence<T>, square: T, valve: &GainAndDelay<T>) -> T {
        let [[openings, _], _] = evidence.valve.matrix;
        let model_error = T::splat(2.0) * self.spool_error(square, valve);
        let excess = evidence.spool_errors - model_error * model_error * openings;
        if excess > T::splat(0.0) { excess / evidence.time } else { T::splat(0.0) }
    }

    /// Systematic error of the valve model (1) relative to the spool's motion.
    fn spool_error(&self, square: T, valve: &GainAndDelay<T>) -> T {
        self.phase_deficit * square * valve.delay.value * valve.delay.value
    }

    /// The systematic errors at the motion's mean-square frequency (1/s²). `lag_square` (s²) is the square of
    /// [`lag`](Self::lag), times the square of the share of leakage and oil in the flow.
    pub(super) fn systematic(
        &self,
        lag_square: T,
        square: T,
        flow: &GainAndDelay<T>,
        valve: &GainAndDelay<T>,
    ) -> SystematicVariances<T> {
        let spool_error = self.spool_error(square, valve);
        let (gain_error, delay_error) = (spool_error * valve.gain.value, spool_error * valve.delay.value);
        let leak = lag_square * self.leakage_share(square);
        SystematicVariances {
            flow_gain: square * leak * flow.gain.value * flow.gain.value,
            valve_gain: gain_error * gain_error,
            response_delay: delay_error * delay_error,
            velocity_delay: lag_square - leak,
        }
    }

    /// Share (1) of the leakage in the square of the flow of leakage and oil, at a mean-square frequency (1/s²).
    pub(super) fn leakage_share(&self, square: T) -> T {
        self.leakage_corner / (self.leakage_corner + square)
    }

    /// Difference (s) between the velocity's delay and the delay of the flows that follow from the force.
    pub(super) fn lag(&self, flow: &GainAndDelay<T>) -> T {
        flow.delay.value.abs() + self.half_sample
    }
}
