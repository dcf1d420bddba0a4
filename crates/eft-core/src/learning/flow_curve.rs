//! The flow table's correction by direction and band of flow, as it is learned.
//!
//! The flow gain `θ` is one number for the whole table. What it leaves is the error of the table's shape: the map from
//! the flow that the valve passes at no load to the flow that the table has at its opening. Each direction has a gain
//! of its own. It is found by least squares together with an offset of the opening, which is an error of the sensor and
//! not of the table. Each node has a departure from that gain, which only flows in the two adjacent pieces move. A band
//! that was never visited follows its direction. A direction that was never visited follows the table and `θ`.
//!
//! Estimated is the inverse and not the curve: the nodes then stand where demands are, and a tick finds its piece by one
//! multiplication.

use crate::compensation::{CurveGrid, CurvePiece, FIRST_NODE, NODES, PIECES, node_below, table_itself};
use crate::number::Real;

/// Weight of the belief in the table (squared steps), against a direction's gain.
const PRIOR: f64 = 1e-2;
/// The same against a node's departure from its direction.
const NODE_PRIOR: f64 = 1e-2;
/// Bounds of a direction's gain against the table's, less 1.
const FARTHEST: f64 = 0.3;
/// Largest departure of a node from its direction, over the node's own flow.
const DEPARTURE: f64 = 0.2;
/// Part of the departures that a direction looks past: what it can explain itself it takes over, slowly.
const SHARED: f64 = 0.1;
/// Least rise from node to node (steps).
const RISE: f64 = 0.3;

/// The node at no flow.
const ZERO: usize = PIECES / 2;

/// Constants of the correction; flows in steps from node to node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowCurve<T> {
    pub(crate) grid: CurveGrid<T>,
    /// Share of a direction's evidence that a further window of it displaces.
    pub(crate) forgotten: T,
    /// Largest change of a direction's gain at a time (1).
    pub(crate) change: T,
    /// Share of a node's evidence that a further window in an adjacent piece displaces.
    pub(crate) forgotten_beside: T,
}

/// Sums over the windows of one direction, and what follows from them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
struct Direction<T> {
    /// Of the table's slope squared, times flow, times error.
    slopes: T,
    slope_flows: T,
    slope_errors: T,
    /// Of the flow squared, times error.
    flows: T,
    flow_errors: T,
    /// The direction's gain, less 1.
    gain: T,
}

/// What a checkpoint keeps of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CurveEvidence<T> {
    /// Backwards, forwards.
    directions: [Direction<T>; 2],
    /// The nodes' departures (steps) from their direction.
    departures: [T; NODES],
}

/// What the correction remembers besides; flows in steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CurveState<T> {
    /// Table flow at each node of no-load flow, and the pieces between them.
    nodes: [T; NODES],
    pub(crate) pieces: [CurvePiece<T>; PIECES],
    /// Squared weights behind each departure.
    known: [T; NODES],
    /// The spool sensor's offset (unit opening).
    offset: T,
    /// How far a direction wanted to go beyond its bounds (1).
    pub(crate) beyond: T,
    /// The node that was brought up to date last.
    node: u32,
}

/// A window as the correction sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurveSample<T> {
    /// Flow at no load, by the actuator.
    demand: T,
    /// The same by the table at the measured opening, and its slope there (1/unit opening).
    passed: T,
    slope: T,
    /// What the table has more than the correction says.
    error: T,
}

impl<T: Real> Default for CurveState<T> {
    fn default() -> Self {
        let zero = T::splat(0.0);
        Self {
            nodes: core::array::from_fn(start),
            pieces: table_itself(),
            known: [zero; NODES],
            offset: zero,
            beyond: zero,
            node: 0,
        }
    }
}

impl<T: Real> FlowCurve<T> {
    /// The no-load flow (m³/s) that passes where the table has this one (m³/s), by searching.
    pub(crate) fn undo(&self, pieces: &[CurvePiece<T>; PIECES], flow: T) -> T {
        let mut found = flow;
        for (n, piece) in pieces.iter().enumerate() {
            let (low, high) = (start::<T>(n) * self.grid.step, start::<T>(n + 1) * self.grid.step);
            let demand = (flow - piece.offset) / piece.slope;
            if demand >= low && demand <= high {
                found = demand;
            }
        }
        found
    }

    /// A window: flow (m³/s) that the actuator took under the root of its pressure drop (1), flow (m³/s) by the table at
    /// no load and its slope (m³/s per unit opening).
    pub(crate) fn sample(
        &self,
        state: &CurveState<T>,
        flow: T,
        root: T,
        passed: T,
        slope: T,
    ) -> CurveSample<T> {
        let per_flow = self.grid.per_flow;
        let (demand, passed) = (flow / root * per_flow, passed * per_flow);
        let error = passed - self.grid.apply(&state.pieces, flow / root) * per_flow;
        CurveSample { demand, passed, slope: slope * per_flow, error }
    }

    /// The flow (m³/s) of a window as the table would have it at the same openings, for the estimator of `θ`.
    pub(crate) fn straightened(&self, state: &CurveState<T>, flow: T, root: T, flow_gain: T) -> T {
        self.grid.apply(&state.pieces, flow / root / flow_gain) * flow_gain * root
    }

    /// Learns of a window that counts.
    pub(crate) fn learn(
        &self,
        state: &mut CurveState<T>,
        evidence: &mut CurveEvidence<T>,
        s: &CurveSample<T>,
    ) {
        let below = node_below(s.demand);
        let above = below.wrapping_add(1);
        self.depart(state, evidence, s, below);
        self.depart(state, evidence, s, above);
        self.gather(evidence, s);
        state.refresh(evidence, below);
        state.refresh(evidence, above);
        self.solve(state, evidence);
    }

    /// Moves a node's departure towards the flows seen in the adjacent pieces.
    fn depart(
        &self,
        state: &mut CurveState<T>,
        evidence: &mut CurveEvidence<T>,
        s: &CurveSample<T>,
        node: usize,
    ) {
        // The nodes at zero and beyond the ends of the table stay where they are.
        if node == ZERO || node == 0 || node >= NODES - 1 {
            return;
        }
        let (Some(departure), Some(known)) = (evidence.departures.get_mut(node), state.known.get_mut(node))
        else {
            return;
        };
        let at = start::<T>(node);
        let weight = T::splat(1.0) - (s.demand - at).abs();
        let error = s.error - state.offset * s.slope;
        let square = weight * weight;
        *known = *known + square - self.forgotten_beside * square * *known;
        let wanted = *departure + weight * error / (*known + T::splat(NODE_PRIOR));
        let reach = T::splat(DEPARTURE) * at.abs();
        *departure = wanted.limit(-reach, reach);
    }

    /// Adds the window to its direction's sums.
    fn gather(&self, evidence: &mut CurveEvidence<T>, s: &CurveSample<T>) {
        let [back, forth] = &mut evidence.directions;
        let d = if s.demand < T::splat(0.0) { back } else { forth };
        // Against the table and most of the nodes' departures: what a direction can explain becomes its own in
        // the end.
        let explained = d.gain * s.demand;
        let departures = s.passed - s.error - s.demand - explained;
        let error = s.error + explained + T::splat(SHARED) * departures;
        let keep = T::splat(1.0) - self.forgotten;
        d.slopes = keep * d.slopes + s.slope * s.slope;
        d.slope_flows = keep * d.slope_flows + s.slope * s.demand;
        d.slope_errors = keep * d.slope_errors + s.slope * error;
        d.flows = keep * d.flows + s.demand * s.demand;
        d.flow_errors = keep * d.flow_errors + s.demand * error;
    }

    /// Brings the next node, round and round, up to its direction's gain, and the pieces up to their nodes.
    pub(crate) fn refresh(&self, state: &mut CurveState<T>, evidence: &CurveEvidence<T>) {
        state.node = if state.node < NODES as u32 - 2 { state.node + 1 } else { 1 };
        state.refresh(evidence, state.node as usize);
        let ends = state.nodes.iter().zip(state.nodes.iter().skip(1));
        for (n, (piece, (&low, &high))) in state.pieces.iter_mut().zip(ends).enumerate() {
            let slope = high - low;
            *piece = CurvePiece { offset: (low - slope * start(n)) * self.grid.step, slope };
        }
    }

    /// The offset that both directions share and either direction's gain, by least squares, the gains at a limited rate.
    fn solve(&self, state: &mut CurveState<T>, evidence: &mut CurveEvidence<T>) {
        let prior = T::splat(PRIOR);
        let [back, forth] = &mut evidence.directions;
        let parts = |d: &Direction<T>| {
            let share = d.slope_flows / (d.flows + prior);
            (d.slope_errors - share * d.flow_errors, d.slopes - share * d.slope_flows)
        };
        let ((error, slopes), (further, more)) = (parts(back), parts(forth));
        let offset = (error + further) / (slopes + more + prior);
        let most = T::splat(FARTHEST);
        let settle = |d: &mut Direction<T>| {
            let raw = (d.flow_errors - offset * d.slope_flows) / (d.flows + prior);
            let target = raw.limit(-most, most);
            d.gain = target.limit(d.gain - self.change, d.gain + self.change);
            (raw - target).abs()
        };
        state.offset = offset;
        state.beyond = settle(back) + settle(forth);
    }
}

impl<T: Real> CurveState<T> {
    /// Brings a node up to what is known, between its neighbours. The ends stay where they are.
    fn refresh(&mut self, evidence: &CurveEvidence<T>, node: usize) {
        let [back, forth] = &evidence.directions;
        let gain = if node < ZERO { back.gain } else { forth.gain };
        let (Some([below, here, above]), Some(&departure)) =
            (self.nodes.get_mut(node.wrapping_sub(1)..node.wrapping_add(2)), evidence.departures.get(node))
        else {
            return;
        };
        let (at, rise) = (start::<T>(node), T::splat(RISE));
        *here = (at + gain * at + departure).limit(*below + rise, *above - rise);
    }
}

/// No-load flow (steps) at a node.
fn start<T: Real>(node: usize) -> T {
    T::from_u32(node as u32) + T::splat(FIRST_NODE)
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "tests")]
mod tests {
    use super::*;

    const CURVE: FlowCurve<f64> =
        FlowCurve { grid: CurveGrid::over(8.0), forgotten: 1e-3, change: 0.01, forgotten_beside: 0.02 };

    #[derive(Default)]
    struct Learned {
        state: CurveState<f64>,
        evidence: CurveEvidence<f64>,
    }

    impl Learned {
        fn apply(&self, demand: f64) -> f64 {
            CURVE.grid.apply(&self.state.pieces, demand)
        }
    }

    /// After swings of this size (m³/s) through a valve that passes `true_flow` where its table has a flow, the spool
    /// sensor off by `offset` (of the table's slope, which is 1 everywhere).
    fn learned(swing: f64, offset: f64, true_flow: impl Fn(f64) -> f64) -> Learned {
        let mut l = Learned::default();
        for n in 0..8000_u32 {
            let table = swing * (0.05 * f64::from(n)).sin();
            let sample = CURVE.sample(&l.state, 0.9 * true_flow(table), 0.9, table + offset, 1.0);
            CURVE.learn(&mut l.state, &mut l.evidence, &sample);
            CURVE.refresh(&mut l.state, &l.evidence);
        }
        l
    }

    fn sided(flow: f64) -> f64 {
        let soft = if flow.abs() > 4.0 { 0.9 } else { 1.0 };
        (if flow < 0.0 { 0.95 } else { 1.05 })
            * (soft * (flow.abs() - 4.0).max(0.0) + flow.abs().min(4.0))
            * flow.signum()
    }

    #[test]
    fn nothing_is_corrected_at_rest_and_by_a_sound_table() {
        for state in [Learned::default(), learned(6.0, 0.0, |flow| flow), learned(6.0, 0.01, |flow| flow)] {
            for n in -100..=100 {
                let flow = 0.1 * f64::from(n);
                let found = state.apply(flow);
                assert!((found - flow).abs() < 2e-3, "{flow}: {found}");
            }
        }
    }

    #[test]
    fn directions_and_bands_are_found_beside_an_offset() {
        let state = learned(6.5, -0.02, sided);
        for n in -60..=60 {
            let table = 0.1 * f64::from(n);
            let found = CURVE.undo(&state.state.pieces, table);
            assert!((found - sided(table)).abs() < 0.03, "{table}: {found} of {}", sided(table));
            assert!((state.apply(found) - table).abs() < 1e-12);
        }
        // A band that was never visited follows its direction, which shares the neighbours' departures for long.
        let state = learned(2.0, 0.0, sided);
        for (flow, ratio) in [(6.0, 1.05), (-6.0, 0.95)] {
            let found = CURVE.undo(&state.state.pieces, flow) / flow;
            assert!((found - ratio).abs() < 0.015, "{flow}: {found}");
        }
    }

    #[test]
    fn map_increases_whatever_was_learned() {
        // A curve that no table can have.
        let state = learned(7.0, 0.0, |flow| if flow.abs() < 3.0 { 2.0 * flow } else { 0.3 * flow });
        let mut before = f64::NEG_INFINITY;
        for n in -1200..=1200 {
            let value = state.apply(0.01 * f64::from(n));
            assert!(value > before, "{n}: {value}, {before}");
            before = value;
        }
        assert!(state.apply(f64::NAN).is_nan());
        assert!(state.state.beyond > 0.0 || state.evidence.directions[1].gain.abs() < FARTHEST);
    }
}
