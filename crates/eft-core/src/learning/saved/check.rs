//! Which saved calibrations a learner can have saved. One list of ranges serves both: what is saved is limited to
//! them, and what is read is refused beyond them.

use super::{SavedCalibration, SavedCurve, SavedDistances, SavedEvidence};
use crate::compensation::{Deviations, FIRST_NODE, PIECES};
use crate::error::{ConfigError, SMALLEST, finite, within};
use crate::learning::flow_curve::{LARGEST_ASYMMETRY, LARGEST_NULL};
use crate::learning::learner::Learner;
use crate::learning::tuning::{
    CURVE_AVERAGE, CURVE_DEPARTURE, HALF_EVIDENCE, KEPT_EVIDENCE, LOW_PASS, MEMORY, SLOWEST,
};
use crate::number::{Real, Scalar};

/// Share of a range by which rounding may put a value beyond it.
const ROUNDING: f64 = 1.0e-6;
/// Share by which rounding may put a mean product beyond the product of the root mean squares.
const ROUNDING_OF_SUMS: f64 = 1.0e-3;
/// Longest remembered time (s). Weak motion is never forgotten.
const LONGEST: f64 = 1.0e6;
/// Longest time (s) of the curve's averages; in `f32` the number of windows errs by less than this.
const LONGEST_AVERAGE: f64 = 1.01 * CURVE_AVERAGE;
/// Shortest remembered time (s).
const SHORTEST: f64 = 1.0e-6;
/// Largest opening (1) of a stroke after the high-pass, which may add the mean of the opposite sign.
const LARGEST_OPENING: f64 = 2.0;
/// Largest evidence (s): with the largest opening the forgetting then equals the growth.
const LARGEST_EXCITATION: f64 = LARGEST_OPENING * LARGEST_OPENING * MEMORY + HALF_EVIDENCE + KEPT_EVIDENCE;
/// Largest flow after the high-pass over the table's greatest one (1), at four times the supply pressure.
const LARGEST_FLOW: f64 = 4.0;
/// Largest rate over value (1/s) of a signal after the low-passes.
const FASTEST_SIGNAL: f64 = core::f64::consts::TAU * LOW_PASS;
/// Largest mean-square frequency (1/s²) that counts: 160 Hz. Noise near the zero crossings may exceed it.
const FASTEST_MOTION: f64 = 1.0e6;
/// Largest distance of a result from its estimate, over the sum of the estimate's bounds (1).
const LARGEST_DISTANCE: f64 = 10.0;
/// Standard deviations (1) of an asymmetry. The sums of a smaller one would overflow in `f32`.
const LEAST_DEVIATION: f64 = 1.0e-9;
const LARGEST_DEVIATION: f64 = 1.0e6;

/// A range, and how far rounding may put a value beyond its ends.
#[derive(Clone, Copy)]
struct Range {
    lowest: f64,
    highest: f64,
    below: f64,
    above: f64,
}

impl Range {
    /// Between values that another precision rounds otherwise.
    fn about(lowest: f64, highest: f64) -> Self {
        let slack = ROUNDING * (lowest.abs() + highest.abs());
        Self { lowest, highest, below: slack, above: slack }
    }

    /// From a fixed value to one that another precision rounds otherwise.
    fn up(lowest: f64, highest: f64) -> Self {
        Self { below: 0.0, ..Self::about(lowest, highest) }
    }

    /// Between fixed values.
    fn fixed(lowest: f64, highest: f64) -> Self {
        Self { lowest, highest, below: 0.0, above: 0.0 }
    }

    fn around_zero(most: f64) -> Self {
        Self::about(-most, most)
    }

    fn check(self, parameter: &'static str, value: f64) -> Result<(), ConfigError> {
        within(parameter, value, self.lowest - self.below, self.highest + self.above).map(|_| ())
    }
}

/// What is done with a number of a calibration: by its name, in its range.
type Visit<'a> = &'a mut dyn FnMut(&'static str, &mut f64, Range) -> Result<(), ConfigError>;

impl<T: Real, const N: usize> Learner<T, N> {
    /// Refuses data that this learner cannot have saved.
    pub(super) fn check(&self, saved: &SavedCalibration) -> Result<(), ConfigError> {
        let version = f64::from(SavedCalibration::VERSION);
        within("calibration.version", f64::from(saved.version), version, version)?;
        self.visit(&mut { *saved }, &mut |name, value, range| range.check(name, *value))
    }

    /// A calibration within the ranges. Noise may put a mean beyond them, for example one of few windows near the zero
    /// crossings of the opening.
    pub(super) fn limited(&self, mut saved: SavedCalibration) -> SavedCalibration {
        // A limit refuses nothing.
        let _ = self.visit(&mut saved, &mut |_, value, range| {
            *value = value.limit(range.lowest, range.highest);
            Ok(())
        });
        saved
    }

    /// Visits every number but the version. Without evidence nothing after it counts.
    fn visit(&self, saved: &mut SavedCalibration, each: Visit<'_>) -> Result<(), ConfigError> {
        let greatest = self.greatest_flow();
        each("calibration.greatest_flow", &mut saved.greatest_flow, Range::about(greatest, greatest))?;
        each("calibration.excitation", &mut saved.excitation, Range::fixed(0.0, LARGEST_EXCITATION))?;
        if saved.excitation <= 0.0 {
            return Ok(());
        }
        let (flow, valve) = (&self.flow.priors, &self.valve.priors);
        let of = |bounds: [T; 2]| bounds.map(T::to_f64);
        let estimate = |[lowest, highest]: [f64; 2]| Range::about(lowest, highest);
        let (flow_gains, flow_delays) = (of(flow.gain.bounds), of(flow.delay.bounds));
        let (valve_gains, valve_delays) = (of(valve.gain.bounds), of(valve.delay.bounds));
        each("calibration.flow_gain", &mut saved.flow_gain, estimate(flow_gains))?;
        each("calibration.valve_gain", &mut saved.valve_gain, estimate(valve_gains))?;
        each("calibration.response_delay", &mut saved.response_delay, estimate(valve_delays))?;
        each("calibration.velocity_delay", &mut saved.velocity_delay, estimate(flow_delays))?;
        let known = self.known_null();
        let nulls = Range::about(known - LARGEST_NULL, known + LARGEST_NULL);
        each("calibration.null_offset", &mut saved.null_offset, nulls)?;
        let ([_, flow_gain], [_, valve_gain]) = (flow_gains, valve_gains);
        let predicted = LARGEST_FLOW * greatest;
        let reach = Reach {
            predicted,
            measured: predicted * if flow_gain > 1.0 { flow_gain } else { 1.0 },
            spool: LARGEST_OPENING * (1.0 + valve_gain),
        };
        visit_evidence(&mut saved.evidence, saved.excitation, &reach, each)?;
        let away = [flow_gains, valve_gains, valve_delays, flow_delays, [-LARGEST_NULL, LARGEST_NULL]];
        visit_distances(&mut saved.evidence.distances, away, each)?;
        visit_curve(&mut saved.curve, greatest, &reach, each)
    }
}

/// The largest signals of the accepted windows, in the estimators' band.
struct Reach {
    /// Flow (m³/s) that the table predicts, and flow in the actuator. The gate accepts no window in which they
    /// differ by much more than the flow gain.
    predicted: f64,
    measured: f64,
    /// Difference (1) between the spool's reading and the commanded opening times the spool's gain.
    spool: f64,
}

/// `all` is the evidence (s). No sum of products exceeds the root of the two sums of squares (Cauchy and Schwarz),
/// of which one is at most the largest signal squared times the remembered time.
fn visit_evidence(
    e: &mut SavedEvidence,
    all: f64,
    reach: &Reach,
    each: Visit<'_>,
) -> Result<(), ConfigError> {
    each("calibration.evidence.time", &mut e.time, Range::fixed(SHORTEST, LONGEST))?;
    each("calibration.evidence.mean_weight", &mut e.mean_weight, Range::about(0.0, 1.0))?;
    let squares = Range::up(0.0, FASTEST_MOTION);
    each("calibration.evidence.mean_square_frequency", &mut e.mean_square_frequency, squares)?;
    let frequency = (1.0 + ROUNDING_OF_SUMS) * Scalar::sqrt(e.mean_square_frequency + SLOWEST);
    each("calibration.evidence.growth", &mut e.growth, Range::around_zero(frequency))?;
    // Largest signal (1) over the root mean square of the opening.
    let most = (1.0 + ROUNDING_OF_SUMS) * Scalar::sqrt(e.time / all);
    let (predicted, measured) = (most * reach.predicted, most * reach.measured);
    let rate = FASTEST_SIGNAL * measured;
    each("calibration.evidence.flow", &mut e.flow, Range::up(0.0, predicted))?;
    each("calibration.evidence.flow_rate", &mut e.flow_rate, Range::around_zero(rate))?;
    each("calibration.evidence.rate_flow", &mut e.rate_flow, Range::around_zero(frequency * predicted))?;
    each("calibration.evidence.rate_flow_rate", &mut e.rate_flow_rate, Range::up(0.0, frequency * rate))?;
    each("calibration.evidence.compressed_flow", &mut e.compressed_flow, Range::up(0.0, measured))?;
    let error = reach.predicted + reach.measured;
    each("calibration.evidence.flow_error", &mut e.flow_error, Range::up(0.0, error))?;
    each("calibration.evidence.spool_error", &mut e.spool_error, Range::up(0.0, reach.spool))
}

/// The bounds of the estimates are in the order of the distances.
fn visit_distances(
    away: &mut SavedDistances,
    bounds: [[f64; 2]; 5],
    each: Visit<'_>,
) -> Result<(), ConfigError> {
    let [flow_gain, valve_gain, response_delay, velocity_delay, null_offset] =
        bounds.map(|[lowest, highest]| Range::around_zero(LARGEST_DISTANCE * (lowest.abs() + highest.abs())));
    each("calibration.evidence.distances.flow_gain", &mut away.flow_gain, flow_gain)?;
    each("calibration.evidence.distances.valve_gain", &mut away.valve_gain, valve_gain)?;
    each("calibration.evidence.distances.response_delay", &mut away.response_delay, response_delay)?;
    each("calibration.evidence.distances.velocity_delay", &mut away.velocity_delay, velocity_delay)?;
    each("calibration.evidence.distances.null_offset", &mut away.null_offset, null_offset)
}

/// `greatest` is the greatest flow (m³/s) of the table.
fn visit_curve(
    curve: &mut SavedCurve,
    greatest: f64,
    reach: &Reach,
    each: Visit<'_>,
) -> Result<(), ConfigError> {
    each("calibration.curve.asymmetry", &mut curve.asymmetry, Range::around_zero(LARGEST_ASYMMETRY))?;
    let deviations = Range::fixed(LEAST_DEVIATION, LARGEST_DEVIATION);
    each("calibration.curve.asymmetry_deviation", &mut curve.asymmetry_deviation, deviations)?;
    let error = reach.predicted + reach.measured;
    each("calibration.curve.error", &mut curve.error, Range::up(SMALLEST, error))?;
    let share = Range::around_zero(CURVE_DEPARTURE);
    each("calibration.curve.flow_gain_share", &mut curve.flow_gain_share, share)?;
    let nodes = curve.departures.iter_mut().zip(&mut curve.departure_deviations);
    for (n, (departure, deviation)) in nodes.enumerate() {
        let most = CURVE_DEPARTURE * (n as f64 + FIRST_NODE).abs() * greatest / (PIECES / 2 - 1) as f64;
        each("calibration.curve.departures", departure, Range::around_zero(most))?;
        each("calibration.curve.departure_deviations", deviation, Range::about(0.0, most))?;
    }
    // As a mean over little flow it may exceed every departure.
    each("calibration.curve.mean_departure", &mut curve.mean_departure, share)?;
    each("calibration.curve.time", &mut curve.time, Range::fixed(0.0, LONGEST_AVERAGE))?;
    each("calibration.curve.sensor_offset", &mut curve.sensor_offset, Range::around_zero(reach.spool))?;
    each("calibration.curve.null_time", &mut curve.null_time, Range::fixed(0.0, LONGEST))?;
    each("calibration.curve.null_coupling", &mut curve.null_coupling, Range::fixed(0.0, 1.0))
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
