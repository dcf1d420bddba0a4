//! The classical fourth-order Runge–Kutta step, the only one of this crate.

use crate::lanes::Num;

/// Equations of motion, `ẋ = f(x, t)`.
pub(crate) trait Equations<S> {
    /// Writes the rate of a state at a time (s).
    fn rate(&mut self, state: &[S], time: S, rate: &mut [S]);
}

/// The stages of a step, allocated once per test; `X` has as many numbers as the state.
#[derive(Debug, Clone)]
pub(crate) struct Stages<X> {
    at: X,
    rates: [X; 4],
}

impl<X: Clone> Stages<X> {
    /// Stages for states like this one.
    pub(crate) fn new(like: &X) -> Self {
        Self { at: like.clone(), rates: std::array::from_fn(|_| like.clone()) }
    }
}

/// Advances `state` from a time `start` (s) by `step` (s).
///
/// Kinks of the equations within the step are not located; they reduce the order locally.
#[inline(always)]
pub(crate) fn runge_kutta<S: Num, X: AsRef<[S]> + AsMut<[S]>>(
    state: &mut [S],
    stages: &mut Stages<X>,
    start: f64,
    step: f64,
    equations: &mut impl Equations<S>,
) {
    let Stages { at, rates } = stages;
    let at = at.as_mut();
    // The equations are called in one place only, so that their long code is compiled once.
    for (stage, ahead) in [0.0, step / 2.0, step / 2.0, step].into_iter().enumerate() {
        at.copy_from_slice(state);
        if let Some(last) = stage.checked_sub(1) {
            for (at, rate) in at.iter_mut().zip(rates[last].as_ref()) {
                *at = *at + *rate * S::splat(ahead);
            }
        }
        equations.rate(at, S::splat(start + ahead), rates[stage].as_mut());
    }
    let [k1, k2, k3, k4] = rates.each_ref().map(X::as_ref);
    let (sixth, two) = (S::splat(step / 6.0), S::splat(2.0));
    for (((x, k1), k2), (k3, k4)) in state.iter_mut().zip(k1).zip(k2).zip(k3.iter().zip(k4)) {
        let rates = (*k1 + *k4) + two * (*k2 + *k3);
        *x = *x + rates * sixth;
    }
}
