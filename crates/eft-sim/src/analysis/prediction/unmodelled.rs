//! Effects of a rig that no linear model has, where they raise the force's error by about a tenth.

use crate::analysis::prediction::nonlinear::NOTICED;
use crate::config::RigConfig;
use crate::error::Result;
use crate::ground_motion::excitation::Command;

/// Force error over the force that the oil's stiffness gives to the play. At 10 and 50 µm it was 0.1 and 0.07 on the
/// paper's rig.
const OF_PLAY: f64 = 0.1;

/// Keys of the effects that are noticed beside a force error (1) at a root-mean-square opening (1).
pub(super) fn noticed(
    rig: &RigConfig,
    commands: &[Command],
    error: f64,
    opening: f64,
) -> Result<Vec<&'static str>> {
    let beside = |effect: f64| effect * effect > NOTICED * error * error;
    let all = [
        ("actuator.attachment_play", beside(play(rig, commands))),
        ("protection.start_time", beside(soft_start(rig, commands))),
        ("supply.droop", beside(droop(rig, opening)?)),
    ];
    Ok(all.into_iter().filter(|(_, noticed)| *noticed).map(|(key, _)| key).collect())
}

/// A learning rig with the oil and the leakage of the feedforward known, each with its key, where they are not. The learner
/// takes some of the flow that they miss for a late velocity.
pub(super) fn not_learned(rig: &RigConfig) -> Vec<(&'static str, RigConfig)> {
    let (known, plant) = (&rig.actuator, &rig.plant().actuator);
    let (oil, leakage) = (known.compressibility, known.leakage);
    let mut found = Vec::new();
    if rig.compensation.adaptive && rig.compensation.feedforward {
        if plant.compressibility != oil {
            let told = rig.varied(|values| values.actuator.compressibility = oil);
            found.push(("actuator.compressibility", told));
        }
        if plant.leakage != leakage {
            found.push(("actuator.leakage", rig.varied(|values| values.actuator.leakage = leakage)));
        }
    }
    found
}

/// Force error (1): at each reversal the piston crosses the play.
pub(super) fn play(rig: &RigConfig, commands: &[Command]) -> f64 {
    let actuator = &rig.plant().actuator;
    let stiffness = actuator.piston_area * actuator.piston_area / actuator.compressibility;
    let least = commands.iter().map(rms).filter(|force| *force > 0.0).fold(f64::INFINITY, f64::min);
    OF_PLAY * actuator.attachment_play * stiffness / least
}

/// Force error (1) by the ramp of a soft start, which takes its part of the command away.
fn soft_start(rig: &RigConfig, commands: &[Command]) -> f64 {
    if !rig.protection.enabled || rig.protection.start_time == 0.0 {
        return 0.0;
    }
    let lost = |command: &Command| {
        let missing = |i: usize| (1.0 - i as f64 / command.sample_rate / rig.protection.start_time).max(0.0);
        let lost: Vec<f64> = command.values.iter().enumerate().map(|(i, value)| missing(i) * value).collect();
        let all = rms(command);
        if all > 0.0 { root_mean_square(&lost) / all } else { 0.0 }
    };
    commands.iter().map(lost).fold(0.0, f64::max)
}

/// Force error (1) by the flow that the drop of an unmeasured supply pressure takes.
fn droop(rig: &RigConfig, opening: f64) -> Result<f64> {
    let plant = rig.plant();
    let Some(droop) = plant.supply.droop.filter(|_| !rig.compensation.supply_correction) else {
        return Ok(0.0);
    };
    let valve = &plant.servovalve;
    let flow = plant.at_rest(valve.true_curve())?.steeper * valve.flow_gain_scale * opening;
    // The flow is that of the root of the pressure.
    Ok(0.5 * droop * flow / plant.supply.pressure)
}

fn rms(command: &Command) -> f64 {
    root_mean_square(&command.values)
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
