//! Effects of a rig that no linear model has, where they raise the force's error by about a tenth.

use std::f64::consts::SQRT_2;

use crate::Result;
use crate::analysis::linear::{FlowGain, Time, delay_budget, linearize};
use crate::analysis::prediction::nonlinear::NOTICED;
use crate::config::{RigConfig, gain_within_limit};
use crate::ground_motion::excitation::Command;

/// Largest rate of a force loop over that of its valve, 1 over its delay.
const FASTEST: f64 = 1.2;
/// Amplitude of a sustained oscillation over the force of the command that ends it, and the time (s) without such a force
/// after which it is back.
const ENDED: (f64, f64) = (2.8, 0.2);
/// Band (Hz) of the valve's delay.
const VALVE: (f64, f64) = (0.25, 10.0);
/// Least growth (1/s) of an oscillation that counts.
const GROWS: f64 = 1.0;

/// Keys of the effects that are noticed beside a force error (1) at a root-mean-square opening (1).
pub(super) fn noticed(
    rig: &RigConfig,
    commands: &[Command],
    error: f64,
    opening: f64,
    play: &Play,
) -> Result<Vec<&'static str>> {
    let beside = |effect: f64| effect * effect > NOTICED * error * error;
    let all = [
        ("actuator.attachment_play", beside(play.error)),
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

/// The play of the attachment in a test.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Play {
    /// Force error (rms over rms, 1), about.
    pub error: f64,
    /// Force amplitude (N) of a sustained oscillation of the oil column under a small command; 0 if there is none.
    pub oscillation: f64,
}

/// The play in a test with a loop. At each reversal the piston crosses the play `p`, while the force that is missing grows
/// linearly: the flow that crosses it grows with the square of the time, and the error with the power 3/4 of the play.
pub(super) fn play(rig: &RigConfig, judged: &RigConfig, commands: &[Command]) -> Result<Play> {
    let actuator = &rig.plant().actuator;
    if actuator.attachment_play == 0.0 {
        return Ok(Play::default());
    }
    let oil = actuator.piston_area * actuator.piston_area / actuator.compressibility;
    let force = oil * actuator.attachment_play;
    let rate = commands[0].sample_rate;
    let (loaded, oscillation) = (loading(judged, rate)?, force * sustained(judged, rate)?);
    let error = |command: &Command| {
        let (values, size) = (&command.values, rms(command));
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let angular = root_mean_square(&steps) * command.sample_rate / size;
        let crossed = 0.6 * (force / size * angular / loaded).powf(0.75);
        let parts = values.chunks(((ENDED.1 * command.sample_rate) as usize).max(1));
        let (count, ending) = (parts.len() as f64, oscillation / ENDED.0);
        let lasting =
            parts.filter(|part| part.iter().all(|value| value.abs() < ending)).count() as f64 / count;
        crossed.hypot(lasting.sqrt() * oscillation / SQRT_2 / size)
    };
    let moving = commands.iter().filter(|command| rms(command) > 0.0);
    Ok(Play { error: moving.map(error).fold(0.0, f64::max), oscillation })
}

/// Rate (rad/s) at which a force loop loads the oil of a piston at rest.
fn loading(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    let rig = rig.with_fixed_gains(sample_rate)?;
    let (control, plant) = (&rig.controller, rig.plant());
    let (valve, actuator) = (&plant.servovalve, &plant.actuator);
    let flow = plant.at_rest(valve.true_curve())?.steeper * valve.flow_gain_scale;
    let opening = control.proportional_gain * control.force_sensitivity
        / (valve.spool_sensitivity * valve.spool_stroke);
    let valve = delay_budget(&rig, sample_rate, VALVE)?.valve;
    Ok((opening * flow * actuator.piston_area / actuator.compressibility).min(FASTEST / valve))
}

/// Amplitude of the oscillation that a play sustains, over the force that the oil's stiffness gives to the play, by harmonic
/// balance; 0 without one. To a sine of amplitude `z` in the filling, a play up to `z_p` is a spring in series with the oil.
fn sustained(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    let rig = rig.with_fixed_gains(sample_rate)?;
    let actuator = &rig.plant().actuator;
    let oil = actuator.piston_area * actuator.piston_area / actuator.compressibility;
    // From large oscillations to small ones: the first that grows is the one that lasts.
    for i in 1..20 {
        let y = f64::from(i) / 20.0;
        let passed = 1.0 - gain_within_limit(y, 1.0);
        let softer = oil / (1.0 / passed - 1.0);
        let series = actuator.attachment_stiffness.map_or(softer, |own| 1.0 / (1.0 / own + 1.0 / softer));
        let soft = rig.varied(|values| values.actuator.attachment_stiffness = Some(series));
        if linearize(&soft, FlowGain::Mean, Time::Sampled(sample_rate))?.growth_rate()? > GROWS {
            return Ok(0.5 * passed / y);
        }
    }
    Ok(0.0)
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
