//! The classical fourth-order Runge–Kutta step, for any state that can be added and scaled.

use crate::rig::Num;

/// A state whose numbers can be taken pair by pair.
pub(crate) trait Vector<S>: Copy {
    /// `f` of each pair of numbers.
    fn zip(self, other: Self, f: impl Fn(S, S) -> S) -> Self;
}

/// The state a time `step` (s) after `start` (s); `rate` gives the state's rate at a state and a time (s).
#[inline(always)]
pub(crate) fn runge_kutta<S: Num, X: Vector<S>>(
    state: X,
    start: f64,
    step: f64,
    rate: impl Fn(&X, S) -> X,
) -> X {
    let (h, half, sixth) = (S::splat(step), S::splat(step / 2.0), S::splat(step / 6.0));
    let two = S::splat(2.0);
    let after = |rate: X, time: S| state.zip(rate, |x, r| x + r * time);
    let middle = S::splat(start + step / 2.0);
    let k1 = rate(&state, S::splat(start));
    let k2 = rate(&after(k1, half), middle);
    let k3 = rate(&after(k2, half), middle);
    let k4 = rate(&after(k3, h), S::splat(start + step));
    let between = k2.zip(k3, |a, b| a + b);
    let sum = k1.zip(k4, |a, b| a + b).zip(between, |ends, between| ends + two * between);
    after(sum, sixth)
}
