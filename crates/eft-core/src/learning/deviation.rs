//! Standard deviations of the estimates: the scatter by noise, what the priors leave open, and the size of the models'
//! systematic errors.
//!
//! A prior counts for its weight over that of all evidence. As the truth may lie anywhere in the range of the estimate, this
//! share times the standard deviation of a rectangular distribution over the range is that of the error by the prior.
//!
//! The scatter follows from the least squares: their information, and the mean square of the residuals. Signals and noise have
//! the same filter, so the noise that counts is that at the motion's frequency `ω`, and not that of the whole band.
//!
//! Gain and delay of the valve are those of the lead network whose inverse follows the valve best in the motion that was
//! learned. At one frequency it does so exactly, whatever the order of the valve, so a valve of two or three stages is no error.
//! The systematic errors are the same in every test:
//!
//! - The estimator samples this network once a window `P`, at the frequency `2/P·tan(ωP/2)` in place of `ω`. Its delay `T` is thus
//!   smaller by `T·(ωP)²/12`.
//! - The flow model applies the velocity's delay `δ` to the whole flow. The flows of leakage and of the oil's compression follow
//!   from the force, so they are not late. The oil's flow is late by the half sample `h` between the mean of a force and its
//!   change. Its part in phase with the whole flow times `δ - h` is the error of the delay. The part of the leakage in
//!   quadrature times `ωδ` is that of the flow gain. The sums contain the size of both flows and not their phase, so their shares
//!   of the flow are bounds of these parts. A bound `a` is a standard deviation of `a/√3` (GUM, 4.3.7).
//! - The null offset `b` is found beside the mean `s` of the spool's reading minus its gain `g` times the commanded opening,
//!   `b = (b₀ - s)/g` with `s = (1 - g)·b₀`: an error of `g` has no effect, unless it changes. As `s` is an average over `τ`,
//!   a change of `g` by `Δ` during the memory `m` of the null offset changes it by `b·(Δ/g)·τ/m`. `Δ` contains the noise of `g`
//!   and its increase with the frequency, about `g·(1/3 + α/(1 − α)²)·(ωT)²`.

use crate::compensation::Deviations;
use crate::integrity::integrity;
use crate::learning::checkpoint::Evidence;
use crate::learning::least_squares::{BOUNDED, GainAndDelay, Priors, Weight};
use crate::learning::tuning::{CURVE_AVERAGE, CURVE_CORRELATION, LOW_PASS};
use crate::number::Real;
use core::f64::consts::TAU;

/// Inverse square of the corner (1/s) of the estimators' two low-passes. Their amplitude is 1 over 1 plus this times the square of
/// the frequency; the taps and the windows change it by less than 2 % below 9 Hz.
const PER_SQUARE_CORNER: f64 = 1.0 / (TAU * LOW_PASS * TAU * LOW_PASS);
/// Duration of an error of the flow curve over twice the time that averages the offset of the spool's sensor (1).
pub(super) const MEAN_CORRELATION: f64 = 0.5 * CURVE_CORRELATION / CURVE_AVERAGE;

/// Constants of the standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation<T> {
    /// Correlation time (s) of noise in the estimators' band, by its density at low frequencies. The windows within it count as
    /// one.
    pub(crate) correlation: T,
    /// Square of the opening (1) per square of a flow (m³/s).
    pub(crate) per_square_flow: T,
    /// Half a sample (s).
    pub(crate) half_sample: T,
    /// Square of the frequency (1/s²) below which the leakage exceeds the oil's flow; positive.
    pub(crate) leakage_corner: T,
}
integrity!(Deviation<T>: correlation, per_square_flow, half_sample, leakage_corner);

/// Squares of the systematic errors: of flow gain (1), response delay (s) and velocity delay (s).
#[derive(Debug, Clone, Copy)]
pub(super) struct SystematicVariances<T> {
    pub(super) flow_gain: T,
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

    /// The standard deviations at the motion's mean-square frequency (1/s²), without that of the null offset; infinite without
    /// evidence. They include the difference between the estimate in use and the one found, which a bound or a limited rate
    /// causes. `share` is the [share](super::flow_curve::FlowCurve::share) of the flow gain that follows from the departures (1).
    pub(crate) fn deviations(
        &self,
        evidence: &Evidence<T>,
        square: T,
        (flow, flow_estimate): (&Priors<T>, &GainAndDelay<T>),
        (valve, valve_estimate): (&Priors<T>, &GainAndDelay<T>),
        share: T,
    ) -> Deviations<T> {
        let (zero, squares) = (T::splat(0.0), &evidence.valve.matrix);
        let [[openings, _], _] = *squares;
        if !(evidence.time > zero && openings > zero) {
            return Deviations::unknown();
        }
        let share_square = self.per_square_flow * evidence.compressed / openings;
        let systematic = self.systematic(share_square, square, flow_estimate, valve_estimate, valve.period);
        // A sum with forgetting scatters less than a sum over the same time, because its older errors have less weight.
        let attenuation = attenuation(square);
        let per_time = self.correlation * evidence.newer_openings
            / (evidence.time * openings * (attenuation * attenuation));
        let [flow_gain, velocity_delay] =
            flow.variances(&evidence.flow, squares, per_time * evidence.flow_errors);
        let [valve_gain, response_delay] =
            valve.variances(&evidence.valve, squares, per_time * evidence.spool_errors);
        let deviation = |variance: T, distance: T| (variance + distance * distance).sqrt();
        let flow_distance = flow_estimate.gain.away - share * flow_estimate.gain.value;
        Deviations {
            flow_gain: deviation(flow_gain + systematic.flow_gain, flow_distance),
            valve_gain: deviation(valve_gain, valve_estimate.gain.away),
            response_delay: deviation(response_delay + systematic.response_delay, valve_estimate.delay.away),
            velocity_delay: deviation(velocity_delay + systematic.velocity_delay, flow_estimate.delay.away),
            null_offset: T::splat(f64::INFINITY),
        }
    }

    /// Standard deviation of the null offset (1): from its variance by the flow, and its error (1) per relative change of the valve's
    /// gain during a test, with the square of this [change](gain_change).
    pub(super) fn null_offset(evidence: &Evidence<T>, [variance, per_gain]: [T; 2], change: T) -> T {
        (variance + Self::mean_variance(evidence) + per_gain * per_gain * change).sqrt()
    }

    /// Variance of the mean opening of the spool relative to the commanded one (1), an average over some time.
    pub(super) fn mean_variance(evidence: &Evidence<T>) -> T {
        T::splat(MEAN_CORRELATION) * evidence.spool_errors / evidence.time
    }

    /// Mean square (1) of the spool's residual that exceeds twice this increase of the valve's gain with the frequency (1). A
    /// disturbance of the spool's sensor causes it.
    pub(super) fn disturbance(evidence: &Evidence<T>, gain_increase: T) -> T {
        let [[openings, _], _] = evidence.valve.matrix;
        let explained = T::splat(2.0) * gain_increase;
        let excess = evidence.spool_errors - explained * explained * openings;
        if excess > T::splat(0.0) { excess / evidence.time } else { T::splat(0.0) }
    }

    /// The systematic errors at the motion's mean-square frequency (1/s²). `share_square` (1) is the square of
    /// the share of leakage and oil in the flow, and `period` (s) is that of the estimators.
    pub(super) fn systematic(
        &self,
        share_square: T,
        square: T,
        flow: &GainAndDelay<T>,
        valve: &GainAndDelay<T>,
        period: T,
    ) -> SystematicVariances<T> {
        let all = T::splat(BOUNDED) * share_square;
        let leak = all * self.leakage_share(square);
        let (delay, oil_lag) = (flow.delay.value, flow.delay.value - self.half_sample);
        let gain_error = flow.gain.value * delay;
        let delay_error = T::splat(1.0 / 12.0) * (period * period) * square * valve.delay.value;
        SystematicVariances {
            flow_gain: square * leak * (gain_error * gain_error),
            response_delay: delay_error * delay_error,
            velocity_delay: (all - leak) * (oil_lag * oil_lag),
        }
    }

    /// Share (1) of the leakage in the square of the flow of leakage and oil, at a mean-square frequency (1/s²).
    pub(super) fn leakage_share(&self, square: T) -> T {
        self.leakage_corner / (self.leakage_corner + square)
    }
}

/// Square of the relative change (1) of the valve's gain during a test: by noise, with this standard deviation (1), and by its
/// increase with the frequency (1).
pub(super) fn gain_change<T: Real>(deviation: T, gain_increase: T, valve: &GainAndDelay<T>) -> T {
    let noise = deviation / valve.gain.value;
    noise * noise + gain_increase * gain_increase
}

/// Amplitude (1) of the estimators' filter at low frequencies over that at a mean-square frequency (1/s²).
pub(super) fn attenuation<T: Real>(square: T) -> T {
    T::splat(1.0) + T::splat(PER_SQUARE_CORNER) * square
}
