//! Protection of the specimen, shown on the rig with faults put in.
#![allow(clippy::unwrap_used)]

use eft::core::status::{DIVERGED, PROTECTION_WARNING, SHUT_DOWN, TRIPPED};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

const RATE: f64 = 4096.0;
/// When every fault begins (s).
const FAULT: f64 = 3.0;

fn sine() -> Command {
    sine_sweep(6000.0, 1.5, 1.5, 8.0, RATE).unwrap()
}

fn run(realization: &str, protected: bool, changes: &[(&str, Value)], command: &Command) -> TestRun {
    let mut all: Vec<(&str, Value)> = vec![
        ("controller.realization", realization.into()),
        ("protection.enabled", protected.into()),
        ("protection.force_warning", 9e3.into()),
        ("protection.force_trip", 12e3.into()),
        ("protection.displacement_trip", 0.1.into()),
        ("protection.spool_trip", 0.7.into()),
        ("protection.ramp_time", 0.3.into()),
        ("actuator.stop_stiffness", 1e8.into()),
        ("limits.valve_command", 10.0.into()),
    ];
    all.extend(changes.iter().cloned());
    let rig = RigConfig::zhao2005().replace(&all).unwrap();
    simulate::<f64>(&rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
}

fn fault(signal: &str, kind: &str) -> Vec<(&'static str, Value)> {
    vec![
        ("sensors.fault.signal", signal.into()),
        ("sensors.fault.kind", kind.into()),
        ("sensors.fault.start", FAULT.into()),
    ]
}

fn largest(values: &[f64], from: f64) -> f64 {
    values[(from * RATE) as usize..].iter().fold(0.0, |most: f64, v| most.max(v.abs()))
}

/// Time (s) of the first tick with a flag.
fn first(run: &TestRun, flag: u32) -> Option<f64> {
    run.status.iter().position(|s| s & flag != 0).map(|i| i as f64 / run.sample_rate)
}

#[test]
fn a_sound_test_is_left_alone() {
    for realization in ["analog", "digital"] {
        let (with, without) = (run(realization, true, &[], &sine()), run(realization, false, &[], &sine()));
        assert_eq!(first(&with, TRIPPED | SHUT_DOWN), None);
        let distance = with.force.iter().zip(&without.force).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(distance < 1e-6, "{realization}: {distance} N");
    }
}

#[test]
fn sensor_faults_and_wrong_signs_are_caught_before_the_specimen_is_hurt() {
    for realization in ["analog", "digital"] {
        for (signal, kind) in [
            ("force", "lost"),
            ("force", "sign"),
            ("force", "stuck"),
            ("velocity", "lost"),
            ("velocity", "sign"),
            ("spool", "lost"),
        ] {
            let bare = run(realization, false, &fault(signal, kind), &sine());
            let run = run(realization, true, &fault(signal, kind), &sine());
            let (before, after) =
                (largest(&run.force[..(FAULT * RATE) as usize], 0.0), largest(&run.force, FAULT));
            let end = largest(&run.force, 7.0);
            println!(
                "{realization} {signal} {kind}: tripped {:?}, shut {:?}, |F| before {before:.0}, after {after:.0}, at the end \
                 {end:.0}, unprotected {:.0} N; |x| {:.1} against {:.1} mm",
                first(&run, TRIPPED),
                first(&run, SHUT_DOWN),
                largest(&bare.force, FAULT),
                1e3 * largest(&run.displacement, FAULT),
                1e3 * largest(&bare.displacement, FAULT),
            );
            assert_eq!(run.status_union() & DIVERGED, 0);
            if first(&run, TRIPPED).is_some() {
                assert!(first(&run, TRIPPED) >= Some(FAULT));
                assert!(largest(&run.displacement, FAULT) <= 1.05 * largest(&bare.displacement, FAULT));
            } else {
                // A fault that trips nothing must not have led beyond the limits.
                assert!(
                    largest(
                        &run.measured_force()
                            .iter()
                            .map(|f| if f.is_nan() { 0.0 } else { *f })
                            .collect::<Vec<_>>(),
                        0.0
                    ) < 12e3
                );
            }
        }
    }
}

#[test]
fn oil_loss_is_survived() {
    let pressures: Value = Value::Array([1.9e7, 1.9e7, 5e5].map(Value::from).into());
    let times: Value = Value::Array([0.0, FAULT, FAULT + 0.2].map(Value::from).into());
    let loss = [("supply.schedule.times", times), ("supply.schedule.pressures", pressures)];
    let bare = run("digital", false, &loss, &sine());
    let run = run("digital", true, &loss, &sine());
    // The controller opens the valve further and further; the spool limit trips.
    let tripped = first(&run, TRIPPED);
    println!(
        "tripped {tripped:?}, |F| {} against {}, |v| at the end {}",
        largest(&run.force, FAULT),
        largest(&bare.force, FAULT),
        largest(&run.velocity, 7.0)
    );
    assert!(tripped.is_some_and(|t| t > FAULT && t < FAULT + 1.0), "{tripped:?}");
    // Without oil nothing takes the force away: the oil that is left in the chambers holds the specimen where it is.
    assert!(largest(&run.displacement, FAULT) <= 1.05 * largest(&bare.displacement, FAULT));
    assert!(largest(&run.velocity, 7.0) < 0.05);
}

#[test]
fn a_trip_lets_the_specimen_down_along_the_ramp() {
    for realization in ["analog", "digital"] {
        let trip =
            [("protection.force_trip", Value::from(5000.0)), ("protection.force_warning", 4000.0.into())];
        let run = run(realization, true, &trip, &sine());
        let (warned, tripped) = (first(&run, PROTECTION_WARNING).unwrap(), first(&run, TRIPPED).unwrap());
        assert!(warned < tripped && first(&run, SHUT_DOWN).is_none());
        // While the ramp runs the force follows it: frozen command times what is left.
        let start = (tripped * RATE) as usize;
        for part in [0.3, 0.6, 0.9] {
            let i = start + (part * 0.3 * RATE) as usize;
            let expected = run.command[start] * (1.0 - part);
            assert!((run.force[i] - expected).abs() < 500.0, "{realization} {part}: {} N", run.force[i]);
        }
        assert!(largest(&run.force, tripped + 2.0) < 300.0, "{}", largest(&run.force, tripped + 2.0));
    }
}

#[test]
fn start_and_end_are_soft() {
    let constant = Command::new(vec![5000.0; 8192], RATE).unwrap();
    let soft = [
        ("protection.start_time", Value::from(0.5)),
        ("protection.soft_end", true.into()),
        ("structure.damping", 1e5.into()),
    ];
    for realization in ["analog", "digital"] {
        let run = run(realization, true, &soft, &constant);
        for (time, expected) in [(0.25, 2500.0), (1.0, 5000.0), (2.0 - 0.15, 2500.0), (2.0 - 1.0 / RATE, 0.0)]
        {
            let force = run.force[(time * RATE) as usize];
            assert!((force - expected).abs() < 400.0, "{realization} at {time} s: {force} N");
        }
    }
}
