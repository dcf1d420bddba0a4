//! Force and displacement about rest that errors of sensors and converters cause: noise, rounding and bias.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use super::disturbance::Disturbance;
use super::gains::FlowGain;
use super::sampled::Ticker;
use crate::metrics::OIL_COLUMN;
use crate::state_space::{Responses, StateSpace, rows_of};
use crate::{Error, Result, RigConfig};

/// Number of frequencies at which the noise in the band of the oil column is computed.
const FREQUENCIES: u32 = 60;

/// Force (N) and displacement (m) about rest of each actuator.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AboutRest {
    /// Standard deviations by white noise in the sensors and by the rounding of the converters, in a test that is
    /// long beside the decay of the motion.
    pub(crate) deviations: Vec<[f64; 2]>,
    /// Standard deviations of the force alone within the band of the oil column; 0 if the sample rate is too low for the whole
    /// band.
    pub(crate) oscillations: Vec<f64>,
    /// Constant parts, each with the key that causes it.
    pub(crate) constants: Vec<(&'static str, Vec<[f64; 2]>)>,
}

/// Force and displacement of a rig's sampled loop about rest.
///
/// # Errors
/// As [`linearize`](super::linearize); an unstable loop.
pub(crate) fn about_rest(rig: &RigConfig, gain: FlowGain, sample_rate: f64) -> Result<AboutRest> {
    let rig = &*rig.at_rate(sample_rate)?;
    let ticker = Ticker::new(rig, gain, sample_rate)?;
    let (a, sources) = ticker.disturbed();
    let unstable =
        || Error::value("stability of the linear model", "unstable", "must be stable for a state about rest");
    let (outputs, names) = ticker.outputs();
    let pairs = rows_of(&names, "force").zip(rows_of(&names, "displacement"));
    let actuators: Vec<[usize; 2]> = pairs.map(|(force, moved)| [force, moved]).collect();

    let mut noise = sources.clone();
    for (column, one) in Disturbance::ALL.iter().cycle().take(noise.ncols()).enumerate() {
        noise.column_mut(column).scale_mut(one.deviation(rig));
    }
    let covariance = stationary(a.clone(), &noise * noise.transpose()).ok_or_else(unstable)?;
    let deviation =
        |row: usize| (outputs.row(row) * &covariance * outputs.row(row).transpose())[0].max(0.0).sqrt();

    let forces = outputs.select_rows(actuators.iter().map(|rows| &rows[0]));
    let oscillations = in_band([&a, &noise, &forces], sample_rate).ok_or_else(unstable)?;
    let at_rest = DMatrix::identity(a.nrows(), a.nrows()) - a;
    let held = &outputs * at_rest.lu().solve(&sources).ok_or_else(unstable)?;
    let constant = |of: Disturbance| {
        let (key, size) = of.constant(rig)?;
        let of_all = |row: usize| {
            let columns = held.row(row);
            size * columns.iter().skip(of as usize).step_by(Disturbance::COUNT).sum::<f64>()
        };
        Some((key, actuators.iter().map(|rows| rows.map(of_all)).collect()))
    };
    Ok(AboutRest {
        deviations: actuators.iter().map(|rows| rows.map(deviation)).collect(),
        oscillations,
        constants: Disturbance::ALL.into_iter().filter_map(constant).collect(),
    })
}

/// Standard deviations, within the band of the oil column, of outputs of a model with these states, inputs and outputs, of
/// which each input is white noise of deviation 1; `None` on a pole.
fn in_band([a, inputs, outputs]: [&DMatrix<f64>; 3], sample_rate: f64) -> Option<Vec<f64>> {
    let noisy: Vec<usize> = (0..inputs.ncols())
        .filter(|&column| inputs.column(column).iter().any(|entry| *entry != 0.0))
        .collect();
    let (lowest, highest) = OIL_COLUMN;
    let mut squares = vec![0.0; outputs.nrows()];
    if noisy.is_empty() || sample_rate <= 2.0 * highest {
        return Some(squares);
    }
    let model = StateSpace {
        a: a.clone(),
        b: inputs.select_columns(&noisy),
        c: outputs.clone(),
        d: DMatrix::zeros(outputs.nrows(), noisy.len()),
        sample_time: Some(1.0 / sample_rate),
        ..StateSpace::default()
    };
    let all = |count: usize| (0..count).collect::<Vec<_>>();
    let responses = Responses::new(&model, &all(squares.len()), &all(noisy.len()));
    let step = (highest - lowest) / f64::from(FREQUENCIES);
    for i in 0..FREQUENCIES {
        let frequency = lowest + (f64::from(i) + 0.5) * step;
        let found = responses.at(Complex::from_polar(1.0, TAU * frequency / sample_rate))?;
        for (square, row) in squares.iter_mut().zip(found.row_iter()) {
            // The density of white noise of variance 1, from 0 to half the sample rate.
            *square += row.iter().map(|one| one.norm_sqr()).sum::<f64>() * 2.0 * step / sample_rate;
        }
    }
    Some(squares.into_iter().map(f64::sqrt).collect())
}

/// The solution of `P = A·P·Aᵀ + Q`, by doubling the number of steps; `None` without one.
fn stationary(mut a: DMatrix<f64>, mut covariance: DMatrix<f64>) -> Option<DMatrix<f64>> {
    // After 2^60 steps every pole below 1 in double precision has faded.
    for _ in 0..60 {
        covariance += &a * &covariance * a.transpose();
        a = &a * &a;
        // Every entry has its own unit, so a large one does not show an unstable loop.
        if a.iter().all(|entry| entry.abs() < 1e-12) {
            return Some(covariance);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Realization;

    #[test]
    fn a_first_order_process_has_the_variance_of_the_geometric_series() {
        let one = |value: f64| DMatrix::from_element(1, 1, value);
        let found = stationary(one(0.99), one(3.0)).unwrap()[0];
        assert!((found - 3.0 / (1.0 - 0.99 * 0.99)).abs() < 1e-9 * found);
        assert!(stationary(one(1.01), one(3.0)).is_none() && stationary(one(1.0), one(3.0)).is_none());
    }

    #[test]
    fn the_units_of_the_states_do_not_matter() {
        // A coupling of a pressure to a displacement.
        let process = |unit: f64| DMatrix::from_row_slice(2, 2, &[0.99, 1.0 / unit, -0.01 * unit, 0.9]);
        let found = |unit: f64| {
            let noise = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]);
            stationary(process(unit), noise).unwrap()[0]
        };
        assert!((found(1e14) / found(1.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn an_analog_force_loop_does_not_see_the_resolution_of_the_force() {
        let of = |realization| {
            let rig = RigConfig::zhao2005().with(|rig| {
                rig.controller.realization = realization;
                (rig.sensors.force.range, rig.sensors.force.bits) = (Some(245e3), Some(8));
            });
            about_rest(&rig.unwrap(), FlowGain::Mean, 4096.0).unwrap().deviations[0][0]
        };
        assert!(of(Realization::Analog) == 0.0 && of(Realization::Digital) > 100.0);
    }

    #[test]
    fn a_bias_of_the_load_cell_is_a_constant_force_and_moves_the_structure_statically() {
        for realization in [Realization::Analog, Realization::Digital] {
            let rig = RigConfig::zhao2005().with(|rig| {
                rig.controller.realization = realization;
                rig.sensors.force.bias = 300.0;
            });
            let rig = rig.unwrap();
            let found = about_rest(&rig, FlowGain::Mean, 4096.0).unwrap().constants;
            let [("sensors.force.bias", each)] = &found[..] else { panic!("{found:?}") };
            let stiffness = rig.structure.stiffness;
            // Without an integral part the leakage keeps 2 % of it.
            assert!((each[0][0] + 300.0).abs() < 9.0, "{each:?}");
            assert!((each[0][1] - each[0][0] / stiffness).abs() < 1e-9, "{each:?}");
        }
    }

    #[test]
    fn an_unstable_loop_has_no_state_about_rest() {
        let rig = RigConfig::zhao2005().with(|rig| rig.compensation.level = 1.2).unwrap();
        assert!(about_rest(&rig, FlowGain::Mean, 4096.0).unwrap_err().to_string().contains("stable"));
    }
}
