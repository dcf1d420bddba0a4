//! The errors of a test, predicted with the linear model before it.

use std::f64::consts::TAU;

use crate::analysis::learned;
use crate::analysis::linear::{
    AboutRest, Complex, DMatrix, FlowGain, StateSpace, Time, about_rest, linearize,
};
use crate::config::{ForceLoop, Realization, RigConfig};
use crate::error::{Error, Result};
use crate::fourier;
use crate::ground_motion::excitation::Command;
use crate::interruption;
use crate::state_space::Responses;

/// Highest frequency (Hz) of the prediction.
const HIGHEST: f64 = 20.0;
/// Factor by which the signals fade over a test.
const FADED: f64 = 30.0;

/// Errors of force and displacement at small motion, of the actuators with the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the force, against the command.
    pub force: PredictedError,
    /// Of the displacement, against the ideal one.
    pub displacement: PredictedError,
    /// Root-mean-square spool opening (1).
    pub opening: f64,
    /// Keys that cause a constant force, each with its largest size (N).
    pub constants: Vec<(&'static str, f64)>,
    /// Keys of the rig whose effect is not contained.
    pub left_out: Vec<String>,
}

/// One predicted error and its parts, rms over rms (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedError {
    /// All parts together.
    pub whole: f64,
    /// The part that noise of the sensors and resolution of the converters cause.
    pub noise: f64,
    /// The part of constant forces.
    pub constant: f64,
}

/// The errors of a test with force commands, one per actuator, below 20 Hz and in the long run.
///
/// With self-calibration they are those after it. `None` without a stable linear model, without a command
/// below 20 Hz, with a guard alone, which changes the loop, or with self-calibration of several actuators,
/// whose channels find different delays.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn predict(rig: &RigConfig, commands: &[Command]) -> Result<Option<Prediction>> {
    let learns = rig.compensation.adaptive;
    let Some(first) = commands.first() else { return Ok(None) };
    if if learns { commands.len() > 1 } else { rig.compensation.guard } {
        return Ok(None);
    }
    let rate = first.sample_rate;
    let modelled = || {
        let judged = if learns { learned(rig, rate)? } else { rig.clone() };
        let model = linearize(&judged, FlowGain::Mean, Time::Sampled(rate))?;
        // Noise acts at every opening of the motion, where the curve is less steep than at rest.
        let at_rest = about_rest(&judged, FlowGain::Nominal, rate, missed_null(rig))?;
        Ok((model, at_rest))
    };
    match modelled() {
        Ok((model, at_rest)) => errors(rig, &model, at_rest, commands),
        Err(Error::Interrupted) => Err(Error::Interrupted),
        // There is no stable linear model: too many delays, no slope at rest, or growing motion.
        Err(_) => Ok(None),
    }
}

/// Valve command (V) by which the controller misses the valve's null.
fn missed_null(rig: &RigConfig) -> f64 {
    let valve = &rig.plant().servovalve;
    rig.null_command() - valve.null_bias * valve.spool_sensitivity * valve.spool_stroke
}

/// Whether the controller adds a learned null offset, which also contains a bias of the velocity.
fn learns_null(rig: &RigConfig) -> bool {
    let integrates = rig.controller.realization == Realization::Digital && rig.controller.integral_gain > 0.0;
    let learns = rig.compensation.adaptive && rig.compensation.curve_correction;
    learns && !integrates && rig.controller.force_loop == ForceLoop::Pd
}

/// The prediction from a stable linear model and the state about rest; `None` without a command below 20 Hz.
fn errors(
    rig: &RigConfig,
    model: &StateSpace,
    mut at_rest: AboutRest,
    commands: &[Command],
) -> Result<Option<Prediction>> {
    if learns_null(rig) {
        at_rest.constants.retain(|(key, _)| !["servovalve.null_bias", "sensors.velocity.bias"].contains(key));
    }
    let samples = commands.iter().map(|command| command.values.len()).min().unwrap_or(0);
    let Some(signals) = signals(model, commands, samples)? else { return Ok(None) };
    let none = PredictedError { whole: 0.0, noise: 0.0, constant: 0.0 };
    let (mut force, mut displacement, mut opening) = (none, none, 0.0_f64);
    for (i, own) in signals.into_iter().enumerate() {
        let error = |which: usize, missed: Spectrum, wanted: Spectrum| {
            let wanted = rms(wanted, samples, 0.0)?;
            let constant = at_rest.constants.iter().map(|(_, all)| all[i][which]).sum::<f64>();
            let noise = at_rest.deviations[i][which];
            let whole = rms(missed, samples, constant)?.hypot(noise);
            Ok::<_, Error>([whole, noise, constant.abs()].map(|part| part / wanted))
        };
        force = force.or_larger(error(0, own.missed_force, own.command)?);
        displacement = displacement.or_larger(error(1, own.missed_motion, own.ideal_motion)?);
        opening = opening.max(rms(own.opening, samples, 0.0)?);
    }
    let largest = |all: &Vec<[f64; 2]>| all.iter().map(|one| one[0].abs()).fold(0.0, f64::max);
    let constants = at_rest.constants.iter().map(|(key, all)| (*key, largest(all))).collect();
    let left_out = left_out(rig, model);
    Ok(Some(Prediction { force, displacement, opening, constants, left_out }))
}

impl PredictedError {
    /// The larger of each part. An actuator without a command has no error.
    fn or_larger(self, [whole, noise, constant]: [f64; 3]) -> Self {
        if !whole.is_finite() {
            return self;
        }
        Self {
            whole: self.whole.max(whole),
            noise: self.noise.max(noise),
            constant: self.constant.max(constant),
        }
    }
}

/// Keys of a rig whose effect the prediction does not contain.
fn left_out(rig: &RigConfig, model: &StateSpace) -> Vec<String> {
    let contained = ["servovalve.null_bias", "sensors.force.bias", "sensors.velocity.bias"];
    let mut keys = model.left_out.clone();
    keys.retain(|key| !contained.contains(&key.as_str()));
    let (overlap, known) = (rig.plant().servovalve.overlap, rig.servovalve.overlap);
    if overlap < 0.0 && overlap != known {
        // The model is that of a motion within an underlap, which the controller does not know.
        keys.push("servovalve.overlap".into());
    }
    keys
}

type Spectrum = Vec<Complex<f64>>;

/// Spectra of an actuator's signals up to 20 Hz. The signals fade, so that the motion at the end of a test does
/// not return at its start.
#[derive(Default)]
struct Signals {
    command: Spectrum,
    missed_force: Spectrum,
    ideal_motion: Spectrum,
    missed_motion: Spectrum,
    opening: Spectrum,
}

/// The signals of each actuator; `None` without a command.
fn signals(model: &StateSpace, commands: &[Command], samples: usize) -> Result<Option<Vec<Signals>>> {
    let Some(first) = commands.first() else { return Ok(None) };
    let band = ((HIGHEST / first.sample_rate * samples as f64) as usize).min(samples.saturating_sub(1) / 2);
    let spectrum = |command: &Command| {
        let faded = command.values[..samples].iter().enumerate();
        let faded: Vec<f64> = faded.map(|(i, force)| force / growth(i, samples)).collect();
        Ok(fourier::spectrum(&faded)?.into_iter().take(band + 1).collect())
    };
    let asked = commands.iter().map(spectrum).collect::<Result<Vec<Spectrum>>>()?;
    let count = commands.len();
    let asked = DMatrix::from_fn(count, band + 1, |actuator, bin| asked[actuator][bin]);
    if asked.iter().all(|bin| *bin == Complex::ZERO) {
        return Ok(None);
    }
    let rows = |quantity: &str| {
        let found = model.outputs.iter().enumerate();
        found.filter(|(_, name)| name.split('_').next() == Some(quantity)).map(|(row, _)| row).collect()
    };
    let rows: [Vec<usize>; 3] = ["force", "displacement", "spool"].map(rows);
    let responses = Responses::new(model, &rows.concat());
    let mut signals: Vec<Signals> = (0..count).map(|_| Signals::default()).collect();
    for (bin, command) in asked.column_iter().enumerate() {
        interruption::check()?;
        let turn = Complex::from_polar(growth(1, samples), TAU * bin as f64 / samples as f64);
        let on_a_pole = || Error::value("frequency", bin, "must not lie on a pole of the model");
        let per_command = responses.at(turn).ok_or_else(on_a_pole)?;
        let applied = &per_command * command;
        let [force, motion, opening] = [0, 1, 2].map(|which| applied.rows(which * count, count).into_owned());
        // The forces that are asked for move the structure as a command that makes them.
        let exact = per_command
            .rows(0, count)
            .into_owned()
            .lu()
            .solve(&command.into_owned())
            .ok_or_else(on_a_pole)?;
        let ideal = per_command.rows(count, count) * exact;
        for (i, own) in signals.iter_mut().enumerate() {
            own.command.push(command[i]);
            own.missed_force.push(force[i] - command[i]);
            own.ideal_motion.push(ideal[i]);
            own.missed_motion.push(motion[i] - ideal[i]);
            own.opening.push(opening[i]);
        }
    }
    Ok(Some(signals))
}

/// Factor by which a signal without fading exceeds the faded one at a sample.
fn growth(sample: usize, samples: usize) -> f64 {
    FADED.powf(sample as f64 / samples as f64)
}

/// Root mean square of the signal with this faded spectrum and a constant.
fn rms(mut spectrum: Spectrum, samples: usize, constant: f64) -> Result<f64> {
    spectrum.resize(samples / 2 + 1, Complex::ZERO);
    let faded = fourier::signal_of(spectrum, samples)?;
    let value = |(i, value): (usize, &f64)| growth(i, samples) * value / samples as f64 + constant;
    let sum: f64 = faded.iter().enumerate().map(value).map(|value| value * value).sum();
    Ok((sum / samples as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground_motion::excitation::sine_sweep;

    #[test]
    fn a_silent_actuator_has_no_error_and_a_silent_test_no_prediction() {
        let rig = RigConfig::zhao2005();
        let silent = Command::new(vec![0.0; 4096], 4096.0).unwrap();
        assert_eq!(predict(&rig, &[silent]).unwrap(), None);
        let none = PredictedError { whole: 0.0, noise: 0.0, constant: 0.0 };
        assert_eq!(none.or_larger([f64::NAN, 1.0, 2.0]), none);
    }

    #[test]
    fn the_signals_of_a_test_do_not_return_at_its_start() {
        // A signal that only the last sample contains has the root mean square of one sample.
        let samples = 1000;
        let mut values = vec![0.0; samples];
        values[samples - 1] = 2.0 / growth(samples - 1, samples);
        let spectrum = fourier::spectrum(&values).unwrap();
        assert!((rms(spectrum, samples, 0.0).unwrap() - 2.0 / 1000.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_opening_is_that_of_the_flow_of_the_motion() {
        let rig = RigConfig::zhao2005();
        let command = sine_sweep(2000.0, 0.5, 8.0, 16.0, 4096.0).unwrap();
        let found = predict(&rig, std::slice::from_ref(&command)).unwrap().unwrap();
        let ideal = crate::closed_loop::ideal_response(&rig, &command, &Default::default()).unwrap();
        let squares: f64 = ideal.velocity.iter().map(|v| v * v).sum();
        let velocity = (squares / ideal.velocity.len() as f64).sqrt();
        let slopes = rig.servovalve.flow_table.slopes().unwrap();
        let expected = velocity * rig.actuator.piston_area / (0.5 * (slopes.0 + slopes.1));
        // Oil and leakage take a little flow as well.
        assert!((found.opening / expected - 1.0).abs() < 0.1, "{} {expected}", found.opening);
    }
}
