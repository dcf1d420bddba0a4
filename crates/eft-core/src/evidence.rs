//! What the estimators have taken in, and what of it to go back to when the latest turns out to be wrong.
//!
//! A sensor that fails is noticed only when the models have missed its signal for some windows, and these count until
//! then. So evidence is put by from time to time, and when the estimators cease to explain what is measured the older
//! of the last two stands again.

use crate::scalar::{Mask, Scalar};

/// Sums over the windows that count, older ones less than newer ones.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct Evidence<S> {
    /// For the flow gain: instrument × predicted flow, and × what the flow has more.
    pub(crate) predicted: S,
    pub(crate) excess: S,
    /// For the valve: squares and product of opening and change, and of either with what the model misses.
    pub(crate) openings: S,
    pub(crate) crossed: S,
    pub(crate) changes: S,
    pub(crate) on_opening: S,
    pub(crate) on_change: S,
    /// All of it (s, of squared opening × time).
    pub(crate) amount: S,
}

impl<S: Scalar> Default for Evidence<S> {
    fn default() -> Self {
        let zero = S::splat(0.0);
        Self {
            predicted: zero,
            excess: zero,
            openings: zero,
            crossed: zero,
            changes: zero,
            on_opening: zero,
            on_change: zero,
            amount: zero,
        }
    }
}

impl<S: Scalar> Evidence<S> {
    /// Takes over another's where the mask is true.
    #[inline(always)]
    fn take_over(&mut self, from: &Self, at: S::Mask) {
        if at.all() {
            *self = *from;
            return;
        }
        let take = |to: &mut S, from: S| *to = S::select(at, from, *to);
        take(&mut self.predicted, from.predicted);
        take(&mut self.excess, from.excess);
        take(&mut self.openings, from.openings);
        take(&mut self.crossed, from.crossed);
        take(&mut self.changes, from.changes);
        take(&mut self.on_opening, from.on_opening);
        take(&mut self.on_change, from.on_change);
        take(&mut self.amount, from.amount);
    }
}

/// The last two that were put by.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub(crate) struct Proof<S: Scalar> {
    older: Evidence<S>,
    newer: Evidence<S>,
}

impl<S: Scalar> Proof<S> {
    /// Puts by what there is, where nothing speaks against it.
    #[inline(always)]
    pub(crate) fn put_by(&mut self, evidence: &Evidence<S>, sound: S::Mask) {
        if sound.any() {
            self.older.take_over(&self.newer, sound);
            self.newer.take_over(evidence, sound);
        }
    }

    /// Goes back to what was put by.
    #[inline(always)]
    pub(crate) fn go_back(&mut self, evidence: &mut Evidence<S>, at: S::Mask) {
        if at.any() {
            evidence.take_over(&self.older, at);
            self.newer.take_over(&self.older, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_by_last_but_one_stands_again() {
        let of = |amount: f64| Evidence { amount, excess: -amount, ..Evidence::default() };
        let mut proof = Proof::default();
        for amount in [1.0, 2.0, 3.0] {
            proof.put_by(&of(amount), true);
        }
        proof.put_by(&of(4.0), false);
        let mut now = of(5.0);
        proof.go_back(&mut now, false);
        assert_eq!(now, of(5.0));
        proof.go_back(&mut now, true);
        assert_eq!(now, of(2.0));
        // And what was doubtful is gone for good.
        proof.put_by(&of(6.0), true);
        proof.go_back(&mut now, true);
        assert_eq!(now, of(2.0));
    }
}
