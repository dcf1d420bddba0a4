//! The estimate of the flow table's correction by direction and band of flow.
//!
//! The flow gain `θ` is one number for the whole table. The correction is the remaining error of the table's shape. It maps
//! the no-load flow over `θ` to the table's flow at the same opening.
//!
//! - The *asymmetry* separates the gains of the two directions. It is found by least squares together with the null
//!   offset, which is an offset of the opening and not an error of the table's shape.
//! - Each [node](super::curve_nodes) has a *departure* from the gain of its direction.
//!
//! Both start with the prior that the table is correct. The variance of their unexplained part determines how fast they
//! change, so they change little with noisy sensors. The noise does not bias them, because instruments and nodes follow the
//! commanded opening, not the measured one.
//!
//! The inverse of the curve is estimated. Its nodes are at demanded flows, so a tick finds its piece by one multiplication.

mod known;
mod start;
#[cfg(test)]
mod tests;

pub(super) use start::{Known, Memory};

use crate::compensation::{CurveGrid, NODES, node_below};
use crate::integrity::integrity;
use crate::learning::curve_nodes::{CurveNodes, interpolate, prior_variance};
use crate::learning::tuning::CURVE_DEPARTURE;
use crate::number::Real;

/// Prior standard deviation of a direction's gain (1).
const GAIN_DEVIATION: f64 = 0.03;
/// Prior standard deviation of the null offset (1).
pub(super) const NULL_DEVIATION: f64 = 0.01;
/// Least share of a window's squared error that counts as noise and not as an error of the table.
const NOISE: f64 = 0.02;
/// Variance (squared steps) of the errors before any is known, and the windows that it counts for.
const FIRST_ERRORS: [f64; 2] = [4.0e-4, 10.0];
/// Bound of the asymmetry.
pub(super) const LARGEST_ASYMMETRY: f64 = 0.3;
/// Bound of the null offset (1).
pub(super) const LARGEST_NULL: f64 = 0.05;
/// Parts of the departures that are removed before the estimates of asymmetry and flow gain. Asymmetry and flow gain slowly
/// take over what they can explain.
const SHARED: [f64; 2] = [0.5, 0.3];
/// Weight (squared steps) of the prior that the departures have no common part.
const COMMON_WEIGHT: f64 = 1.0e-2;
/// Constants of the correction; flows in steps from node to node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowCurve<T> {
    pub(crate) grid: CurveGrid<T>,
    /// The known null bias (1), from which the learner measures every opening.
    pub(crate) known_null: T,
    /// Forgetting of the directions' sums, over the forgetting of the flow gain's sums.
    pub(crate) forgotten: T,
    /// Share of the mean squared error that a further window displaces.
    pub(crate) average: T,
    /// Number of windows for which an error lasts; together they count as one.
    pub(crate) correlation: T,
    /// Number of windows for which a disturbance of the spool's sensor may be in phase with the motion.
    pub(crate) disturbance: T,
    /// Largest changes of asymmetry (1) and null offset (1) in an update.
    pub(crate) change: T,
    pub(crate) null_change: T,
    /// Growth of a departure's variance in a window that moves it, over the square of the node's flow.
    pub(crate) drift: T,
}
integrity!(FlowCurve<T>: grid, known_null, forgotten, average, correlation, disturbance, change, null_change, drift);

/// Sums over the windows of one direction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
struct Direction<T> {
    /// Sums of the table's slope squared, slope times instrument, and slope times error.
    slopes: T,
    slope_instruments: T,
    slope_errors: T,
    /// Sums of the instrument times flow, and of the instrument times error.
    flows: T,
    flow_errors: T,
}
integrity!(Direction<T>: slopes, slope_instruments, slope_errors, flows, flow_errors);

/// The part of the curve's state in a checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CurveEvidence<T> {
    /// Backwards, forwards.
    directions: [Direction<T>; 2],
    /// Difference of the forward gain from the mean of both, over that mean; the backward gain has the opposite one.
    pub(super) asymmetry: T,
    /// The null offset in use (unit opening).
    pub(super) null: T,
    /// Offset of the spool's sensor (unit opening), and the windows that show it.
    pub(super) sensor: T,
    readings: T,
    /// The nodes' departures (steps) from their direction.
    pub(super) departures: [T; NODES],
    /// Number of windows, and the sum of their squared residuals (squared steps).
    windows: T,
    squares: T,
    /// Sum of instrument times departures, and the mean departure as a share of the flow (1).
    instrument_departures: T,
    pub(super) common: T,
    /// Sums over the memory of the flow gain, of the instrument times what straightening adds by the departures, and of the
    /// squared instrument.
    recent_departures: T,
    recent_flows: T,
}
integrity!(CurveEvidence<T>: directions, asymmetry, null, sensor, readings, departures, windows, squares, instrument_departures, common, recent_departures, recent_flows);

/// Further state of the correction; flows in steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CurveState<T> {
    pub(crate) nodes: CurveNodes<T>,
    /// The null offset that was found (unit opening), and its variance.
    pub(super) offset: T,
    variance: T,
    /// Distance of the last results of asymmetry and null offset beyond their bounds (1).
    pub(crate) beyond: T,
    /// Mean square (1) of a disturbance of the spool's sensor.
    pub(crate) disturbance: T,
}
integrity!(CurveState<T>: nodes, offset, variance, beyond, disturbance);

/// A window's data for the correction; flows are divided by the flow gain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurveSample<T> {
    /// No-load flow from the actuator's measurements.
    demand: T,
    /// The same from the commanded opening, without the noise of spool and velocity.
    instrument: T,
    /// The departures' part of the demand.
    departures: T,
    /// The table's flow at the measured opening, and its slope there (1/unit opening).
    passed: T,
    slope: T,
    /// Excess of the table's flow over the corrected one.
    error: T,
    /// Reading of the spool's sensor minus the commanded opening (unit opening).
    reading: T,
}

impl<T: Real> Default for CurveState<T> {
    fn default() -> Self {
        let zero = T::splat(0.0);
        Self {
            nodes: CurveNodes::default(),
            offset: zero,
            variance: T::splat(NULL_DEVIATION * NULL_DEVIATION),
            beyond: zero,
            disturbance: zero,
        }
    }
}

impl<T: Real> FlowCurve<T> {
    /// A window's data from three values: the actuator's no-load flow over the flow gain (m³/s), the table's no-load flow
    /// (m³/s) with its slope (m³/s per unit opening), and the commanded opening minus the measured one (1). `reading`
    /// is the spool's reading minus the commanded opening (1).
    pub(crate) fn sample(
        &self,
        evidence: &CurveEvidence<T>,
        flow: T,
        [passed, slope]: [T; 2],
        [commanded, reading]: [T; 2],
    ) -> CurveSample<T> {
        let per_flow = self.grid.per_flow;
        let (demand, passed, slope) = (flow * per_flow, passed * per_flow, slope * per_flow);
        let departures = interpolate(&evidence.departures, demand);
        let added = evidence.asymmetry * demand.abs() + departures;
        CurveSample {
            demand,
            instrument: passed + slope * commanded - added,
            departures,
            passed,
            slope,
            error: passed - demand - added,
            reading,
        }
    }

    /// A window's no-load flow over the flow gain (m³/s), converted to that of the table at the same openings, for the
    /// estimator of the flow gain.
    pub(crate) fn straightened(&self, evidence: &CurveEvidence<T>, flow: T) -> T {
        let departures = self.grid.step * interpolate(&evidence.departures, flow * self.grid.per_flow);
        let [_, shared] = SHARED;
        flow + evidence.asymmetry * flow.abs() + departures - T::splat(shared) * evidence.common * flow
    }

    /// Share of the flow gain (1) that follows from the departures in the [straightened](Self::straightened) flows of its
    /// memory. The table itself would have the flow gain over 1 plus this share.
    pub(super) fn share(evidence: &CurveEvidence<T>) -> T {
        let (flows, most) = (evidence.recent_flows, T::splat(CURVE_DEPARTURE));
        if flows > T::splat(0.0) { (evidence.recent_departures / flows).limit(-most, most) } else { flows }
    }

    /// Learns from an accepted window, at a flow gain (1). `forgetting` is the share of the older sums that remains in the
    /// estimator of the flow gain.
    pub(crate) fn learn(
        &self,
        state: &mut CurveState<T>,
        evidence: &mut CurveEvidence<T>,
        s: &CurveSample<T>,
        flow_gain: T,
        forgetting: T,
    ) {
        // A tone is in phase with the motion for longer than other errors last.
        let disturbance = self.disturbance * (s.slope * s.slope * state.disturbance);
        let variance = self.add_residual(state, evidence, s) + disturbance;
        // Only accepted windows show the offset of the spool's sensor.
        evidence.readings = (T::splat(1.0) - self.average) * evidence.readings + T::splat(1.0);
        evidence.sensor = evidence.sensor + (s.reading - evidence.sensor) / evidence.readings;
        let below = node_below(s.instrument);
        let measured = [s.instrument, Self::residual(state, evidence, s)];
        for node in [below, below.wrapping_add(1)] {
            state.nodes.correct(&mut evidence.departures, node, measured, [variance, self.drift]);
        }
        state.nodes.visit(below);
        let [_, shared] = SHARED;
        let departures = s.departures - T::splat(shared) * evidence.common * s.instrument;
        evidence.recent_departures = forgetting * evidence.recent_departures + s.instrument * departures;
        evidence.recent_flows = forgetting * evidence.recent_flows + s.instrument * s.instrument;
        let forgetting = T::splat(1.0) - self.forgotten * (T::splat(1.0) - forgetting);
        Self::add_direction(evidence, s, flow_gain, forgetting);
    }

    /// A window's residual (steps).
    fn residual(state: &CurveState<T>, evidence: &CurveEvidence<T>, s: &CurveSample<T>) -> T {
        s.error - (state.offset - evidence.null) * s.slope
    }

    /// Adds a window's residual. Returns the variance (squared steps) of uncorrelated residuals of the same effect.
    fn add_residual(&self, state: &CurveState<T>, evidence: &mut CurveEvidence<T>, s: &CurveSample<T>) -> T {
        let error = Self::residual(state, evidence, s);
        let square = error * error;
        // The table's possible error is not noise.
        let (noise, least) = (square - prior_variance(s.instrument), T::splat(NOISE) * square);
        let noise = if noise > least { noise } else { least };
        let forgetting = T::splat(1.0) - self.average;
        evidence.windows = forgetting * evidence.windows + T::splat(1.0);
        evidence.squares = forgetting * evidence.squares + noise;
        self.variance(evidence)
    }

    /// Variance (squared steps) of uncorrelated residuals that have the effect of the windows' correlated ones.
    fn variance(&self, evidence: &CurveEvidence<T>) -> T {
        let [first, windows] = FIRST_ERRORS;
        let (sum, count) =
            (evidence.squares + T::splat(first * windows), evidence.windows + T::splat(windows));
        self.correlation * sum / count
    }

    /// Mean square (squared steps) of a window's residual.
    pub(super) fn mean_square(&self, evidence: &CurveEvidence<T>) -> T {
        self.variance(evidence) / self.correlation
    }

    /// Adds the window to its direction's sums.
    fn add_direction(evidence: &mut CurveEvidence<T>, s: &CurveSample<T>, flow_gain: T, forgetting: T) {
        let [back, forth] = &mut evidence.directions;
        let d = if s.instrument < T::splat(0.0) { back } else { forth };
        // The sums contain the flow before the division by the flow gain, which changes faster than these sums. Most of
        // the departures are removed.
        let (flow, instrument) = (flow_gain * s.demand, flow_gain * s.instrument);
        let [shared, _] = SHARED;
        // The null offset in use changes faster as well, so it is added back.
        let error = s.passed + evidence.null * s.slope - T::splat(1.0 - shared) * s.departures - flow;
        d.slopes = forgetting * d.slopes + s.slope * s.slope;
        d.slope_instruments = forgetting * d.slope_instruments + s.slope * instrument;
        d.slope_errors = forgetting * d.slope_errors + s.slope * error;
        d.flows = forgetting * d.flows + instrument * flow;
        d.flow_errors = forgetting * d.flow_errors + instrument * error;
        evidence.instrument_departures =
            forgetting * evidence.instrument_departures + instrument * s.departures;
        let [back, forth] = &evidence.directions;
        // The first sums may have the wrong sign, by noise.
        let flows = (back.flows + forth.flows).abs() + T::splat(COMMON_WEIGHT);
        evidence.common = flow_gain * evidence.instrument_departures / flows;
    }

    /// Updates asymmetry and null offset.
    pub(crate) fn update(&self, state: &mut CurveState<T>, evidence: &mut CurveEvidence<T>) {
        let variance = self.variance(evidence);
        self.solve(state, evidence, variance);
    }

    /// Updates a node for the tick.
    pub(crate) fn refresh(&self, state: &mut CurveState<T>, evidence: &CurveEvidence<T>) {
        state.nodes.refresh_next(&evidence.departures, evidence.asymmetry, self.grid.step);
    }

    /// Finds the common offset and the gain of each direction by least squares. Asymmetry and null offset in use follow
    /// at limited rates. `variance` is that of the errors.
    fn solve(&self, state: &mut CurveState<T>, evidence: &mut CurveEvidence<T>, variance: T) {
        let one = T::splat(1.0);
        let weight = |belief: f64| T::splat(1.0 / (belief * belief)) * variance;
        let (gain_weight, offset_weight) = (weight(GAIN_DEVIATION), weight(NULL_DEVIATION));
        let parts = |d: &Direction<T>| {
            let per = one / (d.flows + gain_weight);
            let share = d.slope_instruments * per;
            (
                d.flow_errors * per,
                share,
                d.slope_errors - share * d.flow_errors,
                d.slopes - share * d.slope_instruments,
            )
        };
        let [back, forth] = &evidence.directions;
        let ((back, back_share, error, slopes), (forth, forth_share, further, more)) =
            (parts(back), parts(forth));
        let per = one / (slopes + more + offset_weight);
        let offset = (error + further) * per;
        let (back, forth) = (one + back - offset * back_share, one + forth - offset * forth_share);
        let found = (forth - back) / (forth + back);
        let (most, now) = (T::splat(LARGEST_ASYMMETRY), evidence.asymmetry);
        let target = found.limit(-most, most);
        evidence.asymmetry = target.limit(now - self.change, now + self.change);
        let (most, now) = (T::splat(LARGEST_NULL), evidence.null);
        let bounded = offset.limit(-most, most);
        evidence.null = bounded.limit(now - self.null_change, now + self.null_change);
        (state.offset, state.variance) = (offset, variance * per);
        state.beyond = (found - target).abs() + (offset - bounded).abs();
    }
}
