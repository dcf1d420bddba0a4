//! The exact step of a structure in linear motion, under forces that are linear in time.

use nalgebra::DMatrix;

use crate::state_space::matrices::exponential;

/// Angle or decay (1) within a step beyond which the exponential has too few correct digits.
const LONGEST: f64 = 1e6;
/// Displacement, velocity and hysteresis of a floor.
const PER_FLOOR: usize = 3;

/// Effect of one step on the state of all floors.
#[derive(Debug)]
pub(super) struct LinearMotion<X> {
    /// For each number of the state.
    state: Vec<X>,
    /// Of each floor: for the force (N) at the start of the step, and for its growth (N) over the step.
    forces: Vec<[X; 2]>,
    /// Drift (m) up to which the motion is linear.
    limit: f64,
}

impl<X: Clone + AsRef<[f64]> + AsMut<[f64]>> LinearMotion<X> {
    /// For steps of `step` s. `limit` is the drift (m) up to which the motion is linear; only that of a single
    /// floor is finite. `rate(state, floor)` returns the rates of a state under 1 N on one floor or on none.
    /// `None` without linear motion, or if the structure is too stiff for the step.
    pub(super) fn new(
        template: &X,
        step: f64,
        limit: f64,
        rate: impl Fn(&[f64], Option<usize>) -> Vec<f64>,
    ) -> Option<Self> {
        let states = template.as_ref().len();
        let floors = states / PER_FLOOR;
        let whole = transition(states, step, limit, &rate)?;
        let column = |n: usize| {
            let mut column = template.clone();
            column.as_mut().copy_from_slice(&whole.as_slice()[n * whole.nrows()..][..states]);
            column
        };
        Some(Self {
            state: (0..states).map(column).collect(),
            forces: (0..floors)
                .map(|floor| [column(states + floor), column(states + floors + floor)])
                .collect(),
            limit,
        })
    }

    /// Writes the state one step later, under forces (N) with their growth (N) over the step. Returns whether
    /// the motion was linear at both ends.
    #[inline(always)]
    #[expect(
        clippy::needless_range_loop,
        reason = "zipped iterators are calls in builds without optimization across units"
    )]
    pub(super) fn step(&self, state: &X, next: &mut X, force: impl Fn(usize) -> [f64; 2]) -> bool {
        let (state, next) = (state.as_ref(), next.as_mut());
        let states = state.len();
        let next = &mut next[..states];
        for n in 0..states {
            next[n] = 0.0;
        }
        for floor in 0..states / PER_FLOOR {
            let [force, growth] = force(floor);
            let [constant, ramp] = &self.forces[floor];
            let (constant, ramp) = (&constant.as_ref()[..states], &ramp.as_ref()[..states]);
            for n in 0..states {
                next[n] += constant[n] * force + ramp[n] * growth;
            }
        }
        for of in 0..states {
            let (number, column) = (state[of], &self.state[of].as_ref()[..states]);
            for n in 0..states {
                next[n] += column[n] * number;
            }
        }
        state[0].abs() <= self.limit && next[0].abs() <= self.limit
    }
}

/// The rates of a state under 1 N on one floor or on none.
type Rates<'a> = dyn Fn(&[f64], Option<usize>) -> Vec<f64> + 'a;

/// The state one step later in its first rows, by the state, the forces (N) of the floors and their growth (N) over the
/// step.
// Compiled once for all kinds of states.
fn transition(states: usize, step: f64, limit: f64, rate: &Rates<'_>) -> Option<DMatrix<f64>> {
    if limit == 0.0 {
        return None;
    }
    let floors = states / PER_FLOOR;
    // Within the straight part of the spring.
    let unit = 0.5 * limit.min(1.0);
    let mut whole = DMatrix::zeros(states + 2 * floors, states + 2 * floors);
    let mut at = vec![0.0; states];
    for column in 0..states {
        at[column] = unit;
        for (row, rate) in rate(&at, None).into_iter().map(|rate| rate / unit).enumerate() {
            whole[(row, column)] = rate * step;
            // The acceleration per displacement is the square of a frequency.
            let square = column.is_multiple_of(PER_FLOOR);
            let size = if square { rate.abs().sqrt() } else { rate.abs() };
            if size * step > LONGEST {
                return None;
            }
        }
        at[column] = 0.0;
    }
    // In units of the acceleration per force, because the exponential needs numbers of similar size.
    let mut sizes = Vec::with_capacity(floors);
    for floor in 0..floors {
        let pushed = rate(&at, Some(floor));
        let size = pushed.iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
        for (row, rate) in pushed.into_iter().enumerate() {
            whole[(row, states + floor)] = rate / size * step;
        }
        whole[(states + floor, states + floors + floor)] = 1.0;
        sizes.push(size);
    }
    let mut whole = exponential(&whole);
    for (floor, size) in sizes.into_iter().enumerate() {
        for column in [states + floor, states + floors + floor] {
            whole.column_mut(column).iter_mut().for_each(|number| *number *= size);
        }
    }
    Some(whole)
}
