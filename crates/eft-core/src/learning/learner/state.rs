//! The state of a learner.

use crate::checksum::word;
use crate::compensation::Deviations;
use crate::integrity::integrity;
use crate::learning::band_filter::BandState;
use crate::learning::checkpoint::{Checkpoints, Evidence};
use crate::learning::flow_curve::CurveState;
use crate::learning::gate::GateState;
use crate::learning::guard::GuardState;
use crate::learning::least_squares::GainAndDelay;
use crate::learning::valve::ValveState;
use crate::number::Real;

/// The state of a learner, made by [`Learner::at_rest`](crate::Learner::at_rest).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct LearnerState<T> {
    /// Number of the next window, if none is missing.
    pub(super) number: u32,
    /// Number of windows since the last checkpoint.
    pub(super) since_checkpoint: u32,
    /// Number of windows, counted up to the end of the start.
    pub(super) since_start: u32,
    /// Whether the filters contain the previous window.
    pub(super) filtered: bool,
    /// Whether the means continue although learning is held off.
    pub(super) means_go_on: bool,
    pub(super) means: Means<T>,
    /// The means' share in a window if learning is not held off.
    pub(super) mean_share: T,
    /// The means' share in use.
    pub(super) share: T,
    pub(super) filters: Filters<T>,
    /// The actuator's flow and the table's (m³/s), both at no load and at one instant.
    pub(super) flows: [T; 2],
    pub(super) gate: GateState<T>,
    pub(in crate::learning) flow: GainAndDelay<T>,
    pub(in crate::learning) valve: ValveState<T>,
    pub(super) guard: GuardState<T>,
    pub(in crate::learning) evidence: Evidence<T>,
    pub(in crate::learning) checkpoints: Checkpoints<T>,
    pub(in crate::learning) curve: CurveState<T>,
    /// The last standard deviations.
    pub(in crate::learning) deviations: Deviations<T>,
}
integrity!(LearnerState<T>: number, since_checkpoint, since_start, filtered, means_go_on, means, mean_share, share, filters, flows, gate, flow, valve, guard, evidence, checkpoints, curve, deviations);

/// Means and changes over the last whole window.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct Means<T> {
    pub(super) velocity: T,
    pub(super) force: T,
    pub(super) spool: T,
    pub(super) valve_command: T,
    pub(super) command: T,
    pub(super) command_change: T,
    /// Flow (m³/s) that follows from the force: leakage and compression of the oil.
    pub(super) compressed: T,
}
integrity!(Means<T>: velocity, force, spool, valve_command, command, command_change, compressed);

/// The largest possible sums of the magnitudes of a window's means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::learning) struct Largest<T> {
    /// Flow (m³/s).
    pub(in crate::learning) flow: T,
    /// Force (N).
    pub(in crate::learning) force: T,
    /// Opening (1).
    pub(in crate::learning) opening: T,
}
integrity!(Largest<T>: flow, force, opening);

/// The signals' filters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct Filters<T> {
    pub(super) asked: BandState<T>,
    pub(super) spool: BandState<T>,
    pub(super) predicted: BandState<T>,
    pub(super) flow: BandState<T>,
}
integrity!(Filters<T>: asked, spool, predicted, flow);

impl<T: Real> LearnerState<T> {
    /// An integrity word over every number of the state. Compare the word after one update with that before the next.
    ///
    /// # Cost
    /// As [`Channel::integrity`](crate::Channel::integrity).
    pub fn integrity(&self) -> u32 {
        word(self)
    }
}
