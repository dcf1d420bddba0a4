//! What the estimators have taken in, and what of it to go back to when the latest turns out to be wrong.
//!
//! A sensor that fails is noticed only when the models have missed its signal for some windows, and these count until
//! then. So what was learned is put by from time to time, and when the estimators cease to explain what is measured the
//! older of the last two stands again.

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

/// What can be put by, and stand again, lane by lane.
pub(crate) trait Learned: Copy {
    /// One truth value per lane.
    type Mask: Mask;
    /// Takes over another's where the mask is true.
    fn take_over(&mut self, from: &Self, at: Self::Mask);
}

impl<S: Scalar> Learned for S {
    type Mask = S::Mask;
    #[inline(always)]
    fn take_over(&mut self, from: &Self, at: S::Mask) {
        *self = S::select(at, *from, *self);
    }
}

impl<S: Scalar> Learned for Evidence<S> {
    type Mask = S::Mask;
    #[inline(always)]
    fn take_over(&mut self, from: &Self, at: S::Mask) {
        if at.all() {
            *self = *from;
            return;
        }
        self.predicted.take_over(&from.predicted, at);
        self.excess.take_over(&from.excess, at);
        self.openings.take_over(&from.openings, at);
        self.crossed.take_over(&from.crossed, at);
        self.changes.take_over(&from.changes, at);
        self.on_opening.take_over(&from.on_opening, at);
        self.on_change.take_over(&from.on_change, at);
        self.amount.take_over(&from.amount, at);
    }
}

/// The last two that were put by.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub(crate) struct Proof<T> {
    older: T,
    newer: T,
}

impl<T: Learned> Proof<T> {
    /// Puts by what there is, where nothing speaks against it.
    #[inline(always)]
    pub(crate) fn put_by(&mut self, learned: &T, sound: T::Mask) {
        if sound.any() {
            self.older.take_over(&self.newer, sound);
            self.newer.take_over(learned, sound);
        }
    }

    /// Goes back to what was put by.
    #[inline(always)]
    pub(crate) fn go_back(&mut self, learned: &mut T, at: T::Mask) {
        if at.any() {
            learned.take_over(&self.older, at);
            self.newer.take_over(&self.older, at);
        }
    }
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, clippy::float_cmp, reason = "tests")]
mod tests {
    use super::*;
    use crate::lanes::Lanes;

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

    #[test]
    fn lanes_put_by_and_go_back_apart() {
        type Wide = Lanes<f64, 2>;
        let (mut alone, mut together) =
            ([Proof::<Evidence<f64>>::default(); 2], Proof::<Evidence<Wide>>::default());
        let (mut now, mut both) = ([Evidence::default(); 2], Evidence::<Wide>::default());
        // Every choice of who puts by and who goes back, after every other.
        for n in 0..256_u32 {
            let amounts = [f64::from(n), -f64::from(n)];
            for choice in [n & 15, n >> 4] {
                let chosen = |bit: u32| choice >> bit & 1 == 1;
                let mask = |bit: u32| {
                    Wide::from_lanes(|lane| f64::from(choice >> (bit + lane as u32) & 1)).gt(Wide::splat(0.0))
                };
                for lane in 0..2 {
                    now[lane].amount = amounts[lane];
                    alone[lane].go_back(&mut now[lane], chosen(2 + lane as u32));
                    alone[lane].put_by(&now[lane], chosen(lane as u32));
                }
                both.amount = Wide::from_lanes(|lane| amounts[lane]);
                together.go_back(&mut both, mask(2));
                together.put_by(&both, mask(0));
                assert_eq!(
                    [0, 1].map(|lane| both.amount.lane(lane)),
                    now.map(|one| one.amount),
                    "{n} {choice}"
                );
            }
        }
    }
}
