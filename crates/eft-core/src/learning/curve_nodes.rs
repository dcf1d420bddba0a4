//! The nodes of the flow curve's correction: their departures, and the pieces between them for the tick.
//!
//! Each node has a *departure* from the gain of its direction. Only flows in the two adjacent pieces change it, by a
//! Kalman filter of one state. A band that was never visited follows its direction.

use crate::compensation::{CurvePiece, FIRST_NODE, NODES, PIECES, node_below, table_itself};
use crate::integrity::integrity;
use crate::learning::tuning::CURVE_DEPARTURE;
use crate::number::Real;

/// Prior standard deviation of a node's departure from its direction, over the node's flow.
pub(super) const NODE_DEVIATION: f64 = 0.05;
/// Least rise from node to node (steps).
const RISE: f64 = 0.3;

/// The node at no flow.
const ZERO: usize = PIECES / 2;

/// Flows of the nodes in steps from node to node, and the variances of their departures.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct CurveNodes<T> {
    /// Table flow at each node of no-load flow, and the pieces between them.
    flows: [T; NODES],
    pub(crate) pieces: [CurvePiece<T>; PIECES],
    /// Variance of each departure.
    pub(super) variances: [T; NODES],
    /// The last updated node of the cycle, the node below the last window's flow, and the number of updates.
    last: u32,
    visited: u32,
    updates: u32,
}
integrity!(CurveNodes<T>: flows, pieces, variances, last, visited, updates);

impl<T: Real> Default for CurveNodes<T> {
    fn default() -> Self {
        Self {
            flows: core::array::from_fn(node_flow),
            pieces: table_itself(),
            variances: core::array::from_fn(|node| prior_variance(node_flow(node))),
            last: 0,
            visited: 0,
            updates: 0,
        }
    }
}

impl<T: Real> CurveNodes<T> {
    /// Moves a node's departure towards the error (steps) of a window at a flow (steps). `noise` is the variance of the
    /// error, and `drift` the growth of the departure's variance over the square of the node's flow.
    pub(super) fn correct(
        &mut self,
        departures: &mut [T; NODES],
        node: usize,
        [flow, error]: [T; 2],
        [noise, drift]: [T; 2],
    ) {
        // The nodes at zero and beyond the ends of the table do not move.
        if node == ZERO || node == 0 || node >= NODES - 1 {
            return;
        }
        let (Some(departure), Some(variance)) = (departures.get_mut(node), self.variances.get_mut(node))
        else {
            return;
        };
        let at = node_flow::<T>(node);
        let weight = T::splat(1.0) - (flow - at).abs();
        let (grown, most) = (*variance + drift * (at * at), prior_variance(at));
        let grown = if grown < most { grown } else { most };
        let share = grown / (weight * weight * grown + noise);
        *variance = share * noise;
        let reach = T::splat(CURVE_DEPARTURE) * at.abs();
        *departure = (*departure + share * weight * error).limit(-reach, reach);
    }

    /// Records the node below the last window's flow.
    pub(super) fn visit(&mut self, below: usize) {
        self.visited = if below < NODES { below as u32 } else { 0 };
    }

    /// Resets the variances of the departures to those of the start, after a rollback.
    pub(super) fn reset_variances(&mut self) {
        self.variances = Self::default().variances;
    }

    /// Updates one node. In turn this is the node below the last window's flow, the node above it, and twice the next
    /// one of a cycle.
    pub(super) fn refresh_next(&mut self, departures: &[T; NODES], asymmetry: T, step: T) {
        self.updates = self.updates.wrapping_add(1);
        let node = if self.updates.is_multiple_of(2) {
            self.visited + self.updates / 2 % 2
        } else {
            self.last = if self.last < NODES as u32 - 2 { self.last + 1 } else { 1 };
            self.last
        };
        self.refresh(node as usize, departures, asymmetry, step);
    }

    /// Updates a node between its neighbours, and the two adjacent pieces. The ends stay where they are. `step` is the
    /// grid's (m³/s).
    pub(super) fn refresh(&mut self, node: usize, departures: &[T; NODES], asymmetry: T, step: T) {
        let last = node.wrapping_sub(1);
        let (Some([below, here, above]), Some([left, right]), Some(&departure)) = (
            self.flows.get_mut(last..node.wrapping_add(2)),
            self.pieces.get_mut(last..node.wrapping_add(1)),
            departures.get(node),
        ) else {
            return;
        };
        let (at, rise) = (node_flow::<T>(node), T::splat(RISE));
        *here = (at + asymmetry * at.abs() + departure).limit(*below + rise, *above - rise);
        let piece = |low: T, slope: T, at: T| CurvePiece { offset: (low - slope * at) * step, slope };
        *left = piece(*below, *here - *below, at - T::splat(1.0));
        *right = piece(*here, *above - *here, at);
    }
}

/// The no-load flow (m³/s) at the opening for which the table has this flow (m³/s), by a search. `step` is the grid's
/// (m³/s).
pub(super) fn inverse_at<T: Real>(pieces: &[CurvePiece<T>; PIECES], step: T, flow: T) -> T {
    let mut found = flow;
    for (n, piece) in pieces.iter().enumerate() {
        let (low, high) = (node_flow::<T>(n) * step, node_flow::<T>(n + 1) * step);
        let demand = (flow - piece.offset) / piece.slope;
        if demand >= low && demand <= high {
            found = demand;
        }
    }
    found
}

/// The departure (steps) at a flow (steps), by linear interpolation between the nodes.
pub(super) fn interpolate<T: Real>(departures: &[T; NODES], flow: T) -> T {
    let below = node_below(flow);
    match departures.get(below..below.wrapping_add(2)) {
        Some([low, high]) => *low + (flow - node_flow::<T>(below)) * (*high - *low),
        _ => T::splat(0.0),
    }
}

/// Prior variance of the table's error at a flow (steps).
pub(super) fn prior_variance<T: Real>(flow: T) -> T {
    T::splat(NODE_DEVIATION * NODE_DEVIATION) * (flow * flow)
}

/// Prior variance (squared steps) of a node's departure.
pub(super) fn node_variance<T: Real>(node: usize) -> T {
    prior_variance(node_flow(node))
}

/// No-load flow (steps) at a node.
fn node_flow<T: Real>(node: usize) -> T {
    T::from_u32(node as u32) + T::splat(FIRST_NODE)
}
