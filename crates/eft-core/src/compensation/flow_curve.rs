//! The flow table's correction in the tick: from the demanded no-load flow to the table's flow at the opening that
//! passes it.
//!
//! The map is a chain of straight pieces between nodes at equal steps of flow. The learner keeps it increasing.

use crate::integrity::integrity;
use crate::number::{Real, Scalar};

/// Number of pieces, half of them in either direction.
pub(crate) const PIECES: usize = 16;
/// Number of nodes, the ends of the pieces.
pub(crate) const NODES: usize = PIECES + 1;
/// Flow (steps) of the first node.
pub(crate) const FIRST_NODE: f64 = -(PIECES as f64) / 2.0;

/// One piece of the chain: the table flow `offset + slope·demand`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct CurvePiece<S> {
    /// Table flow (m³/s) where the piece, extended, meets a demand of zero.
    pub offset: S,
    /// Table flow per demanded flow (1).
    pub slope: S,
}
integrity!(CurvePiece<T>: offset, slope);

/// The pieces without a correction.
pub(crate) fn table_itself<S: Scalar>() -> [CurvePiece<S>; PIECES] {
    [CurvePiece { offset: S::splat(0.0), slope: S::splat(1.0) }; PIECES]
}

/// The distance of the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurveGrid<S> {
    /// Steps per flow (s/m³).
    pub(crate) per_flow: S,
    /// Flow (m³/s) of a step.
    pub(crate) step: S,
}
integrity!(CurveGrid<T>: per_flow, step);

impl<S: Scalar> CurveGrid<S> {
    /// The table's flow (m³/s) for a demanded no-load flow (m³/s). Beyond the nodes, where the valve is saturated, it
    /// is the demanded flow.
    #[inline(always)]
    pub(crate) fn apply(&self, pieces: &[CurvePiece<S>; PIECES], demand: S) -> S {
        let steps = demand * self.per_flow;
        // Lane by lane, because each lane has its own piece.
        S::from_lanes(|lane| {
            let flow = demand.lane(lane);
            match pieces.get(node_below(steps.lane(lane))) {
                Some(piece) => piece.offset.lane(lane) + flow * piece.slope.lane(lane),
                None => flow,
            }
        })
    }

    pub(crate) fn pack<'a>(lane: &dyn Fn(usize) -> &'a CurveGrid<S::Element>) -> Self
    where
        S::Element: 'a,
    {
        Self { per_flow: S::from_lanes(|i| lane(i).per_flow), step: S::from_lanes(|i| lane(i).step) }
    }
}

impl CurveGrid<f64> {
    /// For a table that ends at this flow (m³/s); the last piece lies beyond its end.
    pub(crate) const fn over(end: f64) -> Self {
        let step = end / (PIECES / 2 - 1) as f64;
        Self { per_flow: 1.0 / step, step }
    }
}

/// The number of the node below a flow (steps), if there is one. The piece above a node has the node's number.
#[inline(always)]
pub(crate) fn node_below<T: Real>(demand: T) -> usize {
    // Cells are counted from 1. The first node is cell 0.
    (demand + T::splat(1.0 - FIRST_NODE)).cell().0 as usize
}
