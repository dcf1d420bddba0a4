//! A test that diverges is flagged at the sample where it was stopped, and is finite up to there.

use eft::core::status;
use eft::sim::batch::{BatchOptions, Test, simulate_batch};
use eft::sim::closed_loop::{Method, simulate_actuators};
use eft::sim::excitation::sine_sweep;
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

/// Rigs with unstable force loops, each of which overflows in a different way.
fn rigs() -> Vec<RigConfig> {
    let mut rigs = Vec::new();
    for leakage in [1.3e-7, 3.5987940799423836e-07, 3.9026420826794947e-07, 4.857599681937549e-07] {
        for sensitivity in [6.897628708897785, 17.7, 64.01389663524897, 194.3339312506169] {
            for realization in ["analog", "digital"] {
                let changes: [(&str, Value); 4] = [
                    ("actuator.leakage", leakage.into()),
                    ("controller.force_sensitivity", sensitivity.into()),
                    ("controller.realization", realization.into()),
                    ("compensation.mode", "off".into()),
                ];
                rigs.push(RigConfig::zhao2005().replace(&changes).unwrap());
            }
        }
    }
    rigs
}

/// Whether it diverged; every trace must be finite either way.
fn diverged(run: &TestRun) -> bool {
    let traces = [
        &run.command,
        &run.force,
        &run.displacement,
        &run.velocity,
        &run.spool,
        &run.load_pressure,
        &run.supply_pressure,
        &run.valve_command,
        &run.compensation,
    ];
    for (n, trace) in traces.into_iter().enumerate() {
        let bad = trace.iter().position(|value| !value.is_finite());
        assert_eq!(bad, None, "trace {n} of {} samples", trace.len());
    }
    let (last, before) = run.status.split_last().unwrap();
    assert!(before.iter().all(|flags| flags & status::DIVERGED == 0));
    last & status::DIVERGED != 0
}

#[test]
fn every_trace_is_finite_up_to_the_stop() {
    let command = sine_sweep(1e3, 0.0, 10.0, 0.25, 1024.0).unwrap();
    let exponential = SimulateOptions::default();
    let runge_kutta = SimulateOptions { method: Method::RungeKutta, ..exponential };
    let mut count = 0;
    for rig in rigs() {
        let friction = rig.replace(&[("actuator.friction", 10.0.into())]).unwrap();
        for (rig, options) in [(&rig, exponential), (&rig, runge_kutta), (&friction, exponential)] {
            count += u32::from(diverged(&simulate::<f64>(rig, &command, &options, |_, _| true).unwrap()));
        }
        let list = |value: f64| Value::Array(vec![value.into(); 2]);
        let building: [(&str, Value); 4] = [
            ("structure.kind", "shear_building".into()),
            ("structure.stories.masses", list(7040.0)),
            ("structure.stories.dampings", list(4330.0)),
            ("structure.stories.stiffnesses", list(693.8e3)),
        ];
        let building = rig.replace(&building).unwrap();
        let commands = [command.clone(), command.clone()];
        let runs = simulate_actuators::<f64>(&building, &commands, &exponential, |_, _| true).unwrap();
        count += runs.iter().map(|run| u32::from(diverged(run))).sum::<u32>();
    }
    // Most of them; the weakest loops are caught by the spool's stops.
    assert!(count > 100, "{count}");
}

#[test]
fn a_batch_stops_at_the_sample_of_a_single_test() {
    let command = sine_sweep(1e3, 0.0, 10.0, 0.25, 1024.0).unwrap();
    let rigs = rigs();
    let tests: Vec<_> =
        rigs.iter().map(|rig| Test { rig, commands: std::slice::from_ref(&command) }).collect();
    let options = BatchOptions::default();
    let outcomes = simulate_batch::<f64>(&tests, &options, |_, _| true).unwrap();
    for (rig, outcome) in rigs.iter().zip(outcomes) {
        let alone = simulate::<f64>(rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        assert_eq!(outcome.unwrap().samples, alone.status.len());
    }
}
