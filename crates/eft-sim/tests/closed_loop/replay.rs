//! The learner over the recorded inputs of a test.

use eft_core::Input;
use eft_sim::closed_loop::{Replay, replay};
use eft_sim::excitation::sine_sweep;
use eft_sim::{RigConfig, SimulateOptions, simulate};

/// The inputs of a simulated test.
fn recorded(changes: &[(&str, toml::Value)]) -> (RigConfig, Vec<Input<f64>>, Vec<f64>) {
    let rig = RigConfig::zhao2005().replace(changes).unwrap();
    let command = sine_sweep(4000.0, 0.5, 6.0, 8.0, 4096.0).unwrap();
    let run = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
    // A run has the valve command after the tick, the learner that until the tick, with the compensation before.
    // The step of the command's rate between them is left out.
    let gain = rig.controller.proportional_gain;
    let before = |i: usize| if i > 0 { run.compensation[i - 1] } else { 0.0 };
    let until = |i: usize| run.valve_command[i] - gain * (run.compensation[i] - before(i));
    let input = |i: usize| Input {
        command: run.command[i],
        next_command: run.command[(i + 1).min(run.command.len() - 1)],
        velocity: run.measured_velocity()[i],
        force: run.measured_force()[i],
        spool: run.measured_spool()[i],
        displacement: run.measured_displacement()[i],
        valve_command: until(i),
        supply_pressure: 1.9e7,
        ..Input::default()
    };
    (rig, (0..run.command.len()).map(input).collect(), run.traces.flow_gain_estimate().samples())
}

/// The values of one estimate.
fn of(found: &Replay, name: &str) -> Vec<f64> {
    found.estimates().find(|(known, _)| *known == name).unwrap().1
}

#[test]
fn a_replayed_test_gives_the_estimates_of_the_test() {
    let changes = [
        ("compensation.adaptive", true.into()),
        ("compensation.feedforward", true.into()),
        ("servovalve.flow_gain_scale", 1.06.into()),
    ];
    let (rig, inputs, seen) = recorded(&changes);
    let found = replay::<f64>(&rig, 4096.0, &inputs).unwrap();
    let flow_gain = of(&found, "flow_gain_estimate");
    // The calibration from window k is in use in window k + 2.
    let windows = found.time.len() - 2;
    let taught = |k: usize| (flow_gain[k] - seen[16 * (k + 2)]).abs();
    assert!((0..windows).all(|k| taught(k) < 1e-6), "{:?}", (0..windows).map(taught).fold(0.0, f64::max));
    assert!((flow_gain[windows] - 1.06).abs() < 0.01);
}

#[test]
fn a_test_without_learning_is_learned_from_and_a_failed_sensor_shows_in_the_test_ratio() {
    let fault = [
        ("servovalve.flow_gain_scale", 0.97.into()),
        ("sensors.fault.signal", "velocity".into()),
        ("sensors.fault.kind", "zero".into()),
        ("sensors.fault.start", 5.0.into()),
        ("sensors.fault.duration", 0.5.into()),
    ];
    let (rig, inputs, _) = recorded(&fault);
    let found = replay::<f32>(&rig, 4096.0, &inputs).unwrap();
    let at = |time: f64| found.time.partition_point(|t| *t < time);
    assert!((of(&found, "flow_gain_estimate")[at(4.9)] - 0.97).abs() < 0.01);
    let test_ratio = of(&found, "test_ratio");
    assert!(test_ratio[..at(5.0)].iter().skip(at(0.5)).all(|ratio| *ratio < 1.0));
    assert!(test_ratio[at(5.05)] > 1.0);
    assert!(replay::<f64>(&rig, 4096.0, &[]).is_err());
}
