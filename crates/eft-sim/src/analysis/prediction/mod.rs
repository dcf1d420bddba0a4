//! The errors of a test, predicted with the linear model before it.

mod nonlinear;
mod signals;
mod unmodelled;

use self::nonlinear::{NOTICED, Unknown};
use self::signals::{Faded, Signals, Spectrum};
pub use self::unmodelled::Play;
use crate::analysis::learned;
use crate::analysis::linear::{AboutRest, FlowGain, StateSpace, about_rest, disturbed};
use crate::config::{ForceLoop, RigConfig};
use crate::error::{Error, Result};
use crate::ground_motion::excitation::Command;

/// Key of the valve's null.
const NULL: &str = "servovalve.null_bias";
/// Time (s) whose whole force by an unknown null has the mean square of the force in a test that learns it. It was 0.6 to
/// 1.3 s in sweeps of 1 to 8 kN on the paper's rig, with noise and without.
const UNLEARNED: f64 = 0.8;
/// Part of an error that is noticed (1).
const TENTH: f64 = 0.1;

/// Errors of force and displacement at small motion, of the actuators with the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the force, against the command.
    pub force: PredictedError,
    /// Of the displacement, against the ideal one.
    pub displacement: PredictedError,
    /// Constant causes of a force: their keys, each with the force's largest root mean square (N) over the actuators.
    pub constants: Vec<(&'static str, f64)>,
    /// Whether the controller learns the null, and a bias of the velocity with it, during the test.
    pub null_learned: bool,
    /// A known overlap over the root-mean-square opening (1). The force error by it was 0.5 to 2.6 times as large on rigs of
    /// 25 kN to 1 MN. `force` does not contain it.
    pub overlap: f64,
    /// The play of the attachment. `force` does not contain it.
    pub play: Play,
    /// What is not contained: keys of the rig, and the command above 20 Hz if it may raise the force's error by a tenth.
    pub left_out: Vec<String>,
}

/// One predicted error and its parts, rms over rms (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedError {
    /// All parts together.
    pub whole: f64,
    /// The part that noise of the sensors and resolution of the converters cause.
    pub noise: f64,
    /// The part of constant causes: biases, and a null that the controller does not know.
    pub constant: f64,
}

/// The errors of a test with force commands, one per actuator, below 20 Hz and in the long run.
///
/// With self-calibration they are those after it. `None` without a stable linear model, with more than half of
/// the command's power above 20 Hz, with a guard alone, which changes the loop, or with self-calibration of several actuators,
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
    let found = |rig: &RigConfig| {
        // An unknown lap disturbs the loop with the known one.
        let told = rig.varied(|values| values.servovalve.overlap = rig.servovalve.overlap);
        let judged = if learns { learned(&told, rate)? } else { told };
        let model = disturbed(&judged, FlowGain::Mean, rate)?;
        // Noise acts at every opening of the motion, where the curve is less steep than at rest.
        let at_rest = about_rest(&judged, FlowGain::Nominal, rate)?;
        errors(rig, &judged, &model, at_rest, commands)
    };
    let predicted = || {
        let Some(mut prediction) = found(rig)? else { return Ok(None) };
        for (key, known) in unmodelled::not_learned(rig) {
            let without = match found(&known) {
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                other => other.ok().flatten().map_or(f64::INFINITY, |without| without.force.whole),
            };
            if (prediction.force.whole - without).abs() > TENTH * prediction.force.whole {
                prediction.left_out.push(key.into());
            }
        }
        Ok(Some(prediction))
    };
    match predicted() {
        Ok(found) => Ok(found),
        Err(Error::Interrupted) => Err(Error::Interrupted),
        // There is no stable linear model: too many delays, no slope at rest, or growing motion. Or a command is too
        // large for a spectrum.
        Err(_) => Ok(None),
    }
}

/// Whether the controller adds a learned null offset, which contains a bias of the velocity as well.
fn learns_null(rig: &RigConfig) -> bool {
    rig.compensation.corrects_curve()
        && !rig.controller.integrates()
        && rig.controller.force_loop == ForceLoop::Pd
}

/// The prediction from a stable linear model and the state about rest; `None` without a command below 20 Hz.
fn errors(
    rig: &RigConfig,
    judged: &RigConfig,
    model: &StateSpace,
    mut at_rest: AboutRest,
    commands: &[Command],
) -> Result<Option<Prediction>> {
    let mut left_out = left_out(rig, model);
    let mut unknown = Unknown::of(rig);
    let null_learned = learns_null(rig);
    if null_learned {
        // As long as nothing is learned the whole force is there.
        let duration = commands[0].values.len() as f64 / commands[0].sample_rate;
        let left = (UNLEARNED / duration).min(1.0).sqrt();
        unknown.null *= left;
        let learned = at_rest.constants.iter_mut().filter(|(key, _)| *key == "sensors.velocity.bias");
        learned.flat_map(|(_, all)| all.iter_mut().flatten()).for_each(|value| *value *= left);
    }
    let Some(faded) = Faded::of(commands) else { return Ok(None) };
    let mut signals = Signals::of(model, commands, &faded)?;
    let within = faded.share(&signals, commands)?;
    if within.is_nan() || within < 0.5 {
        return Ok(None);
    }
    if unknown.any() {
        unknown.disturb(judged, model, &faded, &mut signals)?;
    }
    let none = PredictedError { whole: 0.0, noise: 0.0, constant: 0.0 };
    let (mut force, mut displacement, mut opening, mut null) = (none, none, 0.0_f64, 0.0_f64);
    for (i, own) in signals.into_iter().enumerate() {
        null = null.max(faded.rms(own.by_null[0].clone(), 0.0)?);
        let error = |which: usize, missed: Spectrum, wanted: Spectrum| {
            let wanted = faded.rms(wanted, 0.0)?;
            let held = at_rest.constants.iter().map(|(_, all)| all[i][which]).sum();
            let noise = at_rest.deviations[i][which];
            let whole = faded.rms(missed, held)?.hypot(noise);
            let constant = faded.rms(own.by_null[which].clone(), held)?;
            Ok::<_, Error>([whole, noise, constant].map(|part| part / wanted))
        };
        force = force.or_larger(error(0, own.missed_force, own.command)?);
        displacement = displacement.or_larger(error(1, own.missed_motion, own.ideal_motion)?);
        opening = opening.max(faded.rms(own.opening, 0.0)?);
    }
    // An actuator follows little of it, so it is an error itself.
    if 1.0 - within > NOTICED * force.whole.powi(2) {
        left_out.push("command above 20 Hz".into());
    }
    let play = unmodelled::play(rig, judged, commands)?;
    let noticed = unmodelled::noticed(rig, commands, force.whole, opening, &play)?;
    left_out.extend(noticed.into_iter().map(String::from));
    let largest = |all: &Vec<[f64; 2]>| all.iter().map(|one| one[0].abs()).fold(0.0, f64::max);
    let mut constants: Vec<_> = at_rest.constants.iter().map(|(key, all)| (*key, largest(all))).collect();
    constants.extend((null > 0.0).then_some((NULL, null)));
    let overlap = "servovalve.overlap";
    if unknown.is_large(opening, force.whole) && !left_out.iter().any(|key| key == overlap) {
        left_out.push(overlap.into());
    }
    let lap = rig.servovalve.overlap.max(0.0) / opening;
    Ok(Some(Prediction { force, displacement, constants, null_learned, overlap: lap, play, left_out }))
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
    let contained = |key: &str| match key {
        NULL | "sensors.force.bias" | "sensors.velocity.bias" => true,
        // Named where it is noticed.
        "actuator.attachment_play" => true,
        // What is known is compensated for, but not exactly.
        "servovalve.overlap" => rig.servovalve.overlap <= 0.0,
        _ => false,
    };
    let mut keys = model.left_out.clone();
    keys.retain(|key| !contained(key));
    keys
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_above_the_band_are_named() {
        let rig = RigConfig::zhao2005();
        let sine = |i: u32| (std::f64::consts::TAU * 2.0 * f64::from(i) / 4096.0).sin();
        let ramp = |i: u32| 0.5 - 0.5 * (std::f64::consts::PI * f64::from(i.min(4096)) / 4096.0).cos();
        let waves: [(&dyn Fn(u32) -> f64, bool); 4] = [
            (&sine, false),
            (&|i| sine(i).signum(), true),
            // They do not end at zero.
            (&|i| ramp(i) * sine(i + 512), false),
            (&ramp, false),
        ];
        for (n, (wave, above)) in waves.into_iter().enumerate() {
            let command = Command::new((0..16_384).map(|i| 1e3 * wave(i)).collect(), 4096.0).unwrap();
            let found = predict(&rig, &[command]).unwrap().unwrap();
            let named = found.left_out.iter().any(|what| what == "command above 20 Hz");
            assert_eq!(named, above, "{n}: {found:?}");
        }
    }

    #[test]
    fn a_silent_actuator_has_no_error_and_a_silent_test_no_prediction() {
        let rig = RigConfig::zhao2005();
        let silent = Command::new(vec![0.0; 4096], 4096.0).unwrap();
        assert_eq!(predict(&rig, &[silent]).unwrap(), None);
        for (frequency, predicted) in [(5.0, true), (30.0, false)] {
            let sine = |i: u32| 1e3 * (std::f64::consts::TAU * frequency * f64::from(i) / 4096.0).sin();
            let fast = Command::new((0..8192).map(sine).collect(), 4096.0).unwrap();
            assert_eq!(predict(&rig, &[fast]).unwrap().is_some(), predicted, "{frequency} Hz");
        }
        let huge = Command::new(vec![1e308, -1e308, 1e308, 1e308], 4096.0).unwrap();
        assert_eq!(predict(&rig, &[huge]).unwrap(), None);
        let none = PredictedError { whole: 0.0, noise: 0.0, constant: 0.0 };
        assert_eq!(none.or_larger([f64::NAN, 1.0, 2.0]), none);
    }
}
