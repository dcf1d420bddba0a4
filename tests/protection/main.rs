//! Protection of the specimen, tested on the virtual rig with faults.
#![allow(clippy::unwrap_used)]

use eft::core::Input;
use eft::core::status::{
    DIVERGED, INVALID_COMMAND, INVALID_MEASUREMENT, PROTECTION_WARNING, SHUT_DOWN, STUCK_MEASUREMENT, TRIPPED,
};
use eft::sim::closed_loop::{RigChannel, parameters};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

#[path = "../results/mod.rs"]
mod results;

mod dropout;
mod estimated;
mod matrix;
mod oscillation;
mod primed;
mod second;
mod sizes;
mod true_valve;
use results::keep;

const RATE: f64 = 4096.0;
/// Start of every fault (s).
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

// SR-07
#[test]
fn a_test_without_a_fault_does_not_trip() {
    for realization in ["analog", "digital"] {
        let (with, without) = (run(realization, true, &[], &sine()), run(realization, false, &[], &sine()));
        assert_eq!(first(&with, TRIPPED | SHUT_DOWN), None);
        let distance = with.force.iter().zip(&without.force).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(distance < 1e-6, "{realization}: {distance} N");
    }
}

// SR-07
#[test]
fn a_low_level_of_the_displacement_does_not_raise_an_alarm() {
    // Noise of 0.05 % of the stroke, and an eighth of the stroke as the level.
    let level = 0.016;
    let quiet = [
        ("protection.displacement_trip", level.into()),
        ("sensors.displacement.noise", (5e-4 * 0.127).into()),
        ("sensors.displacement.range", 0.127.into()),
        ("sensors.displacement.bits", 16.into()),
    ];
    for seed in 0..4 {
        let changes: Vec<_> = quiet.iter().cloned().chain([("sensors.seed", seed.into())]).collect();
        let small = sine_sweep(800.0, 1.5, 1.5, 4.0, RATE).unwrap();
        let run = run("digital", true, &changes, &small);
        assert_eq!(first(&run, TRIPPED | SHUT_DOWN), None, "{seed}");
        let moved = largest(&run.displacement, 0.0);
        assert!(moved > 0.4 * level && moved < 0.9 * level, "{moved} m");
    }
}

#[test]
fn sensor_faults_trip_before_a_large_displacement() {
    for realization in ["analog", "digital"] {
        let sound = run(realization, true, &[], &sine());
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
            let displacement = largest(&run.displacement, FAULT);
            keep(
                format_args!("{realization}, {signal} {kind}"),
                &[
                    ("tripped at", first(&run, TRIPPED).unwrap_or(f64::NAN)),
                    ("shut down at", first(&run, SHUT_DOWN).unwrap_or(f64::NAN)),
                    ("force", largest(&run.force, FAULT)),
                    ("displacement", displacement),
                ],
            );
            assert_eq!(run.status_union() & DIVERGED, 0);
            if first(&run, TRIPPED).is_some() {
                assert!(first(&run, TRIPPED) >= Some(FAULT));
                assert!(displacement <= 1.05 * largest(&sound.displacement, 0.0));
                assert!(largest(&run.force, FAULT) < 0.5 * largest(&bare.force, FAULT) || kind == "stuck");
            } else {
                // A fault without a trip must not lead beyond the limits.
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
fn a_lost_supply_trips() {
    let pressures: Value = Value::Array([1.9e7, 1.9e7, 5e5].map(Value::from).into());
    let times: Value = Value::Array([0.0, FAULT, FAULT + 0.2].map(Value::from).into());
    let loss = [("supply.schedule.times", times), ("supply.schedule.pressures", pressures)];
    let bare = run("digital", false, &loss, &sine());
    let run = run("digital", true, &loss, &sine());
    // The controller opens the valve further until the spool's level trips.
    let tripped = first(&run, TRIPPED);
    keep(
        "oil loss",
        &[("tripped at", tripped.unwrap_or(f64::NAN)), ("displacement", largest(&run.displacement, FAULT))],
    );
    assert!(tripped.is_some_and(|t| t > FAULT && t < FAULT + 1.0), "{tripped:?}");
    // Without a supply the force cannot decay: the remaining oil in the chambers holds the specimen in place.
    assert!(largest(&run.displacement, FAULT) <= 1.05 * largest(&bare.displacement, FAULT));
    assert!(largest(&run.velocity, 7.0) < 0.05);
}

#[test]
fn a_trip_ramps_the_force_to_zero() {
    for (realization, braked) in [("analog", false), ("digital", false), ("analog", true), ("digital", true)]
    {
        let trip = [
            ("protection.force_trip", Value::from(5000.0)),
            ("protection.force_warning", 4000.0.into()),
            ("protection.plausibility", braked.into()),
        ];
        let run = run(realization, true, &trip, &sine());
        let (warned, tripped) = (first(&run, PROTECTION_WARNING).unwrap(), first(&run, TRIPPED).unwrap());
        assert!(warned < tripped && first(&run, SHUT_DOWN).is_none());
        // During the ramp the force is the frozen command times the remaining share.
        let start = (tripped * RATE) as usize;
        let ramp = if braked { 0.1 } else { 0.3 };
        for part in [0.3, 0.6, 0.9] {
            let i = start + (part * ramp * RATE) as usize;
            let off = run.force[i] - run.command[start] * (1.0 - part);
            // The brake adds a force against the motion.
            let against = if braked { -off * run.velocity[i].signum() } else { -off.abs() };
            assert!(against > -500.0 && against < 4e3, "{realization} {part}: {off} N");
            assert!(braked || off.abs() < 500.0, "{realization} {part}: {off} N");
        }
        assert!(largest(&run.force, tripped + 2.0) < 300.0, "{}", largest(&run.force, tripped + 2.0));
    }
}

// SR-06
#[test]
fn a_trip_by_a_level_brakes_a_yielding_specimen() {
    let command = matrix::el_centro();
    let run = |plausibility: bool| {
        let changes = [
            ("protection.plausibility", Value::from(plausibility)),
            ("protection.force_trip", 8e3.into()),
            ("protection.ramp_time", 0.1.into()),
        ];
        let changes = [&changes[..], &matrix::yields()].concat();
        simulate::<f64>(
            &matrix::rig("digital", false, true, &changes),
            &command,
            &SimulateOptions::default(),
            |_, _| true,
        )
        .unwrap()
    };
    let [free, braked] = [run(false), run(true)];
    let tripped = first(&braked, TRIPPED).unwrap();
    assert_eq!(first(&free, TRIPPED), Some(tripped));
    let [free, braked] = [free, braked].map(|run| largest(&run.displacement, tripped));
    keep("trip by the force on a yielding specimen", &[("free", free), ("braked", braked)]);
    assert!(braked < 0.95 * free, "{braked} m, {free} m without the brake");
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

/// A refused sample holds the output and therefore an open valve, so a ramp of the command would have no effect.
#[test]
fn refused_samples_shut_down_like_lost_ones() {
    // The paper's sweep up to 3.75 Hz, past the structure's 1.58 Hz at 5.1 s.
    let sweep = |amplitude| sine_sweep(amplitude, 0.0, 3.75, 12.0, RATE).unwrap();
    let range = |signal, value: f64| vec![(signal, Value::from(value))];
    let mut velocity = fault("velocity", "lost");
    velocity[2].1 = 5.1.into();
    for realization in ["analog", "digital"] {
        // Without trip levels.
        let run = |amplitude, changes: &[(&str, Value)]| {
            let mut all = vec![
                ("controller.realization", Value::from(realization)),
                ("protection.enabled", true.into()),
                // It would continue without the sensor.
                ("protection.plausibility", false.into()),
            ];
            all.extend(changes.iter().cloned());
            let rig = RigConfig::zhao2005().replace(&all).unwrap();
            simulate::<f64>(&rig, &sweep(amplitude), &SimulateOptions::default(), |_, _| true).unwrap()
        };
        let sound = [run(2200.0, &[]), run(8900.0, &[])];
        for (name, amplitude, changes) in [
            ("velocity lost", 2200.0, velocity.clone()),
            ("spool beyond", 8900.0, range("limits.spool_range", 0.3)),
            ("force beyond", 8900.0, range("limits.force_range", 8e3)),
        ] {
            let run = run(amplitude, &changes);
            let (refused, shut) =
                (first(&run, INVALID_MEASUREMENT).unwrap(), first(&run, SHUT_DOWN).unwrap());
            let displacement = largest(&run.displacement, 0.0);
            keep(
                format_args!("refused samples, {realization}, {name}"),
                &[("refused from", refused), ("shut down at", shut), ("displacement", displacement)],
            );
            // The shutdown follows after ten samples.
            assert!(shut - refused < 3e-3);
            let sound = if amplitude < 3e3 { &sound[0] } else { &sound[1] };
            assert!(displacement < largest(&sound.displacement, 0.0), "{displacement} m");
            assert!(largest(&run.velocity, 11.0) < 2e-3, "{} m/s", largest(&run.velocity, 11.0));
        }
    }
}

/// The share of the configured supply pressure at a time.
type Supply = [(f64, f64)];

/// A sine whose supply follows points in time. It is measured and corrected.
fn on_supply(realization: &str, supply: &Supply, changes: &[(&str, Value)]) -> TestRun {
    let points = |of: fn(&(f64, f64)) -> f64| {
        Value::Array(supply.iter().map(|point| Value::from(of(point))).collect())
    };
    let mut all = vec![
        ("compensation.supply_correction", Value::from(true)),
        ("supply.schedule.times", points(|(time, _)| *time)),
        ("supply.schedule.pressures", points(|(_, share)| share * 19e6)),
    ];
    all.extend(changes.iter().cloned());
    run(realization, true, &all, &sine())
}

/// The last valid pressure replaces an invalid one, so the test continues as if the supply were not measured.
#[test]
fn a_lost_supply_pressure_is_held_flagged_and_does_not_trip() {
    let adaptive = [("compensation.adaptive", Value::from(true)), ("protection.fault_time", 1.0.into())];
    for realization in ["analog", "digital"] {
        for changes in [&[][..], &adaptive[..]] {
            for share in [1.0, 1.2] {
                let supply = [(0.0, share)];
                let sound = on_supply(realization, &supply, changes);
                for kind in ["lost", "zero"] {
                    let all = [fault("supply_pressure", kind), changes.to_vec()].concat();
                    let held = on_supply(realization, &supply, &all);
                    assert_eq!(first(&held, STUCK_MEASUREMENT), Some(FAULT), "{kind}");
                    assert_eq!(held.status_union() & (INVALID_MEASUREMENT | TRIPPED), 0, "{kind}");
                    let (there, here) = (largest(&held.force, FAULT), largest(&sound.force, FAULT));
                    assert!(
                        (there - here).abs() < 1e-3 * here,
                        "{kind}: {there} N, {here} N without a fault"
                    );
                }
            }
        }
    }
}

/// A held pressure below the true one would overcompensate the motion. Without the return to the configured one the
/// force of the fixed scheme reaches 248 kN.
#[test]
fn a_lost_low_supply_pressure_returns_to_the_configured_one() {
    for realization in ["analog", "digital"] {
        for (name, supply) in [
            ("stays low", &[(0.0, 0.8)][..]),
            ("rises", &[(0.0, 0.8), (FAULT, 0.8), (FAULT + 2.0, 1.0)][..]),
            ("falls", &[(0.0, 1.0), (FAULT, 1.0), (FAULT + 2.0, 0.8)][..]),
        ] {
            let lost = on_supply(realization, supply, &fault("supply_pressure", "lost"));
            let force = largest(&lost.force, FAULT);
            keep(format_args!("supply pressure lost, {realization}, {name}"), &[("force", force)]);
            assert_eq!(lost.status_union() & TRIPPED, 0, "{name}");
            assert!(force < 1.4 * 6e3, "{realization}, {name}: {force} N");
        }
    }
}

// SR-11
#[test]
fn a_lost_command_ramps_down_from_the_last_valid_one() {
    for realization in ["analog", "digital"] {
        let changes = [
            ("controller.realization", Value::from(realization)),
            ("protection.enabled", true.into()),
            ("protection.force_trip", 20e3.into()),
            ("protection.ramp_time", 0.05.into()),
            // The readings below are not those of a rig.
            ("protection.plausibility", false.into()),
        ];
        let rig = RigConfig::zhao2005().replace(&changes).unwrap();
        // Lost at the moment of the trip, or for long.
        for (lost, force) in [(1, 25e3), (400, 1e3)] {
            let mut channel = RigChannel::<f64>::new(&parameters(&rig, RATE).unwrap(), None).unwrap();
            let mut step = |command: f64, force: f64| {
                channel.step(&Input {
                    command,
                    velocity: 0.0,
                    force,
                    spool: 0.01,
                    displacement: 0.0,
                    ..Input::default()
                })
            };
            for _ in 0..200 {
                assert!((step(1e3, 1e3).permitted_command - 1e3).abs() < 1e-9);
            }
            let mut last = 1e3;
            for n in 0..400 {
                let out = if n < lost { step(f64::NAN, force) } else { step(1e3, 1e3) };
                assert!(out.permitted_command <= last + 1e-9, "{realization} {n}: {}", out.permitted_command);
                assert_eq!(out.status & INVALID_COMMAND != 0, n < lost);
                assert!(out.voltage.is_finite());
                last = out.permitted_command;
                // The loop itself is sound.
                assert_eq!((out.status & SHUT_DOWN, out.authority), (0, 1.0));
                assert_eq!(out.status & TRIPPED != 0, lost == 1 || n >= 10, "{n}");
            }
            assert!(last.abs() < 1e-9, "{last}");
        }
    }
}
