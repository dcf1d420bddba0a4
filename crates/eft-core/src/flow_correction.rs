//! Correction of the flow table by direction and band of opening.
//!
//! The flow gain `θ` is one number for the whole table. What it leaves is the error of the table's shape: the map from
//! the flow that the valve passes at no load to the flow that the table has at its opening. It is an increasing chain
//! of straight pieces between nodes at equal steps of flow. Either direction has a gain of its own, by least squares
//! together with an offset of the opening, which is the sensor's and no error of the table; and each node a departure from it, which
//! moves only by flows in the pieces beside it. So a band that was never visited follows its direction, and a
//! direction that was never visited the table and `θ`.
//!
//! Estimated is the inverse and not the curve: the nodes then stand where demands are, a tick finds its piece by one
//! multiplication, and no piece has to be inverted.

use crate::evidence::{Learned, Proof};
use crate::piecewise::Row;
use crate::scalar::{Mask, Scalar, pack_numbers};

/// Pieces in either direction.
const PIECES: usize = 8;
/// Nodes: the pieces' ends.
const NODES: usize = 2 * PIECES + 1;
/// What is learned: a departure at each node, and the sums of either direction.
const ITEMS: u32 = NODES as u32 + 2;
/// Rounds through them from one time that they are put by to the next: a quarter of a second or more.
const ROUNDS: u32 = 4;

/// Constants of the correction; flows in steps from node to node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowCorrection<S> {
    /// Steps per flow (s/m³).
    pub(crate) per_flow: S,
    /// Flow (m³/s) of a step.
    pub(crate) step: S,
    /// Share of a direction's evidence that a further window of it displaces.
    pub(crate) forgotten: S,
    /// Largest change of a direction's gain at a time (1).
    pub(crate) change: S,
    /// Share of a node's evidence that a further window beside it displaces.
    pub(crate) forgotten_beside: S,
}

pack_numbers!(FlowCorrection: per_flow, step, forgotten, change, forgotten_beside);

impl FlowCorrection<f64> {
    /// For a table that ends at this flow (m³/s).
    pub(crate) const fn over(end: f64, forgotten: f64, change: f64, forgotten_beside: f64) -> Self {
        // The last piece lies beyond the table's end.
        let step = end / (PIECES - 1) as f64;
        Self { per_flow: 1.0 / step, step, forgotten, change, forgotten_beside }
    }
}

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

/// Sums over the windows of one direction, and what follows from them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
struct Direction<S> {
    /// Of the table's slope squared, times flow, times error.
    slopes: S,
    slope_flows: S,
    slope_errors: S,
    /// Of the flow squared, times error.
    flows: S,
    flow_errors: S,
    /// The direction's gain, less 1.
    gain: S,
}

impl<S: Scalar> Learned for Direction<S> {
    type Mask = S::Mask;

    #[inline(always)]
    fn take_over(&mut self, from: &Self, at: S::Mask) {
        if at.all() {
            *self = *from;
            return;
        }
        self.slopes.take_over(&from.slopes, at);
        self.slope_flows.take_over(&from.slope_flows, at);
        self.slope_errors.take_over(&from.slope_errors, at);
        self.flows.take_over(&from.flows, at);
        self.flow_errors.take_over(&from.flow_errors, at);
        self.gain.take_over(&from.gain, at);
    }
}

/// What the correction remembers; flows in steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct FlowCorrectionState<S> {
    /// Nodes and the pieces behind them.
    rows: [Row<S>; NODES],
    /// The nodes' departures from their direction.
    departures: [S; NODES],
    /// Squared weights behind each departure.
    evidence: [S; NODES],
    directions: [Direction<S>; 2],
    /// The spool sensor's (unit opening), less what it should be.
    offset: S,
    /// The window's flow by the table at no load and its slope (1/unit opening), and the root of its pressure drop (1).
    passed: S,
    slope: S,
    root: S,
    /// A window's flow at no load, and what the table has more there than the correction says.
    demand: S,
    error: S,
    /// 1 where the window's evidence counts.
    counts: S,
    /// How far a direction wanted to go beyond its bounds (1).
    pub(crate) beyond: S,
    /// The node that was brought up to date last.
    node: u32,
    /// The item that was looked after last, and the rounds through all of them.
    item: u32,
    round: u32,
    /// Items left to take back.
    doubted: S,
    departures_proof: [Proof<S>; NODES],
    directions_proof: [Proof<Direction<S>>; 2],
}

impl<S: Scalar> FlowCorrectionState<S> {
    /// The table as it is.
    pub(crate) fn at_rest() -> Self {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let mut start = S::splat(-(NODES as f64 / 2.0 + 0.5));
        let rows = core::array::from_fn(|_| {
            start = start + one;
            Row { start, value: start, slope: one }
        });
        Self {
            rows,
            departures: [zero; NODES],
            evidence: [zero; NODES],
            directions: [Direction::default(); 2],
            offset: zero,
            passed: zero,
            slope: zero,
            root: one,
            demand: zero,
            error: zero,
            counts: zero,
            beyond: zero,
            node: 0,
            item: 0,
            round: 0,
            doubted: zero,
            departures_proof: [Proof::default(); NODES],
            directions_proof: [Proof::default(); 2],
        }
    }

    /// The piece that a lane's flow lies on: the node below it.
    #[inline(always)]
    fn piece(demand: S, lane: usize) -> usize {
        // The first node is cell 0, and a cell is counted from 1.
        let position = demand + S::splat(PIECES as f64 + 1.0);
        position.lane(lane).cell().0 as usize
    }

    /// The table's flow whose opening passes a demand (both in steps): increasing and continuous. Beyond the pieces,
    /// where the valve is saturated, the demand itself.
    #[inline(always)]
    fn apply(&self, demand: S) -> S {
        // Lane by lane: each finds a piece of its own.
        S::from_lanes(|lane| {
            let x = demand.lane(lane);
            match self.rows.get(Self::piece(demand, lane)) {
                Some(row) => row.value.lane(lane) + (x - row.start.lane(lane)) * row.slope.lane(lane),
                None => x,
            }
        })
    }

    /// Brings a node up to what is known, and lays the pieces beside it through it.
    #[inline(always)]
    fn refresh(&mut self, lane: usize, node: usize) {
        let [back, forth] = &self.directions;
        let gain = if node < PIECES { back.gain.lane(lane) } else { forth.gain.lane(lane) };
        let (Some([before, here, after]), Some(departure)) =
            (self.rows.get_mut(node.wrapping_sub(1)..node.wrapping_add(2)), self.departures.get(node))
        else {
            return;
        };
        let (start, rise) = (here.start.lane(lane), S::Element::splat(RISE));
        let (below, above) = (before.value.lane(lane), after.value.lane(lane));
        let value = (start + gain * start + departure.lane(lane)).limit(below + rise, above - rise);
        set(&mut here.value, lane, value);
        set(&mut before.slope, lane, value - below);
        set(&mut here.slope, lane, above - value);
    }

    /// The way back, by searching.
    fn undo(&self, flow: S) -> S {
        S::from_lanes(|lane| {
            let x = flow.lane(lane);
            let mut found = x;
            for (row, next) in self.rows.iter().zip(self.rows.iter().skip(1)) {
                let (low, high) = (row.value.lane(lane), next.value.lane(lane));
                if x >= low && x <= high {
                    found = row.start.lane(lane) + (x - low) / row.slope.lane(lane);
                }
            }
            found
        })
    }
}

impl<S: Scalar> FlowCorrection<S> {
    /// As a table that is corrected in place would read a no-load flow (m³/s).
    #[inline(always)]
    pub(crate) fn apply(&self, state: &FlowCorrectionState<S>, demand: S) -> S {
        state.apply(demand * self.per_flow) * self.step
    }

    /// The no-load flow (m³/s) that passes where the table has this one (m³/s).
    pub(crate) fn undo(&self, state: &FlowCorrectionState<S>, flow: S) -> S {
        state.undo(flow * self.per_flow) * self.step
    }

    /// Notes a window's flow by the table (m³/s at no load), its slope (m³/s per unit opening) and the root of its
    /// pressure drop (1).
    #[inline(always)]
    pub(crate) fn note(&self, state: &mut FlowCorrectionState<S>, passed: S, slope: S, root: S) {
        (state.passed, state.slope, state.root) = (passed * self.per_flow, slope * self.per_flow, root);
    }

    /// The window's flow (m³/s) as the table would have it at the same openings, for the estimator of `θ`.
    #[inline(always)]
    pub(crate) fn straighten(&self, state: &mut FlowCorrectionState<S>, flow: S, gain: S, per_gain: S) -> S {
        let demand = flow * self.per_flow / state.root;
        state.demand = demand;
        state.error = state.passed - state.apply(demand);
        state.apply(demand * per_gain) * gain * state.root * self.step
    }

    /// Notes where the window's evidence is `believed`.
    #[inline(always)]
    pub(crate) fn believe(&self, state: &mut FlowCorrectionState<S>, believed: S::Mask) {
        state.counts = S::select(believed, S::splat(1.0), S::splat(0.0));
    }

    /// Moves the departure of the node below (`upper` = 0) or above (1) the window's flow towards what was seen.
    #[inline(always)]
    pub(crate) fn depart(&self, state: &mut FlowCorrectionState<S>, upper: usize) {
        each_counting(state, |state, lane| {
            let one = S::Element::splat(1.0);
            let node = FlowCorrectionState::piece(state.demand, lane).wrapping_add(upper);
            // The nodes at zero and beyond the ends of the table stay where they are.
            if node == PIECES || node == 0 || node >= NODES - 1 {
                return;
            }
            let (Some(row), Some(departure), Some(evidence)) =
                (state.rows.get(node), state.departures.get_mut(node), state.evidence.get_mut(node))
            else {
                return;
            };
            let start = row.start.lane(lane);
            let weight = one - (state.demand.lane(lane) - start).abs();
            let error = state.error.lane(lane) - state.offset.lane(lane) * state.slope.lane(lane);
            let square = weight * weight;
            let known = evidence.lane(lane);
            let known = known + square - self.forgotten_beside.lane(lane) * square * known;
            set(evidence, lane, known);
            let wanted = departure.lane(lane) + weight * error / (known + S::Element::splat(NODE_PRIOR));
            let reach = S::Element::splat(DEPARTURE) * start.abs();
            set(departure, lane, wanted.limit(-reach, reach));
        });
    }

    /// Adds the window to its direction's sums.
    #[inline(always)]
    pub(crate) fn gather(&self, state: &mut FlowCorrectionState<S>) {
        each_counting(state, |state, lane| {
            let (demand, slope) = (state.demand.lane(lane), state.slope.lane(lane));
            let [back, forth] = &mut state.directions;
            let d = if demand < S::Element::splat(0.0) { back } else { forth };
            // Against the table and most of the nodes' departures: what a direction can explain becomes its own in
            // the end.
            let error = state.error.lane(lane);
            let departures = state.passed.lane(lane) - error - demand - d.gain.lane(lane) * demand;
            let error = error + d.gain.lane(lane) * demand + S::Element::splat(SHARED) * departures;
            let keep = S::Element::splat(1.0) - self.forgotten.lane(lane);
            let add = |to: &mut S, value: S::Element| set(to, lane, keep * to.lane(lane) + value);
            add(&mut d.slopes, slope * slope);
            add(&mut d.slope_flows, slope * demand);
            add(&mut d.slope_errors, slope * error);
            add(&mut d.flows, demand * demand);
            add(&mut d.flow_errors, demand * error);
        });
    }

    /// The offset that both directions share, by least squares together with their gains.
    #[inline(always)]
    pub(crate) fn offset(&self, state: &mut FlowCorrectionState<S>) {
        each_counting(state, |state, lane| {
            let prior = S::Element::splat(PRIOR);
            let [back, forth] = &state.directions;
            let parts = |d: &Direction<S>| {
                let both = d.slope_flows.lane(lane);
                let share = both / (d.flows.lane(lane) + prior);
                let error = d.slope_errors.lane(lane) - share * d.flow_errors.lane(lane);
                (error, d.slopes.lane(lane) - share * both)
            };
            let ((error, slopes), (further, more)) = (parts(back), parts(forth));
            set(&mut state.offset, lane, (error + further) / (slopes + more + prior));
        });
    }

    /// The directions' gains beside that offset, at a limited rate.
    #[inline(always)]
    pub(crate) fn gains(&self, state: &mut FlowCorrectionState<S>) {
        each_counting(state, |state, lane| {
            let (most, change) = (S::Element::splat(FARTHEST), self.change.lane(lane));
            let (offset, mut beyond) = (state.offset.lane(lane), S::Element::splat(0.0));
            let mut settle = |d: &mut Direction<S>| {
                let errors = d.flow_errors.lane(lane) - offset * d.slope_flows.lane(lane);
                let raw = errors / (d.flows.lane(lane) + S::Element::splat(PRIOR));
                let target = raw.limit(-most, most);
                beyond = beyond + (raw - target).abs();
                let gain = d.gain.lane(lane);
                set(&mut d.gain, lane, target.limit(gain - change, gain + change));
            };
            let [back, forth] = &mut state.directions;
            settle(back);
            settle(forth);
            set(&mut state.beyond, lane, beyond);
        });
    }

    /// Brings the node below (`upper` = 0) or above (1) the window's flow up to its departure, before the next
    /// window: what is learned of a node that stands still is learned again.
    #[inline(always)]
    pub(crate) fn bend(&self, state: &mut FlowCorrectionState<S>, upper: usize) {
        each_counting(state, |state, lane| {
            let node = FlowCorrectionState::piece(state.demand, lane).wrapping_add(upper);
            state.refresh(lane, node);
        });
    }

    /// Brings the next node, round and round, up to its direction's gain.
    #[inline(always)]
    pub(crate) fn follow(&self, state: &mut FlowCorrectionState<S>) {
        state.node = if state.node < NODES as u32 - 2 { state.node + 1 } else { 1 };
        let mut lane = 0;
        while lane < S::LANES {
            state.refresh(lane, state.node as usize);
            lane += 1;
        }
    }

    /// Looks after the next item, round and round: takes it back where what was learned lately became `doubtful` since
    /// its last turn, elsewhere puts it by in one of the rounds. All at once would cost a tick too much.
    #[inline(always)]
    pub(crate) fn keep(&self, state: &mut FlowCorrectionState<S>, doubtful: S::Mask) {
        let last = state.item >= ITEMS - 1;
        state.item = if last { 0 } else { state.item + 1 };
        if last {
            state.round = state.round.wrapping_add(1) % ROUNDS;
        }
        let left = S::select(doubtful, S::splat(f64::from(ITEMS)), state.doubted);
        let doubted = left.gt(S::splat(0.0));
        let sound = !doubted & S::Mask::splat(state.round == 0);
        state.doubted = S::select(doubted, left - S::splat(1.0), left);
        let item = state.item as usize;
        if let (Some(departure), Some(proof)) =
            (state.departures.get_mut(item), state.departures_proof.get_mut(item))
        {
            proof.go_back(departure, doubted);
            proof.put_by(departure, sound);
        } else if let (Some(direction), Some(proof)) =
            (state.directions.get_mut(item - NODES), state.directions_proof.get_mut(item - NODES))
        {
            proof.go_back(direction, doubted);
            proof.put_by(direction, sound);
        }
    }
}

/// Does its part for every lane whose window counts.
#[inline(always)]
fn each_counting<S: Scalar>(
    state: &mut FlowCorrectionState<S>,
    mut work: impl FnMut(&mut FlowCorrectionState<S>, usize),
) {
    let mut lane = 0;
    while lane < S::LANES {
        if state.counts.lane(lane) > S::Element::splat(0.0) {
            work(state, lane);
        }
        lane += 1;
    }
}

/// Puts a value into one lane.
#[inline(always)]
fn set<S: Scalar>(to: &mut S, lane: usize, value: S::Element) {
    let before = *to;
    *to = S::from_lanes(|i| if i == lane { value } else { before.lane(i) });
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "tests")]
mod tests {
    use super::*;

    const CORRECTION: FlowCorrection<f64> = FlowCorrection::over(8.0, 1e-3, 0.01, 0.02);

    /// After swings of this size (m³/s) through a valve that passes `true_flow` where its table has a flow, the spool
    /// sensor off by `offset` (of the table's slope, which is 1 everywhere).
    fn learned(swing: f64, offset: f64, true_flow: impl Fn(f64) -> f64) -> FlowCorrectionState<f64> {
        let mut state = FlowCorrectionState::at_rest();
        for n in 0..8000_u32 {
            let table = swing * (0.05 * f64::from(n)).sin();
            CORRECTION.bend(&mut state, 1);
            CORRECTION.note(&mut state, table + offset, 1.0, 0.9);
            CORRECTION.follow(&mut state);
            CORRECTION.straighten(&mut state, 0.9 * true_flow(table), 1.0, 1.0);
            CORRECTION.offset(&mut state);
            CORRECTION.gains(&mut state);
            CORRECTION.keep(&mut state, false);
            CORRECTION.believe(&mut state, true);
            CORRECTION.depart(&mut state, 0);
            CORRECTION.depart(&mut state, 1);
            CORRECTION.gather(&mut state);
            CORRECTION.bend(&mut state, 0);
        }
        state
    }

    fn sided(flow: f64) -> f64 {
        let soft = if flow.abs() > 4.0 { 0.9 } else { 1.0 };
        (if flow < 0.0 { 0.95 } else { 1.05 })
            * (soft * (flow.abs() - 4.0).max(0.0) + flow.abs().min(4.0))
            * flow.signum()
    }

    #[test]
    fn nothing_is_corrected_at_rest_and_by_a_sound_table() {
        for state in
            [FlowCorrectionState::at_rest(), learned(6.0, 0.0, |flow| flow), learned(6.0, 0.01, |flow| flow)]
        {
            for n in -100..=100 {
                let flow = 0.1 * f64::from(n);
                let found = CORRECTION.apply(&state, flow);
                assert!((found - flow).abs() < 2e-3, "{flow}: {found}");
            }
        }
    }

    #[test]
    fn directions_and_bands_are_found_beside_an_offset() {
        let state = learned(6.5, -0.02, sided);
        for n in -60..=60 {
            let table = 0.1 * f64::from(n);
            let found = CORRECTION.undo(&state, table);
            assert!((found - sided(table)).abs() < 0.03, "{table}: {found} of {}", sided(table));
            assert!((CORRECTION.apply(&state, found) - table).abs() < 1e-12);
        }
        // What was never visited follows its direction, which the departures beside it share for a long while.
        let state = learned(2.0, 0.0, sided);
        for (flow, ratio) in [(6.0, 1.05), (-6.0, 0.95)] {
            let found = CORRECTION.undo(&state, flow) / flow;
            assert!((found - ratio).abs() < 0.015, "{flow}: {found}");
        }
    }

    #[test]
    fn map_increases_whatever_was_learned() {
        // A curve that no table can have.
        let state = learned(7.0, 0.0, |flow| if flow.abs() < 3.0 { 2.0 * flow } else { 0.3 * flow });
        let mut before = f64::NEG_INFINITY;
        for n in -1200..=1200 {
            let value = CORRECTION.apply(&state, 0.01 * f64::from(n));
            assert!(value > before, "{n}: {value}, {before}");
            before = value;
        }
        assert!(CORRECTION.apply(&state, f64::NAN).is_nan());
        assert!(state.beyond > 0.0 || state.directions[1].gain.abs() < FARTHEST);
    }
}
