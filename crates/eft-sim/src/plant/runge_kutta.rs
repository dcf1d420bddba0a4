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
#[expect(
    clippy::manual_memcpy,
    reason = "copies and zipped iterators are calls in builds without optimization across units"
)]
pub(crate) fn runge_kutta<S: Num, X: AsRef<[S]> + AsMut<[S]>>(
    state: &mut [S],
    stages: &mut Stages<X>,
    start: f64,
    step: f64,
    equations: &mut impl Equations<S>,
) {
    let numbers = state.len();
    let Stages { at, rates } = stages;
    // The equations are called in one place only, so that their long code is compiled once.
    for stage in 0..4 {
        let ahead = match stage {
            0 => 0.0,
            1 | 2 => step / 2.0,
            _ => step,
        };
        let at = &mut at.as_mut()[..numbers];
        match stage {
            0 => {
                for i in 0..numbers {
                    at[i] = state[i];
                }
            }
            _ => {
                let (last, ahead) = (&rates[stage - 1].as_ref()[..numbers], S::splat(ahead));
                for i in 0..numbers {
                    at[i] = state[i] + last[i] * ahead;
                }
            }
        }
        equations.rate(at, S::splat(start + ahead), rates[stage].as_mut());
    }
    let [k1, k2, k3, k4] = rates;
    let (k1, k2) = (&k1.as_ref()[..numbers], &k2.as_ref()[..numbers]);
    let (k3, k4) = (&k3.as_ref()[..numbers], &k4.as_ref()[..numbers]);
    let (sixth, two) = (S::splat(step / 6.0), S::splat(2.0));
    for i in 0..numbers {
        let rates = (k1[i] + k4[i]) + two * (k2[i] + k3[i]);
        state[i] = state[i] + rates * sixth;
    }
}
