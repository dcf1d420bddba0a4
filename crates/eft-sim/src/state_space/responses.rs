//! The response of a linear model at many frequencies.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, Hessenberg};

use super::StateSpace;

/// Some inputs and outputs of a model in Hessenberg form, which makes a frequency's cost proportional to the square
/// of the number of states instead of the cube.
#[derive(Debug)]
pub(crate) struct Responses {
    a: DMatrix<f64>,
    b: DMatrix<Complex<f64>>,
    c: DMatrix<Complex<f64>>,
    d: DMatrix<Complex<f64>>,
}

impl Responses {
    /// The outputs and the inputs with these indices.
    pub(crate) fn new(model: &StateSpace, outputs: &[usize], inputs: &[usize]) -> Self {
        let mut a = model.a.clone();
        let scale = balance_parlett_reinsch(&mut a);
        let (q, a) = Hessenberg::new(a).unpack();
        let complex = |matrix: DMatrix<f64>| matrix.map(|entry| Complex::new(entry, 0.0));
        let b = DMatrix::from_diagonal(&scale.map(f64::recip)) * model.b.select_columns(inputs);
        let c = model.c.select_rows(outputs) * DMatrix::from_diagonal(&scale);
        let d = model.d.select_rows(outputs).select_columns(inputs);
        Self { a, b: complex(q.transpose() * b), c: complex(c * q), d: complex(d) }
    }

    /// The outputs (rows) per input (columns) at a variable, `iω` or `exp(iωT)`; `None` on a pole.
    pub(crate) fn at(&self, variable: Complex<f64>) -> Option<DMatrix<Complex<f64>>> {
        let n = self.a.nrows();
        let mut system = self.a.map(|entry| Complex::new(-entry, 0.0));
        for i in 0..n {
            system[(i, i)] += variable;
        }
        let mut states = self.b.clone();
        for k in 1..n {
            if system[(k, k - 1)].norm_sqr() > system[(k - 1, k - 1)].norm_sqr() {
                system.swap_rows(k, k - 1);
                states.swap_rows(k, k - 1);
            }
            let below = system[(k, k - 1)];
            if below == Complex::ZERO {
                continue;
            }
            let factor = below / system[(k - 1, k - 1)];
            for column in k - 1..n {
                let above = system[(k - 1, column)];
                system[(k, column)] -= factor * above;
            }
            for column in 0..states.ncols() {
                let above = states[(k - 1, column)];
                states[(k, column)] -= factor * above;
            }
        }
        system.solve_upper_triangular_mut(&mut states).then(|| &self.c * states + &self.d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::linear::{FlowGain, Time, linearize};
    use crate::config::RigConfig;

    #[test]
    fn every_response_is_that_of_the_full_system() {
        let building = |stories: usize| {
            RigConfig::zhao2005()
                .replace(&[
                    ("structure.kind", "shear_building".into()),
                    ("structure.stories.masses", vec![7e3; stories].into()),
                    ("structure.stories.dampings", vec![2e3; stories].into()),
                    ("structure.stories.stiffnesses", vec![9e6; stories].into()),
                    ("compensation.computation_delay", 3.into()),
                    ("truth.sensors.velocity.delay", 5.into()),
                ])
                .unwrap()
        };
        let off = RigConfig::zhao2005().replace(&[("compensation.mode", "off".into())]).unwrap();
        for rig in [RigConfig::zhao2005(), off, building(1), building(4)] {
            let model = linearize(&rig, FlowGain::Mean, Time::Sampled(4096.0)).unwrap();
            let outputs: Vec<usize> = (0..model.outputs.len()).collect();
            // In another order than that of the model.
            let inputs: Vec<usize> = (0..model.inputs.len()).rev().collect();
            let responses = Responses::new(&model, &outputs, &inputs);
            for frequency in [0.1, 0.3, 1.7, 12.0, 60.0] {
                let turn = std::f64::consts::TAU * frequency / 4096.0;
                let found = responses.at(Complex::from_polar(1.0, turn)).unwrap();
                for (row, output) in model.outputs.iter().enumerate() {
                    for (column, input) in inputs.iter().enumerate() {
                        let full = model.response_to(&model.inputs[*input], output, frequency).unwrap();
                        let error = (found[(row, column)] - full).norm();
                        let largest = found.row(row).iter().map(|one| one.norm()).fold(0.0, f64::max);
                        assert!(error <= 1e-7 * largest, "{output} {input} {frequency}: {error:e} of {full}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_pole_has_no_response() {
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        let model = StateSpace {
            a: one(-2.0),
            b: one(1.0),
            c: one(1.0),
            d: one(0.0),
            states: vec!["x".into()],
            inputs: vec!["u".into()],
            outputs: vec!["y".into()],
            left_out: Vec::new(),
            sample_time: None,
        };
        let responses = Responses::new(&model, &[0], &[0]);
        assert!(responses.at(Complex::new(-2.0, 0.0)).is_none());
        assert!(
            (responses.at(Complex::new(0.0, 2.0)).unwrap()[0] - Complex::new(2.0, 2.0).inv()).norm() < 1e-15
        );
    }
}
