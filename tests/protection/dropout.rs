//! Sensors that lose single samples: a sound test goes on, and a failed velocity is followed as without losses.

use eft::core::Cause;
use eft::sim::excitation::sine_sweep;
use toml::Value;

use crate::matrix::{SIGNALS, fault, runs, seen};
use crate::sizes::{Bench, START, benches};

// SR-07
#[test]
fn lost_samples_are_no_contradiction() {
    let [Bench { rig, sine: [amplitude, frequency], .. }, ..] = &benches();
    for (rate, share) in [(512.0, 0.02), (1024.0, 0.05), (4096.0, 0.2)] {
        let command = sine_sweep(*amplitude, *frequency, *frequency, 12.0, rate).unwrap();
        let rigs: Vec<_> = SIGNALS
            .iter()
            .map(|signal| {
                let key = format!("sensors.{signal}.dropout");
                rig.replace(&[(key.as_str(), share.into()), ("controller.sample_rate", rate.into())]).unwrap()
            })
            .collect();
        for (signal, run) in SIGNALS.iter().zip(runs(&rigs, &command)) {
            assert_eq!(seen(&run, 0.0).cause, Cause::None, "{signal}, {rate} Hz");
        }
    }
}

#[test]
fn the_displacement_that_replaces_a_velocity_may_lose_samples() {
    for bench in benches() {
        let period = 1.0 / bench.sine[1];
        let faults = ["lost", "sign"]
            .into_iter()
            .flat_map(|kind| (0..6).map(move |moment| (kind, START + f64::from(moment) / 6.0 * period)));
        let rigs: Vec<_> = faults
            .clone()
            .map(|(kind, start)| {
                let mut changes = fault("velocity", kind, start);
                changes.push(("sensors.displacement.dropout", Value::from(0.1)));
                bench.rig.replace(&changes).unwrap()
            })
            .collect();
        for ((kind, start), run) in faults.zip(runs(&rigs, &bench.command())) {
            let force = seen(&run, start).force / bench.force_trip;
            assert!(force < 1.75, "{}: {kind} at {start} s: {force}", bench.name);
        }
    }
}
