//! The classical fourth-order Runge–Kutta step, the only one of this crate.

use crate::lanes::Num;

/// Equations of motion, `ẋ = f(x, t)`.
// A trait and not a closure: a closure that is called four times is not inlined, and loses the processor's instructions.
pub(crate) trait Equations<S> {
    /// Writes the rate of a state at a time (s).
    fn rate(&mut self, state: &[S], time: S, rate: &mut [S]);
}

/// The stages of a step, made once a test; `X` holds as many numbers as the state.
#[derive(Debug, Clone)]
pub(crate) struct Stages<X> {
    at: X,
    rates: [X; 4],
}

impl<X: Clone> Stages<X> {
    /// For states like this one.
    pub(crate) fn new(like: &X) -> Self {
        Self { at: like.clone(), rates: std::array::from_fn(|_| like.clone()) }
    }
}

/// Takes `state` from a time `start` (s) to a time `step` (s) later.
///
/// Kinks of the equations inside the step are stepped over: they bound the order locally.
#[inline(always)]
pub(crate) fn runge_kutta<S: Num, X: AsRef<[S]> + AsMut<[S]>>(
    state: &mut [S],
    stages: &mut Stages<X>,
    start: f64,
    step: f64,
    equations: &mut impl Equations<S>,
) {
    let at = stages.at.as_mut();
    let [k1, k2, k3, k4] = stages.rates.each_mut().map(X::as_mut);
    let (half, middle) = (S::splat(step / 2.0), S::splat(start + step / 2.0));
    equations.rate(state, S::splat(start), k1);
    set_after(at, state, k1, half);
    equations.rate(at, middle, k2);
    set_after(at, state, k2, half);
    equations.rate(at, middle, k3);
    set_after(at, state, k3, S::splat(step));
    equations.rate(at, S::splat(start + step), k4);
    let (sixth, two) = (S::splat(step / 6.0), S::splat(2.0));
    for (((x, k1), k2), (k3, k4)) in state.iter_mut().zip(k1).zip(k2).zip(k3.iter().zip(k4)) {
        let rates = (*k1 + *k4) + two * (*k2 + *k3);
        *x = *x + rates * sixth;
    }
}

/// `at` becomes `state + rate·step`.
#[inline(always)]
fn set_after<S: Num>(at: &mut [S], state: &[S], rate: &[S], step: S) {
    for ((at, x), rate) in at.iter_mut().zip(state).zip(rate) {
        *at = *x + *rate * step;
    }
}
