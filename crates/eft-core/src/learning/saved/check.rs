//! Which saved calibrations a learner can have saved.

use super::{SavedCalibration, SavedCurve, SavedEvidence};
use crate::compensation::{Deviations, FIRST_NODE, PIECES};
use crate::error::{ConfigError, SMALLEST, finite, within};
use crate::learning::flow_curve::{LARGEST_ASYMMETRY, LARGEST_NULL};
use crate::learning::learner::Learner;
use crate::learning::tuning::{CURVE_AVERAGE, CURVE_DEPARTURE, FASTEST, SLOWEST};
use crate::number::{Real, Scalar};

/// Share of a range by which rounding may put a value beyond it.
const ROUNDING: f64 = 1.0e-6;
/// Share by which rounding may put a mean product beyond the product of the root mean squares.
const ROUNDING_OF_SUMS: f64 = 1.0e-3;
/// Longest remembered time, and largest evidence (s).
const LONGEST: f64 = 1.0e6;
/// Longest time (s) of the curve's averages; in `f32` the number of windows errs by less than this.
const LONGEST_AVERAGE: f64 = 1.01 * CURVE_AVERAGE;
/// Shortest remembered time (s).
const SHORTEST: f64 = 1.0e-6;
/// Largest flow (m³/s), mean product of a flow (m³/s to m³/s³), opening (1), and distance of a result (1 or s).
const LARGEST_FLOW: f64 = 1.0e3;
const LARGEST_PRODUCT: f64 = 1.0e9;
const LARGEST_OPENING: f64 = 1.0e3;
const LARGEST_DISTANCE: f64 = 1.0e6;
/// Standard deviations (1) of an asymmetry. The sums of a smaller one would overflow in `f32`.
const LEAST_DEVIATION: f64 = 1.0e-9;
const LARGEST_DEVIATION: f64 = 1.0e6;

impl<T: Real, const N: usize> Learner<T, N> {
    /// Refuses data that this learner cannot have saved.
    pub(super) fn check(&self, saved: &SavedCalibration) -> Result<(), ConfigError> {
        let version = f64::from(SavedCalibration::VERSION);
        within("calibration.version", f64::from(saved.version), version, version)?;
        let greatest = self.greatest_flow();
        near("calibration.greatest_flow", saved.greatest_flow, [greatest, greatest])?;
        within("calibration.excitation", saved.excitation, 0.0, LONGEST)?;
        if saved.excitation <= 0.0 {
            return Ok(());
        }
        let (flow, valve) = (&self.flow.priors, &self.valve.priors);
        near("calibration.flow_gain", saved.flow_gain, flow.gain.bounds.map(T::to_f64))?;
        near("calibration.valve_gain", saved.valve_gain, valve.gain.bounds.map(T::to_f64))?;
        near("calibration.response_delay", saved.response_delay, valve.delay.bounds.map(T::to_f64))?;
        near("calibration.velocity_delay", saved.velocity_delay, flow.delay.bounds.map(T::to_f64))?;
        let known = self.known_null();
        near("calibration.null_offset", saved.null_offset, [known - LARGEST_NULL, known + LARGEST_NULL])?;
        check_evidence(&saved.evidence)?;
        check_curve(&saved.curve, greatest)
    }
}

fn check_evidence(e: &SavedEvidence) -> Result<(), ConfigError> {
    within("calibration.evidence.time", e.time, SHORTEST, LONGEST)?;
    near("calibration.evidence.mean_weight", e.mean_weight, [0.0, 1.0])?;
    let square = within("calibration.evidence.mean_square_frequency", e.mean_square_frequency, 0.0, FASTEST)?;
    let fastest = (1.0 + ROUNDING_OF_SUMS) * Scalar::sqrt(square + SLOWEST);
    within("calibration.evidence.growth", e.growth, -fastest, fastest)?;
    let most = LARGEST_PRODUCT;
    within("calibration.evidence.flow", e.flow, 0.0, LARGEST_FLOW)?;
    within("calibration.evidence.flow_rate", e.flow_rate, -most, most)?;
    within("calibration.evidence.rate_flow", e.rate_flow, -most, most)?;
    within("calibration.evidence.rate_flow_rate", e.rate_flow_rate, 0.0, most)?;
    within("calibration.evidence.compressed_flow", e.compressed_flow, 0.0, LARGEST_FLOW)?;
    within("calibration.evidence.flow_error", e.flow_error, 0.0, LARGEST_FLOW)?;
    within("calibration.evidence.spool_error", e.spool_error, 0.0, LARGEST_OPENING)?;
    let (away, most) = (&e.distances, LARGEST_DISTANCE);
    within("calibration.evidence.distances.flow_gain", away.flow_gain, -most, most)?;
    within("calibration.evidence.distances.valve_gain", away.valve_gain, -most, most)?;
    within("calibration.evidence.distances.response_delay", away.response_delay, -most, most)?;
    within("calibration.evidence.distances.velocity_delay", away.velocity_delay, -most, most)?;
    within("calibration.evidence.distances.null_offset", away.null_offset, -most, most)?;
    Ok(())
}

/// `greatest` is the greatest flow (m³/s) of the table.
fn check_curve(curve: &SavedCurve, greatest: f64) -> Result<(), ConfigError> {
    near("calibration.curve.asymmetry", curve.asymmetry, [-LARGEST_ASYMMETRY, LARGEST_ASYMMETRY])?;
    within(
        "calibration.curve.asymmetry_deviation",
        curve.asymmetry_deviation,
        LEAST_DEVIATION,
        LARGEST_DEVIATION,
    )?;
    within("calibration.curve.error", curve.error, SMALLEST, LARGEST_FLOW)?;
    near("calibration.curve.flow_gain_share", curve.flow_gain_share, [-CURVE_DEPARTURE, CURVE_DEPARTURE])?;
    for (n, (departure, deviation)) in curve.departures.iter().zip(&curve.departure_deviations).enumerate() {
        let reach = CURVE_DEPARTURE * (n as f64 + FIRST_NODE).abs() * greatest / (PIECES / 2 - 1) as f64;
        near("calibration.curve.departures", *departure, [-reach, reach])?;
        near("calibration.curve.departure_deviations", *deviation, [0.0, reach])?;
    }
    within("calibration.curve.mean_departure", curve.mean_departure, -1.0, 1.0)?;
    within("calibration.curve.time", curve.time, 0.0, LONGEST_AVERAGE)?;
    within("calibration.curve.sensor_offset", curve.sensor_offset, -LARGEST_OPENING, LARGEST_OPENING)?;
    within("calibration.curve.null_time", curve.null_time, 0.0, LONGEST)?;
    within("calibration.curve.null_coupling", curve.null_coupling, 0.0, 1.0)?;
    Ok(())
}

/// Refuses means of the evidence that contradict each other so far that a standard deviation is no number.
pub(super) fn check_deviations<T: Real>(d: &Deviations<T>) -> Result<(), ConfigError> {
    for deviation in [d.flow_gain, d.valve_gain, d.response_delay, d.velocity_delay] {
        finite("calibration.evidence", deviation.to_f64())?;
    }
    // Infinite without a correction of the curve.
    let known = d.null_offset >= T::splat(0.0);
    finite("calibration.evidence", if known { 0.0 } else { f64::NAN })?;
    Ok(())
}

/// Refuses a value that lies beyond a range by more than rounding.
fn near(parameter: &'static str, value: f64, [lowest, highest]: [f64; 2]) -> Result<f64, ConfigError> {
    let slack = ROUNDING * (lowest.abs() + highest.abs());
    within(parameter, value, lowest - slack, highest + slack)
}
