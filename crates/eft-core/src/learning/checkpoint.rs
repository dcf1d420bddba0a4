//! What the estimators have taken in, and the checkpoints to go back to when the latest turns out to be wrong.
//!
//! A sensor that fails is noticed only when the models have missed its signal for some windows, and these count until
//! then. So there is a checkpoint from time to time, and when the models cease to explain what is measured the older of
//! the last two is restored.

use crate::integrity::integrity;
use crate::learning::flow_curve::CurveEvidence;
use crate::learning::least_squares::LeastSquares;

/// Sums over the windows that count, older ones less than newer ones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Evidence<T> {
    /// Of the flow, and of the spool.
    pub(crate) flow: LeastSquares<T>,
    pub(crate) valve: LeastSquares<T>,
    /// All of it (s, of squared opening × time).
    pub(crate) amount: T,
    /// As the squares of the asked opening, with the squares of the shares by which older ones are kept.
    pub(crate) newer_openings: T,
    /// Its time (s), and the squares of what the models missed of the flow and of the spool.
    pub(crate) time: T,
    pub(crate) flow_errors: T,
    pub(crate) spool_errors: T,
    /// For the flow curve.
    pub(crate) curve: CurveEvidence<T>,
}
integrity!(Evidence<T>: flow, valve, amount, newer_openings, time, flow_errors, spool_errors, curve);

/// The last two checkpoints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Checkpoints<T> {
    older: Evidence<T>,
    newer: Evidence<T>,
}
integrity!(Checkpoints<T>: older, newer);

impl<T: Copy> Checkpoints<T> {
    /// Both of the same evidence.
    pub(crate) fn of(evidence: &Evidence<T>) -> Self {
        Self { older: *evidence, newer: *evidence }
    }

    /// Makes a checkpoint.
    pub(crate) fn save(&mut self, evidence: &Evidence<T>) {
        self.older = self.newer;
        self.newer = *evidence;
    }

    /// Goes back to the older one, for good.
    pub(crate) fn restore(&mut self, evidence: &mut Evidence<T>) {
        *evidence = self.older;
        self.newer = self.older;
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
