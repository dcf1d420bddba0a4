//! Traces of the learner. Its estimates change once a window, so a test keeps their changes and no samples.

use std::iter;

use crate::closed_loop::Estimates;

/// The estimates of a test, each with the tick from which the controller used it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct EstimateHistory {
    changes: Vec<(usize, Estimates<f64>)>,
}

impl EstimateHistory {
    /// Adds the estimates from a tick on, unless they are the last ones.
    pub(crate) fn add(&mut self, tick: usize, estimates: Estimates<f64>) {
        if self.last().is_none_or(|last| !last.same_bits(&estimates)) {
            self.changes.push((tick, estimates));
        }
    }

    pub(crate) fn last(&self) -> Option<&Estimates<f64>> {
        self.changes.last().map(|(_, estimates)| estimates)
    }

    /// The trace of one estimate over this number of ticks.
    pub(crate) fn trace(&self, field: fn(&Estimates<f64>) -> f64, ticks: usize) -> HeldTrace<'_> {
        HeldTrace { changes: &self.changes, field, ticks }
    }
}

/// A trace whose values hold for some ticks each. It is empty if the rig does not learn.
#[derive(Debug, Clone, Copy)]
pub struct HeldTrace<'a> {
    changes: &'a [(usize, Estimates<f64>)],
    field: fn(&Estimates<f64>) -> f64,
    ticks: usize,
}

impl HeldTrace<'_> {
    /// The ticks from which the [`values`](Self::values) hold; the first is 0.
    pub fn starts(&self) -> Vec<usize> {
        self.changes.iter().map(|(tick, _)| *tick).collect()
    }

    /// The values, one for each start.
    pub fn values(&self) -> Vec<f64> {
        self.changes.iter().map(|(_, estimates)| (self.field)(estimates)).collect()
    }

    /// The value at a tick.
    ///
    /// # Panics
    /// The trace has no such tick.
    pub fn at(&self, tick: usize) -> f64 {
        assert!(tick < self.len(), "tick {tick} of {}", self.len());
        (self.field)(&self.changes[self.changes.partition_point(|(start, _)| *start <= tick) - 1].1)
    }

    /// The value at the last tick; `None` if the rig does not learn.
    pub fn last(&self) -> Option<f64> {
        self.changes.last().map(|(_, estimates)| (self.field)(estimates))
    }

    /// One value for each tick.
    pub fn samples(&self) -> Vec<f64> {
        let ends = self.changes.iter().skip(1).map(|(start, _)| *start).chain([self.ticks]);
        let each = self.changes.iter().zip(ends);
        each.flat_map(|((start, now), end)| iter::repeat_n((self.field)(now), end - start)).collect()
    }

    /// Number of ticks; 0 if the rig does not learn.
    pub fn len(&self) -> usize {
        if self.changes.is_empty() { 0 } else { self.ticks }
    }

    /// Whether the rig does not learn.
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }
}
