//! The variable part of an instance.

use serde::{Deserialize, Serialize};

use crate::model::State;

/// The phase of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Phase {
    Instantiated,
    Initializing,
    Stepping,
    Terminated,
}

/// The variable part of an instance.
#[derive(Serialize, Deserialize)]
pub(crate) struct Snapshot {
    pub(super) phase: Phase,
    pub(super) ticks: u64,
    pub(super) start: f64,
    pub(super) values: Vec<f64>,
    pub(super) model: Option<State>,
}
