//! The evidence of the estimators, and its checkpoints for a rollback.
//!
//! A failed sensor is noticed only after some windows, whose evidence is accepted. The learner therefore makes
//! checkpoints at intervals. When the models no longer explain the measurements, it restores the older of the last two.

use crate::integrity::integrity;
use crate::learning::flow_curve::CurveEvidence;
use crate::learning::least_squares::LeastSquares;

/// Sums over the accepted windows; older ones have a smaller weight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Evidence<T> {
    /// Sums of the flow and of the spool.
    pub(crate) flow: LeastSquares<T>,
    pub(crate) valve: LeastSquares<T>,
    /// Total evidence (s, of squared opening × time).
    pub(crate) amount: T,
    /// The same sum with the squared shares of the older windows, for the scatter of a sum with forgetting.
    pub(crate) newer_openings: T,
    /// Duration (s) of the accepted windows, and sums of the squared residuals of the flow and of the spool.
    pub(crate) time: T,
    pub(crate) flow_errors: T,
    pub(crate) spool_errors: T,
    /// Sum of the squares of the flow (m³/s) that compressed the oil, with the weights of the commanded opening.
    pub(crate) compressed: T,
    /// Sums for the flow curve.
    pub(crate) curve: CurveEvidence<T>,
}
integrity!(Evidence<T>: flow, valve, amount, newer_openings, time, flow_errors, spool_errors, compressed, curve);

/// The last two checkpoints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Checkpoints<T> {
    first: Evidence<T>,
    second: Evidence<T>,
    /// Whether the first is the newer one.
    first_is_newer: bool,
}
integrity!(Checkpoints<T>: first, second, first_is_newer);

impl<T: Copy> Checkpoints<T> {
    /// Two checkpoints of the same evidence.
    pub(crate) fn of(evidence: &Evidence<T>) -> Self {
        Self { first: *evidence, second: *evidence, first_is_newer: false }
    }

    /// Makes a checkpoint, in place of the older one.
    pub(crate) fn save(&mut self, evidence: &Evidence<T>) {
        let older = if self.first_is_newer { &mut self.second } else { &mut self.first };
        *older = *evidence;
        self.first_is_newer = !self.first_is_newer;
    }

    /// Restores the older one, which replaces both.
    pub(crate) fn restore(&mut self, evidence: &mut Evidence<T>) {
        let Self { first, second, first_is_newer } = self;
        let (older, newer) = if *first_is_newer { (second, first) } else { (first, second) };
        *evidence = *older;
        *newer = *older;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_but_one_is_restored_for_good() {
        let of = |amount: f64| Evidence { amount, time: -amount, ..Evidence::default() };
        let mut checkpoints = Checkpoints::default();
        for amount in [1.0, 2.0, 3.0] {
            checkpoints.save(&of(amount));
        }
        let mut now = of(5.0);
        checkpoints.restore(&mut now);
        assert_eq!(now, of(2.0));
        checkpoints.save(&of(6.0));
        checkpoints.restore(&mut now);
        assert_eq!(now, of(2.0));
    }
}
