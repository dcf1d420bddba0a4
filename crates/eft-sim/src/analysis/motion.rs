//! The frequency of a rig's motion, at which calibration and guard act.

use std::f64::consts::TAU;

use crate::analysis::linear::{Complex, FlowGain, Time, linearize};
use crate::state_space::Responses;
use crate::{Error, Result, RigConfig};

/// Band (Hz) of a motion, and the number of frequencies in it.
const MOTION: (f64, f64) = (0.2, 12.0);
const FREQUENCIES: i32 = 100;

/// Root-mean-square frequency of a motion.
pub(super) struct Motion {
    /// In rad/s.
    pub(super) angular: f64,
    /// The velocity in use over the true one, at this frequency.
    pub(super) used_over_true: Complex<f64>,
}

pub(super) fn motion(rig: &RigConfig, sample_rate: f64) -> Result<Motion> {
    let model = linearize(rig, FlowGain::Nominal, Time::Sampled(sample_rate))?;
    // In a building that of the top floor under its own force, which is mostly that of the first mode. All controllers are taken
    // to learn the same.
    let row = |quantity: &str| model.outputs.iter().rposition(|name| name.starts_with(quantity));
    let rows: Vec<usize> = ["velocity", "measured_velocity"].into_iter().filter_map(row).collect();
    let responses = Responses::new(&model, &rows, &[model.inputs.len().saturating_sub(1)]);
    let at = |frequency: f64| {
        let found = responses.at(Complex::from_polar(1.0, TAU * frequency / sample_rate));
        let found = found.ok_or_else(|| {
            Error::value("frequency of the motion", frequency, "must not lie on a pole of the model")
        })?;
        Ok::<_, Error>([found[0], found[1]])
    };
    let (mut moments, mut squares) = (0.0, 0.0);
    for i in 0..FREQUENCIES {
        let along = f64::from(i) / f64::from(FREQUENCIES - 1);
        let frequency = MOTION.0 * (MOTION.1 / MOTION.0).powf(along);
        let square = at(frequency)?[0].norm_sqr();
        moments += square * frequency * frequency;
        squares += square;
    }
    let frequency = (moments / squares).sqrt();
    let [true_velocity, used] = at(frequency)?;
    Ok(Motion { angular: TAU * frequency, used_over_true: used / true_velocity })
}
