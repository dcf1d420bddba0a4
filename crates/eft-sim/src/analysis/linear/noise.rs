//! Force and displacement that the noise of the sensors and the resolution of the converters cause about rest.

use nalgebra::DMatrix;

use super::gains::FlowGain;
use super::noise_source::Source;
use super::sampled::Ticker;
use crate::config::RigConfig;
use crate::error::{Error, Result};

/// Standard deviations of an actuator's force (N) and displacement (m) about rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseDeviation {
    /// Of the force (N).
    pub force: f64,
    /// Of the displacement (m).
    pub displacement: f64,
}

/// The deviations that white noise in a rig's sensors and the rounding of its converters cause in the sampled
/// loop, one entry per actuator. They are those of a test that is long beside the decay of the motion.
///
/// # Errors
/// As [`linearize`](super::linearize); an unstable loop.
pub fn noise_deviations(rig: &RigConfig, gain: FlowGain, sample_rate: f64) -> Result<Vec<NoiseDeviation>> {
    let rig = &*rig.at_rate(sample_rate)?;
    let ticker = Ticker::new(rig, gain, sample_rate)?;
    let (a, mut noise) = ticker.noise();
    for (column, source) in Source::ALL.iter().cycle().take(noise.ncols()).enumerate() {
        noise.column_mut(column).scale_mut(source.deviation(rig));
    }
    let covariance = stationary(a, &noise * noise.transpose()).ok_or_else(|| {
        Error::value("stability of the linear model", "unstable", "must be stable for a noise")
    })?;
    let (outputs, names) = ticker.outputs();
    let of = |row: usize| (outputs.row(row) * &covariance * outputs.row(row).transpose())[0].max(0.0).sqrt();
    let rows = |quantity: &str| {
        let found = names.iter().enumerate().filter(|(_, name)| name.split('_').next() == Some(quantity));
        found.map(|(row, _)| row).collect::<Vec<_>>()
    };
    let both = rows("force").into_iter().zip(rows("displacement"));
    Ok(both.map(|(force, moved)| NoiseDeviation { force: of(force), displacement: of(moved) }).collect())
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
            noise_deviations(&rig.unwrap(), FlowGain::Nominal, 4096.0).unwrap()[0].force
        };
        assert!(of(Realization::Analog) == 0.0 && of(Realization::Digital) > 100.0);
    }

    #[test]
    fn an_unstable_loop_has_no_deviation() {
        let rig = RigConfig::zhao2005().with(|rig| rig.compensation.level = 1.2).unwrap();
        assert!(
            noise_deviations(&rig, FlowGain::Nominal, 4096.0).unwrap_err().to_string().contains("stable")
        );
    }
}
