//! A saved calibration: the estimates and their evidence as plain data, and a learner that starts from them.
//!
//! The data have SI units, and are independent of sample rate and precision. They contain the sums of the least
//! squares, as means over the remembered motion. The standard deviations also depend on the configuration, so they are
//! not saved: a learner that starts from the data computes them.

mod check;
mod start;

use crate::compensation::{NODES, PIECES};
use crate::learning::flow_curve::FlowCurve;
use crate::learning::learner::{Learner, LearnerState};
use crate::number::Real;

/// A calibration to keep over a restart, made by [`Learner::saved`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedCalibration {
    /// [`SavedCalibration::VERSION`] of the library that saved it (1).
    pub version: u32,
    /// Greatest flow (m³/s) of the flow table, to which flow gain and curve refer.
    pub greatest_flow: f64,
    /// True flow over the table's, `θ` (1).
    pub flow_gain: f64,
    /// The spool's gain over the configured one (1).
    pub valve_gain: f64,
    /// Delay (s) of the measured spool after its command.
    pub response_delay: f64,
    /// Delay (s) of the measured velocity after the measured spool.
    pub velocity_delay: f64,
    /// Commanded opening (1) at which the valve passes nothing at no load.
    pub null_offset: f64,
    /// Amount of the evidence (s): the integral of the squared opening over the remembered time. If it is 0, nothing
    /// was learned.
    pub excitation: f64,
    /// What else the estimates were learned from.
    pub evidence: SavedEvidence,
    /// The correction of the flow table.
    pub curve: SavedCurve,
}

/// What the estimates were learned from. Opening `x` (1) and flow `q` (m³/s) are those of the models, in the
/// estimators' band. A mean is an integral over the remembered time, divided by that of `x²`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedEvidence {
    /// Remembered time (s) of motion.
    pub time: f64,
    /// Mean weight (1) that the remembered motion has in the integrals: 1 if nothing was forgotten.
    pub mean_weight: f64,
    /// Mean-square frequency (1/s²) of the motion: the mean of `ẋ²`.
    pub mean_square_frequency: f64,
    /// Mean of `x·ẋ` (1/s), the rate at which the motion grew; about 0 if its size is constant.
    pub growth: f64,
    /// Mean of `x·q` (m³/s).
    pub flow: f64,
    /// Mean of `x·q̇` (m³/s²).
    pub flow_rate: f64,
    /// Mean of `ẋ·q` (m³/s²).
    pub rate_flow: f64,
    /// Mean of `ẋ·q̇` (m³/s³).
    pub rate_flow_rate: f64,
    /// Root mean square (m³/s) of the flow that leaks and compresses the oil, over that of the opening.
    pub compressed_flow: f64,
    /// Root mean square (m³/s) of the residual of the flow.
    pub flow_error: f64,
    /// Root mean square (1) of the residual of the spool's opening.
    pub spool_error: f64,
    /// Results of the least squares minus the estimates, which follow them at limited rates and within bounds.
    pub distances: SavedDistances,
}

/// Results of the least squares minus the estimates in use.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedDistances {
    /// Of the flow gain (1).
    pub flow_gain: f64,
    /// Of the valve gain (1).
    pub valve_gain: f64,
    /// Of the response delay (s).
    pub response_delay: f64,
    /// Of the velocity delay (s).
    pub velocity_delay: f64,
    /// Of the null offset (1).
    pub null_offset: f64,
}

/// The correction of the flow table by direction and band of flow.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct SavedCurve {
    /// Table flow per flow of the forward direction over the mean of both directions, minus 1 (1). It is negative if
    /// the valve passes more forwards than the table.
    pub asymmetry: f64,
    /// Its standard deviation (1).
    pub asymmetry_deviation: f64,
    /// Table flow (m³/s) minus that by the direction's gain, at 17 no-load flows from -8/7 to 8/7 of the greatest one.
    /// The first, the middle and the last are 0.
    pub departures: [f64; NODES],
    /// Their standard deviations (m³/s).
    pub departure_deviations: [f64; NODES],
    /// Root mean square (m³/s) of the residual of a window's flow after the correction.
    pub error: f64,
    /// Share of the flow gain (1) that follows from the departures. The table without the correction would have the
    /// flow gain over 1 plus this share. The standard deviation of the flow gain contains it.
    pub flow_gain_share: f64,
    /// Mean departure as a share of the flow (1), which the flow gain slowly takes over.
    pub mean_departure: f64,
    /// Remembered time (s) of residual and sensor offset.
    pub time: f64,
    /// Reading (1) of the spool's sensor minus the commanded opening times the spool's gain.
    pub sensor_offset: f64,
    /// Remembered time (s) of the null offset, in which the table's slope squared counts as that at null.
    pub null_time: f64,
    /// Share (1) of this time in which an error of a direction's gain looks like a null offset.
    pub null_coupling: f64,
}

impl SavedCalibration {
    /// Version of these data (1); any other is refused.
    pub const VERSION: u32 = 4;
}

impl<T: Real, const N: usize> Learner<T, N> {
    /// The calibration, for [`start_from`](Self::start_from) later.
    ///
    /// # Cost
    /// Call it after a test, not in a tick.
    pub fn saved(&self, state: &LearnerState<T>) -> SavedCalibration {
        let of = T::to_f64;
        let (flow, valve) = (&state.flow, &state.valve.found);
        self.limited(SavedCalibration {
            version: SavedCalibration::VERSION,
            greatest_flow: self.greatest_flow(),
            flow_gain: of(flow.gain.value),
            valve_gain: of(valve.gain.value),
            response_delay: of(valve.delay.value),
            velocity_delay: of(flow.delay.value),
            null_offset: of(state.evidence.curve.null) + self.known_null(),
            excitation: of(state.evidence.amount),
            evidence: self.saved_evidence(state),
            curve: self.saved_curve(state),
        })
    }

    fn saved_evidence(&self, state: &LearnerState<T>) -> SavedEvidence {
        let of = T::to_f64;
        let (evidence, flow, valve) = (&state.evidence, &state.flow, &state.valve.found);
        let per_period = of(self.valve.priors.per_period);
        let [[openings, opening_changes], [_, changes]] = evidence.valve.matrix.map(|row| row.map(of));
        let [[flow_sum, flow_change], [change_flow, change_flow_change]] =
            evidence.flow.matrix.map(|row| row.map(of));
        let mean = |sum: f64| if openings > 0.0 { sum / openings } else { 0.0 };
        let zero = T::splat(0.0);
        let root = |squares: T, all: T| of(if all > zero { (squares / all).sqrt() } else { zero });
        let [[squared_opening, _], _] = evidence.valve.matrix;
        SavedEvidence {
            time: of(evidence.time),
            mean_weight: mean(of(evidence.newer_openings)),
            // The sums contain the decrease of the opening, and the delay's regressor that of the flow.
            mean_square_frequency: mean(changes) * per_period * per_period,
            growth: -mean(opening_changes) * per_period,
            flow: mean(flow_sum),
            flow_rate: -mean(flow_change) * per_period,
            rate_flow: -mean(change_flow) * per_period,
            rate_flow_rate: mean(change_flow_change) * per_period * per_period,
            compressed_flow: root(evidence.compressed, squared_opening),
            flow_error: root(evidence.flow_errors, evidence.time),
            spool_error: root(evidence.spool_errors, evidence.time),
            distances: SavedDistances {
                flow_gain: of(flow.gain.away),
                valve_gain: of(valve.gain.away),
                response_delay: of(valve.delay.away),
                velocity_delay: of(flow.delay.away),
                null_offset: of(state.curve.offset - evidence.curve.null),
            },
        }
    }

    fn saved_curve(&self, state: &LearnerState<T>) -> SavedCurve {
        let of = T::to_f64;
        let (curve, step) = (&state.evidence.curve, of(self.curve.grid.step));
        let memory = self.curve.memory(&state.curve, curve, self.flow_gain);
        SavedCurve {
            asymmetry: of(curve.asymmetry),
            asymmetry_deviation: of(self.curve.asymmetry_deviation(curve)),
            departures: curve.departures.map(|departure| of(departure) * step),
            departure_deviations: self
                .curve
                .departure_variances(&state.curve.nodes.variances, &curve.departures)
                .map(|variance| of(variance.sqrt()) * step),
            error: of(self.curve.mean_square(curve).sqrt()) * step,
            flow_gain_share: of(FlowCurve::share(curve)),
            mean_departure: of(curve.common),
            time: of(memory.time),
            sensor_offset: of(curve.sensor),
            null_time: of(memory.null_time),
            null_coupling: of(memory.null_coupling),
        }
    }

    /// The known null bias (1).
    fn known_null(&self) -> f64 {
        self.curve.known_null.to_f64()
    }

    fn greatest_flow(&self) -> f64 {
        self.curve.grid.step.to_f64() * (PIECES / 2 - 1) as f64
    }
}
