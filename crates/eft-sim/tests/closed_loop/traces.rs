//! The traces of a test.

use eft_sim::closed_loop::{Fallback, TRACES, Values};
use eft_sim::excitation::sine_sweep;
use eft_sim::{RigConfig, SimulateOptions, TestRun, simulate};

fn run(changes: &[(&str, toml::Value)]) -> TestRun {
    let rig = RigConfig::zhao2005().replace(changes).unwrap();
    let command = sine_sweep(4000.0, 0.5, 6.0, 1.0, 4096.0).unwrap();
    simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap()
}

#[test]
fn names_are_unique_and_a_replacement_is_a_trace() {
    for (i, trace) in TRACES.iter().enumerate() {
        assert!(TRACES[..i].iter().all(|other| other.name != trace.name), "{}", trace.name);
        if let Fallback::Same(other) = trace.fallback {
            assert!(TRACES.iter().any(|trace| trace.name == other), "{}", trace.name);
        }
    }
}

#[test]
fn a_test_records_what_can_change() {
    let mut plain = run(&[]);
    assert_eq!((plain.force.len(), plain.supply_pressure.len(), plain.level().len()), (4096, 0, 0));
    assert_eq!(plain.measured_force(), plain.force);
    let rig = plain.rig.clone();
    let mut values = |name: &str| {
        let trace = TRACES.iter().find(|trace| trace.name == name).unwrap();
        match plain.values(trace, &rig) {
            Values::Constant(value) => Some(value),
            _ => None,
        }
    };
    assert_eq!(values("supply_pressure"), Some(1.9e7));
    assert_eq!(values("test_ratio"), Some(0.0));
    assert_eq!(values("acceleration"), None);
    let noisy = run(&[("sensors.force.noise", 20.0.into()), ("actuator.friction", 10.0.into())]);
    assert_eq!((noisy.measured_force.len(), noisy.supply_pressure.len()), (4096, 4096));
    assert!(noisy.acceleration.is_empty() && noisy.estimates().is_none());
}

#[test]
fn a_measured_load_pressure_of_ideal_sensors_is_the_true_one() {
    let measured =
        run(&[("protection.enabled", true.into()), ("protection.load_pressure_tolerance", 1e6.into())]);
    assert!(!measured.load_pressure.is_empty());
    assert_eq!(measured.measured_load_pressure(), measured.load_pressure);
    assert_eq!(measured.measured_force(), measured.force);
    assert!(run(&[]).measured_load_pressure().is_empty());
}

#[test]
fn the_test_ratio_is_held_over_the_ticks_of_a_window() {
    let run = run(&[("compensation.adaptive", true.into())]);
    let window = 16;
    let (held, ratios) = (run.test_ratio(), run.test_ratio().samples());
    assert_eq!((held.len(), ratios.len()), (run.force.len(), run.force.len()));
    assert!((0..held.len()).all(|tick| held.at(tick).to_bits() == ratios[tick].to_bits()));
    assert!(held.starts().iter().zip(held.values()).all(|(&tick, value)| held.at(tick) == value));
    assert!(held.starts().len() <= held.len() / 16 + 1);
    let steps = ratios.windows(2).enumerate().filter(|(_, pair)| pair[0] != pair[1]);
    let at: Vec<usize> = steps.map(|(i, _)| i + 1).collect();
    assert!(at.len() > 100 && at.iter().all(|i| i % window == 0), "{at:?}");
    assert_eq!(run.estimates().unwrap().last().unwrap(), &("test_ratio", run.test_ratio().last().unwrap()));
}
