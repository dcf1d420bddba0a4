//! Every way in which one of the four sensors fails, on both schemes: when it is noticed, and what the specimen sees.

use eft::core::Cause;
use eft::core::status::{TRIPPED, cause};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

use crate::results::keep;

const RATE: f64 = 4096.0;
pub(crate) const SIGNALS: [&str; 4] = ["force", "displacement", "velocity", "spool"];
pub(crate) const KINDS: [&str; 4] = ["lost", "zero", "stuck", "sign"];
const FORCE_TRIP: f64 = 20e3;
const DISPLACEMENT_TRIP: f64 = 0.115;

fn noise() -> Vec<(String, Value)> {
    let ranges = [("force", 156e3), ("displacement", 0.127), ("velocity", 1.05), ("spool", 1.0)];
    ranges
        .iter()
        .flat_map(|(sensor, range)| {
            [
                (format!("sensors.{sensor}.noise"), Value::from(5e-4 * range)),
                (format!("sensors.{sensor}.range"), Value::from(*range)),
                (format!("sensors.{sensor}.bits"), Value::from(16)),
            ]
        })
        .collect()
}

pub(crate) fn rig(realization: &str, adaptive: bool, noisy: bool, changes: &[(&str, Value)]) -> RigConfig {
    let mut all: Vec<(&str, Value)> = vec![
        ("controller.realization", realization.into()),
        ("compensation.adaptive", adaptive.into()),
        ("compensation.feedforward", adaptive.into()),
        ("protection.enabled", true.into()),
        ("protection.force_trip", FORCE_TRIP.into()),
        ("protection.displacement_trip", DISPLACEMENT_TRIP.into()),
        ("protection.velocity_trip", 1.2.into()),
        ("protection.spool_trip", 0.8.into()),
        ("actuator.stop_stiffness", 1e8.into()),
        ("limits.valve_command", 10.0.into()),
    ];
    all.extend(changes.iter().cloned());
    let noise = noise();
    if noisy {
        all.extend(noise.iter().map(|(key, value)| (key.as_str(), value.clone())));
    }
    RigConfig::zhao2005().replace(&all).unwrap()
}

pub(crate) fn run(rig: &RigConfig, command: &Command) -> TestRun {
    simulate::<f64>(rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
}

pub(crate) fn fault(signal: &str, kind: &str, start: f64) -> Vec<(&'static str, Value)> {
    vec![
        ("sensors.fault.signal", signal.into()),
        ("sensors.fault.kind", kind.into()),
        ("sensors.fault.start", start.into()),
    ]
}

pub(crate) struct Seen {
    pub(crate) noticed: Option<f64>,
    pub(crate) cause: Cause,
    pub(crate) force: f64,
    pub(crate) displacement: f64,
}

pub(crate) fn seen(run: &TestRun, start: f64) -> Seen {
    let from = (start * RATE) as usize;
    let largest = |values: &[f64]| values[from..].iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let tripped = run.status.iter().position(|s| s & TRIPPED != 0);
    Seen {
        noticed: tripped.map(|i| i as f64 / RATE - start),
        cause: run.status.last().map_or(Cause::None, |s| cause(*s)),
        force: largest(&run.force),
        displacement: largest(&run.displacement),
    }
}

/// A sine of 6 kN near the structure's resonance; faults come at a zero of force and displacement, at a peak of the force,
/// and between.
fn sine() -> Command {
    sine_sweep(6000.0, 1.5, 1.5, 4.6, RATE).unwrap()
}

const MOMENTS: [f64; 3] = [3.0, 3.08, 3.17];

#[test]
fn no_single_fault_of_a_sensor_hurts_the_specimen() {
    for (realization, noisy) in [("digital", false), ("digital", true), ("analog", true)] {
        for adaptive in [false, true] {
            let sound = seen(&run(&rig(realization, adaptive, noisy, &[]), &sine()), 0.0);
            assert_eq!((sound.noticed, sound.cause), (None, Cause::None), "{realization} {noisy} {adaptive}");
            for signal in SIGNALS {
                for kind in KINDS {
                    let what = format!("{realization}, noise {noisy}, adaptive {adaptive}: {signal} {kind}");
                    let mut worst = [0.0_f64; 3];
                    for start in MOMENTS {
                        let changes = fault(signal, kind, start);
                        let s = seen(&run(&rig(realization, adaptive, noisy, &changes), &sine()), start);
                        let noticed = s.noticed.unwrap_or(f64::INFINITY);
                        assert!((0.0..0.6).contains(&noticed), "{what} at {start}: noticed after {noticed}");
                        assert!(s.force < 1.75 * FORCE_TRIP, "{what} at {start}: {} N", s.force);
                        assert!(
                            s.displacement < DISPLACEMENT_TRIP,
                            "{what} at {start}: {} m",
                            s.displacement
                        );
                        assert_eq!(s.cause, blamed(signal, kind, s.cause), "{what} at {start}");
                        // Where there is a force to be of the wrong sign.
                        if signal == "force" && (kind == "zero" || kind == "sign") && start > 3.0 {
                            assert!(noticed < 0.02, "{what} at {start}: noticed after {noticed}");
                        }
                        for (most, value) in worst.iter_mut().zip([noticed, s.force, s.displacement]) {
                            *most = most.max(value);
                        }
                    }
                    if noisy {
                        let [noticed, force, displacement] = worst;
                        keep(
                            format_args!("worst of three moments, {what}"),
                            &[("noticed after", noticed), ("force", force), ("displacement", displacement)],
                        );
                    }
                }
            }
        }
    }
}

/// The cause that names the sensor: it is lost, or it lies.
fn blamed(signal: &str, kind: &str, named: Cause) -> Cause {
    let lost = kind == "lost";
    match signal {
        "force" if lost => Cause::ForceLost,
        "force" => Cause::ForceImplausible,
        "displacement" if lost => Cause::DisplacementLost,
        "displacement" => Cause::DisplacementImplausible,
        "velocity" if lost => Cause::VelocityLost,
        "velocity" => Cause::VelocityImplausible,
        "spool" if lost => Cause::SpoolLost,
        "spool" => Cause::SpoolImplausible,
        _ => named,
    }
}
