//! Faults on rigs that estimate their velocity, with the designed force loop, at moments over a swing.

use eft::core::Cause;
use eft::sim::RigConfig;
use toml::Value;

use crate::matrix::{KINDS, fault, runs, seen};
use crate::results::keep;
use crate::sizes::{Bench, START, benches};

const MOMENTS: usize = 4;
/// Standard gravity (m/s²).
const G: f64 = 9.80665;

/// The rig of a bench with an estimate of its velocity. The displacement of a derivative has little noise.
fn estimating(bench: &Bench, source: &str) -> RigConfig {
    let mut changes: Vec<(&str, Value)> =
        vec![("controller.velocity_source", source.into()), ("controller.observer_mass", 7040.0.into())];
    let mut lag = 0.0;
    if source == "derivative" {
        lag = 3.8e-3;
        changes.extend([
            ("sensors.displacement.noise", Value::from(3e-6)),
            ("protection.displacement_noise", 3e-6.into()),
            ("sensors.displacement.bits", 20.into()),
        ]);
    }
    if source == "accelerometer" {
        changes.extend([
            ("sensors.acceleration.noise", Value::from(1e-3 * G)),
            ("sensors.acceleration.range", (2.0 * G).into()),
            ("sensors.acceleration.bits", 16.into()),
            ("controller.observer_acceleration_noise", (1e-3 * G).into()),
        ]);
    }
    changes.push(("compensation.response_delay", (5e-3 + lag).into()));
    bench.rig.replace(&changes).unwrap()
}

// SR-20
#[test]
fn faults_without_a_velocity_sensor_stay_within_the_limits() {
    let [bench, ..] = benches();
    let command = bench.command();
    let [_, frequency] = bench.sine;
    let starts: [f64; MOMENTS] = std::array::from_fn(|n| START + n as f64 / (MOMENTS as f64 * frequency));
    for source in ["derivative", "observer", "accelerometer"] {
        let sound = estimating(&bench, source);
        let run = runs(std::slice::from_ref(&sound), &command).pop().unwrap();
        assert_eq!(seen(&run, 0.0).cause, Cause::None, "{source}");
        for signal in ["force", "displacement", "spool"] {
            let mut worst = [0.0_f64; 3];
            let faults = KINDS.into_iter().flat_map(|kind| starts.map(|start| (kind, start)));
            let failing = faults.clone().map(|(kind, start)| fault(signal, kind, start));
            let rigs: Vec<_> = failing.map(|fault| sound.replace(&fault).unwrap()).collect();
            for ((_, start), run) in faults.zip(runs(&rigs, &command)) {
                bench.worsen(&mut worst, &seen(&run, start));
            }
            let [noticed, force, displacement] = worst;
            assert!(noticed < 0.6 && force < 2.25 && displacement < 1.0, "{source}, {signal}: {worst:?}");
            keep(
                format_args!("without a velocity sensor, {source}: {signal}"),
                &[("noticed after", noticed), ("force over its level", force)],
            );
        }
    }
}
