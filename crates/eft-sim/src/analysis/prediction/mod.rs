//! The errors of a test, predicted with the linear model before it.

mod bracket;
mod curve;
mod guard;
mod nonlinear;
mod signals;
mod sizes;
mod transition;
mod underlap;
mod unmodelled;

use self::bracket::Bracket;
use self::nonlinear::{NOTICED, Unknown};
use self::signals::{Signals, Transform};
pub use self::sizes::PredictedError;
use self::sizes::Sizes;
use self::underlap::Oscillation;
pub use self::unmodelled::Play;
use crate::analysis::linear::{FlowGain, StateSpace, about_rest, disturbed};
use crate::analysis::{Adaptation, Unreached, after_guard, after_learning};
use crate::config::{ForceLoop, RigConfig};
use crate::ground_motion::excitation::Command;
use crate::state_space::AT_REST;
use crate::{Error, Result};

/// Key of the valve's null.
const NULL: &str = "servovalve.null_bias";
/// Time (s) whose whole force by an unknown null has the mean square of the force in a test that learns it. It was 0.6 to
/// 1.3 s in sweeps of 1 to 8 kN on the paper's rig, with noise and without.
const UNLEARNED: f64 = 0.8;
/// Largest number of gains of the valve that are tried, and the relative difference that ends the search.
const GAINS: usize = 8;
const SAME_GAIN: f64 = 5e-3;
/// Power of the largest gain of a stable loop up to which one is tried.
const STABLE: f64 = 0.9;
/// Part of an error that is noticed (1).
const TENTH: f64 = 0.1;

/// Errors of force and displacement at small motion, of the actuators with the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Of the force, against the command.
    pub force: PredictedError,
    /// Of the displacement, against the ideal one.
    pub displacement: PredictedError,
    /// Force error above 30 Hz, where the oil column oscillates: of the command to 100 Hz, and of the noise to 150 Hz.
    pub oscillation: PredictedError,
    /// Constant causes of a force: their keys, each with the force's largest root mean square (N) over the actuators.
    pub constants: Vec<(&'static str, f64)>,
    /// Whether the controller learns the null, and a bias of the velocity with it, during the test.
    pub null_learned: bool,
    /// An overlap for which the controller compensates, over the root-mean-square opening (1). The force error by
    /// it was 0.5 to 2.6 times as large on rigs of 25 kN to 1 MN. `force` does not contain it.
    pub overlap: f64,
    /// The play of the attachment. `force` does not contain it.
    pub play: Play,
    /// What self-calibration needs and does not reach. The errors contain it.
    pub unreached: Vec<Unreached>,
    /// What is not contained: keys of the rig, and the command above 20 or 100 Hz if it raises the force's error by a tenth. `force`
    /// counts the part above 100 Hz as missed.
    pub left_out: Vec<String>,
}

/// The errors of a test with force commands, one per actuator: below 20 Hz, or below 100 Hz for a command with power
/// above 20 Hz.
///
/// Self-calibration and guard change the loop during the test, as the motion in it lets them. `None` without a linear
/// model that is stable at last, or with more than half of the command's power above 20 Hz.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn predict(rig: &RigConfig, commands: &[Command]) -> Result<Option<Prediction>> {
    let found = |rig: &RigConfig| {
        let Some(transform) = Transform::of(commands)? else { return Ok(None) };
        // An unknown lap and a curve change the gain of the loop, which determines the openings.
        let unknown = Unknown::of(rig, transform.sample_rate)?;
        let (mut gain, mut test) = (1.0, Loop::of(rig, 1.0, commands, &transform)?);
        let about_null =
            Oscillation::of(&test.rig, unknown.underlap(), commands.len(), transform.sample_rate)?;
        let most = about_null.as_ref().map_or(f64::INFINITY, |found| found.gain);
        let mut bracket = Bracket::new();
        for _ in 0..GAINS {
            let found = unknown.gain(&test.signals, &transform)?.min(most.powf(STABLE));
            if found.is_nan() || (found - gain).abs() <= SAME_GAIN * gain {
                break;
            }
            gain = bracket.next(gain, found);
            test = Loop::of(rig, gain, commands, &transform)?;
        }
        errors(rig, (unknown, about_null), gain, test, &transform, commands).map(Some)
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

/// A rig whose structure has a spring. One without gets a spring so soft that a test (s) does not notice it, because a free
/// structure has no state about rest.
fn tied(rig: &RigConfig, duration: f64) -> RigConfig {
    rig.varied(|values| {
        let structure = &mut values.structure;
        if structure.stiffness == 0.0 {
            structure.stiffness = structure.mass / (duration * duration);
        }
    })
}

/// Whether the controller adds a learned null offset, which contains a bias of the velocity as well.
fn learns_null(rig: &RigConfig) -> bool {
    rig.compensation.corrects_curve()
        && !rig.controller.integrates()
        && rig.controller.force_loop == ForceLoop::Pd
}

/// A test in its linear loop, after a self-calibration or a guard.
struct Loop {
    rig: RigConfig,
    model: StateSpace,
    signals: Vec<Signals>,
    /// What changes the loop of the test's start into this one, if it is another.
    adaptation: Option<Adaptation>,
    unreached: Vec<Unreached>,
}

impl Loop {
    /// With this gain (1) of the true valve over that about rest.
    fn of(rig: &RigConfig, gain: f64, commands: &[Command], transform: &Transform) -> Result<Self> {
        let rate = transform.sample_rate;
        let told = rig.varied(|values| values.servovalve.flow_gain_scale *= gain);
        let learns = rig.compensation.adaptive;
        // An unknown lap disturbs the loop with the known one.
        let (mut rig, unreached) = if learns {
            after_learning(&told, gain, rate)?
        } else {
            (told.with_known_lap(rate)?, Vec::new())
        };
        let rejected = unreached.iter().any(|one| matches!(one, Unreached::Rejected(..)));
        let learned = learns && !rejected && rig.compensation.level > 0.0;
        let mut adaptation = learned.then(|| Adaptation::of(&told, &rig, rate)).transpose()?;
        let mut model = disturbed(&rig, rate)?;
        if let Some(guarded) = after_guard(&rig, gain, rate)?
            && (model.growth_rate()? > AT_REST || guard::acts(&guarded, &model, commands)?)
        {
            adaptation = adaptation.or_else(|| Some(Adaptation::of_guard(&rig, gain)));
            rig = guarded.rig;
            model = disturbed(&rig, rate)?;
        }
        let signals = Signals::of(&model, commands, transform)?;
        Ok(Self { rig, model, signals, adaptation, unreached })
    }
}

/// The prediction from a stable linear model.
fn errors(
    rig: &RigConfig,
    (mut unknown, about_null): (Unknown, Option<Oscillation>),
    gain: f64,
    test: Loop,
    transform: &Transform,
    commands: &[Command],
) -> Result<Prediction> {
    let Loop { rig: judged, model, mut signals, adaptation, mut unreached } = test;
    // Noise acts at every opening of the motion, where the curve is less steep than at rest.
    let slope = if unknown.has_curve() { FlowGain::Mean } else { FlowGain::Nominal };
    let mut at_rest = about_rest(&tied(&judged, transform.duration()), slope, transform.sample_rate)?;
    if let Some(adaptation) = adaptation {
        transition::add(&adaptation, (&judged, &model), commands, transform, &mut signals)?;
    }
    let mut left_out = left_out(rig, &model);
    let null_learned = learns_null(rig);
    if null_learned {
        // As long as nothing is learned the whole force is there.
        let left = (UNLEARNED / transform.duration()).min(1.0).sqrt();
        unknown.null *= left;
        let learned = at_rest.constants.iter_mut().filter(|(key, _)| *key == "sensors.velocity.bias");
        learned.flat_map(|(_, all)| all.iter_mut().flatten()).for_each(|value| *value *= left);
    }
    if unknown.any() {
        unknown.disturb(&judged, &model, gain, transform, &mut signals)?;
    }
    let sizes = Sizes::of(signals, (&at_rest, about_null.as_ref()), commands, transform)?;
    let Sizes { force, displacement, oscillation, opening, .. } = sizes;
    unreached.retain(|one| !matches!(one, Unreached::Doubtful(_, _, most) if opening > *most));
    if transform.beyond > NOTICED * sizes.followed.whole.powi(2) {
        left_out.push(format!("command above {:.0} Hz", transform.highest()));
    }
    let play = unmodelled::play(rig, &judged, commands)?;
    let noticed = unmodelled::noticed(rig, commands, force.whole, opening, &play)?;
    left_out.extend(noticed.into_iter().map(String::from));
    let largest = |all: &Vec<[f64; 2]>| all.iter().map(|one| one[0].abs()).fold(0.0, f64::max);
    let mut constants: Vec<_> = at_rest.constants.iter().map(|(key, all)| (*key, largest(all))).collect();
    constants.extend((sizes.null > 0.0).then_some((NULL, sizes.null)));
    let overlap = "servovalve.overlap";
    if unknown.is_large(opening, force.whole) && !left_out.iter().any(|key| key == overlap) {
        left_out.push(overlap.into());
    }
    let lap = rig.compensated_lap().max(0.0) / opening;
    Ok(Prediction {
        force,
        displacement,
        oscillation,
        constants,
        null_learned,
        overlap: lap,
        play,
        unreached,
        left_out,
    })
}

/// Keys of a rig whose effect the prediction does not contain.
fn left_out(rig: &RigConfig, model: &StateSpace) -> Vec<String> {
    let contained = |key: &str| match key {
        NULL | "sensors.force.bias" | "sensors.velocity.bias" => true,
        // Named where it is noticed.
        "actuator.attachment_play" => true,
        // What is known is compensated for, but not exactly.
        "servovalve.overlap" => rig.compensated_lap() <= 0.0,
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
    fn harmonics_are_predicted_and_named_above_the_band() {
        let paper = RigConfig::zhao2005();
        let robust = paper.replace(&[("controller.force_loop", "robust".into())]).unwrap();
        let sine = |i: u32| (std::f64::consts::TAU * 2.0 * f64::from(i) / 4096.0).sin();
        let square = |i: u32| sine(i).signum();
        let ramp = |i: u32| 0.5 - 0.5 * (std::f64::consts::PI * f64::from(i.min(4096)) / 4096.0).cos();
        let found = |rig: &RigConfig, wave: &dyn Fn(u32) -> f64| {
            let command = Command::new((0..16_384).map(|i| 1e3 * wave(i)).collect(), 4096.0).unwrap();
            let found = predict(rig, &[command]).unwrap().unwrap();
            (found.left_out.iter().any(|what| what == "command above 100 Hz"), found.oscillation.whole)
        };
        // The simulated test has 0.367. Beyond 100 Hz a square wave has 9 % of its root mean square.
        let of_paper = found(&paper, &square);
        assert!(!of_paper.0 && (of_paper.1 - 0.37).abs() < 0.01, "{of_paper:?}");
        let of_robust = found(&robust, &square);
        assert!(of_robust.0 && (of_robust.1 - 0.17).abs() < 0.01, "{of_robust:?}");
        // The last two do not end at zero.
        let slow: [&dyn Fn(u32) -> f64; 3] = [&sine, &|i| ramp(i) * sine(i + 512), &ramp];
        for (n, wave) in slow.into_iter().enumerate() {
            let found = found(&paper, wave);
            assert!(!found.0 && found.1 < 0.01, "{n}: {found:?}");
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
    }
}
