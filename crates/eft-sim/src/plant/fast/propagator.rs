//! The exact step of the plant's linear part, by matrix exponentials computed once per test.
//!
//! Between samples the plant is `u̇ = L·u + b_v·w(t) + b_q·Q_L(u) + b_r·r(u)`: a constant matrix, the valve's
//! demand `w`, which is linear in time, and the two nonlinear terms, load flow and softening of the spring.
//! `L` and the `b` are computed from the plant's own equations with unit vectors, so the equations exist only
//! once.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{SMatrix, SVector};

use crate::lanes::Num;
use crate::plant::fast::plain::{PlainPlant, Terms};
use crate::plant::{ActuatorState, Drive, STATES};

/// State, and an input with its rate and half its second derivative.
const AUGMENTED: usize = STATES + 3;

/// Effect of one step on the state, per unit of each input.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Propagator<S> {
    /// For each number of the state.
    pub(crate) state: [ActuatorState<S>; STATES],
    /// For the valve's demand (V).
    pub(crate) demand: Moments<S>,
    /// For the load flow (m³/s).
    pub(crate) flow: Moments<S>,
    /// For the softening force (N).
    pub(crate) softening: Moments<S>,
}

/// Effect of an input on the state in one step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments<S> {
    /// For an input that is constant over the step.
    pub(crate) constant: ActuatorState<S>,
    /// For an input that grows from zero to one over the step.
    pub(crate) ramp: ActuatorState<S>,
    /// For the difference between a parabola through three values and the line through the first two. The
    /// unit is the distance of the third value from that line.
    pub(crate) bend: ActuatorState<S>,
}

impl<S: Num> Propagator<S> {
    /// Propagators of single rigs side by side.
    pub(crate) fn pack<'a>(lane: impl Fn(usize) -> &'a Propagator<f64>) -> Self {
        let pack = |part: &dyn Fn(&Propagator<f64>) -> ActuatorState<f64>| {
            ActuatorState::from_array(std::array::from_fn(|n| S::from_lanes(|i| part(lane(i)).to_array()[n])))
        };
        let moments = |of: fn(&Propagator<f64>) -> &Moments<f64>| Moments {
            constant: pack(&|lane| of(lane).constant),
            ramp: pack(&|lane| of(lane).ramp),
            bend: pack(&|lane| of(lane).bend),
        };
        Self {
            state: std::array::from_fn(|n| pack(&|lane| lane.state[n])),
            demand: moments(|lane| &lane.demand),
            flow: moments(|lane| &lane.flow),
            softening: moments(|lane| &lane.softening),
        }
    }
}

impl Propagator<f64> {
    /// The propagator for steps of `step` s of a plant under a drive. Only the drive's dependence on the
    /// force matters.
    pub(crate) fn new(plant: &PlainPlant<f64>, drive: &impl Drive<f64>, step: f64) -> Self {
        let at_rest = ActuatorState::default();
        let none = Terms { flow: 0.0, softening: 0.0 };
        let rate = |state: &ActuatorState<f64>, terms: &Terms<f64>, command: f64| {
            let command = plant.driven_demand(state, terms.flow, drive, 0.0) + command;
            SVector::from(plant.rate_under(state, terms, command).to_array())
        };
        let mut linear = SMatrix::<f64, STATES, STATES>::zeros();
        for n in 0..STATES {
            // Half a unit, so that the spool reaches no stop.
            let state = ActuatorState::from_array(std::array::from_fn(|i| if i == n { 0.5 } else { 0.0 }));
            linear.set_column(n, &(2.0 * rate(&state, &none, 0.0)));
        }
        // Pressures are in the millions and pilot flows in the millionths, and the exponential needs numbers
        // of similar size.
        let scale = balance_parlett_reinsch(&mut linear);
        let moments = |input: SVector<f64, STATES>| Moments::new(&linear, &scale, input, step);
        let (demand, whole) = moments(rate(&at_rest, &none, 1.0));
        let unscaled = SMatrix::from_diagonal(&scale)
            * whole.fixed_view::<STATES, STATES>(0, 0)
            * SMatrix::from_diagonal(&scale.map(f64::recip));
        Self {
            state: std::array::from_fn(|n| ActuatorState::from_array(unscaled.column(n).into_owned().into())),
            demand,
            flow: moments(rate(&at_rest, &Terms { flow: 1.0, ..none }, 0.0)).0,
            softening: moments(rate(&at_rest, &Terms { softening: 1.0, ..none }, 0.0)).0,
        }
    }
}

impl Moments<f64> {
    /// From the exponential of `[[L, b, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]]`, with time in
    /// steps. Its last columns are the integrals of `b`, `b·s` and `b·s²/2` with the propagator. The
    /// exponential itself is returned as well.
    fn new(
        linear: &SMatrix<f64, STATES, STATES>,
        scale: &SVector<f64, STATES>,
        input: SVector<f64, STATES>,
        step: f64,
    ) -> (Self, SMatrix<f64, AUGMENTED, AUGMENTED>) {
        let scaled = input.component_div(scale);
        let size = scaled.amax();
        let mut whole = SMatrix::<f64, AUGMENTED, AUGMENTED>::zeros();
        whole.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&(linear * step));
        whole.fixed_view_mut::<STATES, 1>(0, STATES).copy_from(&(scaled * (step / size)));
        for k in STATES..AUGMENTED - 1 {
            whole[(k, k + 1)] = 1.0;
        }
        let whole = whole.exp();
        let column = |n: usize| {
            let column = whole.fixed_view::<STATES, 1>(0, STATES + n).component_mul(scale) * size;
            ActuatorState::from_array(column.into())
        };
        let (constant, ramp, parabola) = (column(0), column(1), column(2));
        // Through (−1, 0), (0, 0) and (1, 1): s/2 + s²/2.
        let bend = ramp.zip(parabola, |ramp, parabola| 0.5 * ramp + parabola);
        (Self { constant, ramp, bend }, whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::RigConfig;
    use crate::plant::drive::Analog;
    use crate::plant::runge_kutta::{Equations, Stages, runge_kutta};

    #[test]
    fn one_step_gives_the_result_of_many_small_ones() {
        let rig = RigConfig::zhao2005();
        let plant = PlainPlant::<f64>::pack(&|_| &rig).unwrap();
        let drive = Analog::<f64>::pack(&|_| &rig);
        let step = 1.0 / 1024.0;
        let propagator = Propagator::new(&plant, &drive, step);
        let start = ActuatorState {
            pilot_flow: 2e-6,
            spool: 0.2,
            load_pressure: 1e6,
            displacement: 0.01,
            velocity: 0.3,
        };
        let (demand, growth) = (0.3, 0.7);
        let flow = [4e-3, 5e-4, -3e-4];
        let softening = [3e3, 1e2, 2e2];
        // The input of the moments at a time in steps.
        let course =
            |[constant, ramp, bend]: [f64; 3], t: f64| constant + ramp * t + bend * (t + t * t) / 2.0;

        let mut exact = ActuatorState::default();
        for (number, column) in start.to_array().into_iter().zip(&propagator.state) {
            exact = exact.plus(*column, number);
        }
        for (moments, parts) in [
            (&propagator.demand, [demand, growth, 0.0]),
            (&propagator.flow, flow),
            (&propagator.softening, softening),
        ] {
            exact = exact
                .plus(moments.constant, parts[0])
                .plus(moments.ramp, parts[1])
                .plus(moments.bend, parts[2]);
        }

        struct Linear<'a, F, G> {
            plant: &'a PlainPlant<f64>,
            drive: &'a Analog<f64>,
            terms: F,
            demand: G,
        }
        impl<F: Fn(f64) -> Terms<f64>, G: Fn(f64) -> f64> Equations<f64> for Linear<'_, F, G> {
            fn rate(&mut self, state: &[f64], time: f64, rate: &mut [f64]) {
                let (state, terms) = (ActuatorState::from_slice(state), (self.terms)(time));
                let command =
                    self.plant.driven_demand(&state, terms.flow, self.drive, 0.0) + (self.demand)(time);
                let all = self.plant.rate_under(&state, &terms, command);
                rate.copy_from_slice(&all.to_array());
            }
        }
        let mut equations = Linear {
            plant: &plant,
            drive: &drive,
            terms: |t| Terms { flow: course(flow, t / step), softening: course(softening, t / step) },
            demand: |t| demand + growth * t / step,
        };
        let small = step / 200.0;
        let mut state = start.to_array();
        let mut stages = Stages::new(&state);
        for n in 0..200 {
            runge_kutta(&mut state, &mut stages, f64::from(n) * small, small, &mut equations);
        }
        for (got, expected) in exact.to_array().into_iter().zip(state) {
            assert!((got / expected - 1.0).abs() < 1e-10, "{exact:?}, {state:?}");
        }
    }
}
