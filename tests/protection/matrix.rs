//! Every kind of fault of each of the four sensors, in both schemes: the time to notice it, force and displacement.

use eft::core::Cause;
use eft::core::status::{STUCK_MEASUREMENT, TRIPPED, cause};
use eft::sim::batch::{BatchOptions, Test, simulate_batch};
use eft::sim::excitation::{Command, effective_force, sine_sweep};
use eft::sim::records::read_record;
use eft::sim::{RigConfig, SimulateOptions, TestRun, ideal_response};
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

/// The tests of some rigs under one command, side by side.
pub(crate) fn runs(rigs: &[RigConfig], command: &Command) -> Vec<TestRun> {
    let commands = std::slice::from_ref(command);
    let tests: Vec<_> = rigs.iter().map(|rig| Test { rig, commands }).collect();
    let options = BatchOptions { traces: true, ..BatchOptions::default() };
    let outcomes = simulate_batch::<f64>(&tests, &options, |_, _| true).unwrap();
    outcomes.into_iter().flat_map(|outcome| outcome.unwrap().runs).collect()
}

pub(crate) fn fault(signal: &str, kind: &str, start: f64) -> Vec<(&'static str, Value)> {
    let mut changes: Vec<(&str, Value)> = vec![
        ("sensors.fault.signal", signal.into()),
        ("sensors.fault.kind", kind.into()),
        ("sensors.fault.start", start.into()),
    ];
    if kind == "gain" {
        // 10 % too much for a second.
        changes.extend([("sensors.fault.gain", Value::from(1.1)), ("sensors.fault.duration", 1.0.into())]);
    }
    changes
}

/// A fault of half a second.
fn transient(signal: &str, kind: &str, start: f64) -> Vec<(&'static str, Value)> {
    let mut changes = fault(signal, kind, start);
    changes.retain(|(key, _)| *key != "sensors.fault.duration");
    changes.push(("sensors.fault.duration", 0.5.into()));
    changes
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

/// A sine of 6 kN near the structure's resonance; faults come at a zero of force and displacement, at a peak of the
/// force, and between.
fn sine() -> Command {
    sine_sweep(6000.0, 1.5, 1.5, 4.6, RATE).unwrap()
}

const MOMENTS: [f64; 3] = [3.0, 3.08, 3.17];

// SR-02, SR-03, SR-04, SR-07
#[test]
fn single_sensor_faults_stay_within_the_limits() {
    for (realization, noisy) in [("digital", false), ("digital", true), ("analog", true)] {
        for adaptive in [false, true] {
            let faults: Vec<_> =
                SIGNALS.into_iter().flat_map(|signal| KINDS.map(|kind| (signal, kind))).collect();
            let failing = faults.iter().flat_map(|(signal, kind)| {
                MOMENTS.map(|start| rig(realization, adaptive, noisy, &fault(signal, kind, start)))
            });
            let mut rigs: Vec<_> = failing.collect();
            rigs.push(rig(realization, adaptive, noisy, &[]));
            let mut runs = runs(&rigs, &sine());
            let sound = seen(&runs.pop().unwrap(), 0.0);
            assert_eq!((sound.noticed, sound.cause), (None, Cause::None), "{realization} {noisy} {adaptive}");
            for ((signal, kind), runs) in faults.into_iter().zip(runs.chunks(MOMENTS.len())) {
                let what = format!("{realization}, noise {noisy}, adaptive {adaptive}: {signal} {kind}");
                let mut worst = [0.0_f64; 3];
                for (start, run) in MOMENTS.into_iter().zip(runs) {
                    let s = seen(run, start);
                    let noticed = s.noticed.unwrap_or(f64::INFINITY);
                    assert!((0.0..0.6).contains(&noticed), "{what} at {start}: noticed after {noticed}");
                    assert!(s.force < 1.75 * FORCE_TRIP, "{what} at {start}: {} N", s.force);
                    assert!(s.displacement < DISPLACEMENT_TRIP, "{what} at {start}: {} m", s.displacement);
                    assert_eq!(s.cause, blamed(signal, kind, s.cause), "{what} at {start}");
                    // A wrong sign is visible if there is a force. Noise that stops is visible at any time.
                    let sign = signal == "force" && kind == "sign" && start > 3.0;
                    if sign || (noisy && (kind == "zero" || kind == "stuck")) {
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

/// Chamber pressures with noise and a gain error of 2 %.
fn pressures() -> [(&'static str, Value); 3] {
    [
        ("protection.load_pressure_tolerance", 500.0.into()),
        ("sensors.load_pressure.noise", 1e4.into()),
        ("sensors.load_pressure.gain", 1.02.into()),
    ]
}

// SR-18
/// In a play the true force is zero while its command goes on, as the reading of a load cell without its supply.
#[test]
fn a_play_of_the_attachment_is_no_fault_of_the_load_cell() {
    for (realization, adaptive) in [("digital", false), ("digital", true), ("analog", true)] {
        let rigs = [1e-4, 2e-4, 3e-4].map(|play: f64| {
            let changes =
                [("truth.actuator.attachment_play", play.into()), ("sensors.motion_at", "structure".into())];
            rig(realization, adaptive, true, &changes)
        });
        for run in runs(&rigs, &sine()) {
            assert_eq!(seen(&run, 0.0).cause, Cause::None, "{realization} {adaptive}");
        }
    }
}

#[test]
fn a_measured_load_pressure_reveals_a_wrong_force_at_every_moment() {
    for (realization, adaptive) in [("digital", false), ("analog", true)] {
        let pressures = pressures();
        let with =
            |changes: &[(&str, Value)]| rig(realization, adaptive, true, &[&pressures[..], changes].concat());
        assert_eq!(seen(&runs(&[with(&[])], &sine())[0], 0.0).cause, Cause::None);
        for kind in ["zero", "stuck", "sign"] {
            let mut worst = [0.0_f64; 3];
            let starts: [f64; 16] = std::array::from_fn(|n| 3.0 + n as f64 / 24.0);
            let rigs = starts.map(|start| with(&fault("force", kind, start)));
            for (start, run) in starts.into_iter().zip(runs(&rigs, &sine())) {
                let s = seen(&run, start);
                let noticed = s.noticed.unwrap_or(f64::INFINITY);
                assert!(noticed < 0.02, "{realization} {adaptive} {kind} at {start}: {noticed} s");
                assert_eq!(s.cause, Cause::ForceImplausible);
                for (most, value) in worst.iter_mut().zip([noticed, s.force, s.displacement]) {
                    *most = most.max(value);
                }
            }
            let [noticed, force, displacement] = worst;
            assert!(force < 1.75 * FORCE_TRIP && displacement < DISPLACEMENT_TRIP, "{kind}: {force} N");
            keep(
                format_args!("force {kind} with a load pressure, {realization}, adaptive {adaptive}"),
                &[("noticed after", noticed), ("force", force), ("displacement", displacement)],
            );
        }
    }
}

// SR-18
#[test]
fn a_failed_load_pressure_is_flagged_and_the_test_goes_on() {
    for realization in ["digital", "analog"] {
        let pressures = pressures();
        let with =
            |changes: &[(&str, Value)]| rig(realization, false, true, &[&pressures[..], changes].concat());
        let faults: Vec<_> = ["lost", "zero", "stuck"]
            .into_iter()
            .flat_map(|kind| MOMENTS.map(|start| (kind, start)))
            .collect();
        let mut rigs: Vec<_> =
            faults.iter().map(|(kind, start)| with(&fault("load_pressure", kind, *start))).collect();
        rigs.push(with(&[]));
        let mut runs = runs(&rigs, &sine());
        let sound = runs.pop().unwrap();
        assert_eq!(sound.status_union() & STUCK_MEASUREMENT, 0);
        for ((kind, start), run) in faults.into_iter().zip(runs) {
            assert_eq!(seen(&run, start).noticed, None, "{kind} at {start}");
            let flagged = run.status.iter().position(|s| s & STUCK_MEASUREMENT != 0);
            let after = flagged.map_or(f64::INFINITY, |tick| tick as f64 / RATE - start);
            assert!((0.0..0.02).contains(&after), "{kind} at {start}: flagged after {after} s");
            assert_eq!(run.force, sound.force);
        }
    }
}

/// The cause that names the sensor as lost or implausible.
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

/// Worst time (s) to notice, force (N) and displacement (m) of faults at eight moments of a swing.
fn worst_of_a_swing(kind: &str, realization: &str, adaptive: bool) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    let starts: [f64; 8] = std::array::from_fn(|n| 3.0 + n as f64 / 12.0);
    let rigs = starts.map(|start| rig(realization, adaptive, true, &fault("velocity", kind, start)));
    for (start, run) in starts.into_iter().zip(runs(&rigs, &sine())) {
        let s = seen(&run, start);
        let found = [s.noticed.unwrap_or(f64::INFINITY), s.force, s.displacement];
        for (most, value) in most.iter_mut().zip(found) {
            *most = most.max(value);
        }
    }
    let what = format!("velocity {kind}, {realization}, adaptive {adaptive}");
    let [noticed, force, displacement] = most;
    keep(&what, &[("noticed after", noticed), ("force", force), ("displacement", displacement)]);
    most
}

// SR-08
#[test]
fn a_velocity_of_wrong_gain_or_sign_is_noticed_at_every_moment_of_a_swing() {
    for (realization, adaptive) in [("digital", false), ("digital", true), ("analog", true)] {
        for kind in ["gain", "sign"] {
            let [noticed, force, displacement] = worst_of_a_swing(kind, realization, adaptive);
            let what = format!("{kind}, {realization}, adaptive {adaptive}: {noticed} s, {force} N");
            assert!(noticed < 0.2 && force < 1.75 * FORCE_TRIP && displacement < DISPLACEMENT_TRIP, "{what}");
        }
    }
}

/// El Centro's effective force.
pub(crate) fn el_centro() -> Command {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/python/eft/data/RSN6_IMPVALL.I_I-ELC180-hor1.AT2");
    effective_force(&read_record(path).unwrap(), 7040.0, RATE, 1.0).unwrap()
}

/// A specimen that yields at 15 mm.
pub(crate) fn yields() -> [(&'static str, Value); 5] {
    [
        ("structure.kind", "bouc_wen".into()),
        ("structure.bouc_wen.yield_displacement", 0.015.into()),
        ("structure.bouc_wen.post_yield_ratio", 0.1.into()),
        ("structure.bouc_wen.exponent", 2.0.into()),
        ("structure.bouc_wen.shape", 0.5.into()),
    ]
}

// SR-06
#[test]
fn a_fast_yielding_specimen_is_braked_after_a_trip() {
    let mut command = el_centro();
    let sound = rig("digital", false, true, &yields());
    let ideal = ideal_response(&sound, &command, &SimulateOptions::default()).unwrap();
    let ideal = ideal.displacement.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // The specimen moves at 0.39 m/s then, and the earthquake would have braked it.
    let starts = [2.18, 2.21, 2.227];
    command.values.truncate(((starts[2] + 3.0) * RATE) as usize);
    let signals = ["displacement", "velocity", "spool"];
    for (force_loop, adaptive) in [("pd", false), ("pd", true), ("robust", false), ("robust", true)] {
        let faults = signals.into_iter().flat_map(|signal| starts.map(|start| (signal, start)));
        let rigs = faults.clone().map(|(signal, start)| {
            let lost = transient(signal, "lost", start);
            let designed = [("controller.force_loop", force_loop.into())];
            rig("digital", adaptive, true, &[&lost[..], &yields(), &designed].concat())
        });
        let mut worst = [0.0_f64; 3];
        for ((signal, start), run) in faults.clone().zip(runs(&rigs.collect::<Vec<_>>(), &command)) {
            let ratio = seen(&run, start).displacement / ideal;
            assert!(ratio < 1.2, "{signal} at {start}, {force_loop}, adaptive {adaptive}: {ratio}");
            let place = signals.iter().position(|known| *known == signal).unwrap();
            worst[place] = worst[place].max(ratio);
        }
        let what = format!("yielding specimen in El Centro, {force_loop}, adaptive {adaptive}");
        let kept: Vec<_> = signals.into_iter().zip(worst).collect();
        keep(what, &kept);
    }
}

// SR-06
#[test]
fn a_fault_that_trips_the_force_level_does_not_push_a_yielding_specimen_further() {
    let mut command = el_centro();
    let sound = rig("digital", false, true, &yields());
    let ideal = ideal_response(&sound, &command, &SimulateOptions::default()).unwrap();
    let ideal = ideal.displacement.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // The velocity reads 10 % too much. The force reaches its level before the ratio of the motions is noticed.
    let start = 2.033;
    command.values.truncate(((start + 3.0) * RATE) as usize);
    let changes = [&transient("velocity", "gain", start)[..], &yields()].concat();
    let s = seen(&runs(&[rig("digital", false, true, &changes)], &command)[0], start);
    assert_eq!(s.cause, Cause::ForceLevel);
    let most = s.displacement / ideal;
    keep("yielding specimen in El Centro, force level", &[("displacement over the ideal one", most)]);
    assert!(most < 1.2, "{most}");
}

// SR-06
#[test]
fn a_fault_does_not_push_a_yielding_specimen_further() {
    let yields = yields();
    // 1.5 times the force at yield, near its resonance.
    let command = sine_sweep(15e3, 1.0, 1.0, 3.5, RATE).unwrap();
    let sound = rig("digital", false, true, &yields);
    let ideal = ideal_response(&sound, &command, &SimulateOptions::default()).unwrap();
    let ideal = ideal.displacement.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let faults = SIGNALS.into_iter().flat_map(|signal| KINDS.map(|kind| (signal, kind)));
    for (signal, kind) in faults.chain([("velocity", "gain")]) {
        let starts: [f64; 6] = std::array::from_fn(|n| 1.5 + n as f64 / 12.0);
        let rigs = starts.map(|start| {
            let changes = [&transient(signal, kind, start)[..], &yields].concat();
            rig("digital", false, true, &changes)
        });
        let moved =
            starts.into_iter().zip(runs(&rigs, &command)).map(|(start, run)| seen(&run, start).displacement);
        let most = moved.fold(0.0, f64::max) / ideal;
        keep(
            format_args!("yielding specimen, {signal} {kind}"),
            &[("displacement over the ideal one", most)],
        );
        assert!(most < 1.2, "{signal} {kind}: {most}");
    }
}

// SR-12
#[test]
fn a_bypass_valve_lowers_the_force_of_a_closed_valve() {
    let force = |further: &[(&'static str, Value)]| {
        let closes = [("protection.plausibility", false.into()), ("protection.shutdown_time", 0.1.into())];
        let starts: [f64; 6] = std::array::from_fn(|n| 3.0 + n as f64 / 12.0);
        let rigs = starts.map(|start| {
            let changes = [&fault("force", "lost", start), &closes[..], further].concat();
            rig("digital", false, true, &changes)
        });
        let seen = starts.into_iter().zip(runs(&rigs, &sine())).map(|(start, run)| seen(&run, start).force);
        seen.fold(0.0, f64::max)
    };
    let bypass = ("actuator.bypass_flow", Value::from(4e-3));
    let closed = force(&[]);
    let [late, early] =
        [0.05, 0.02].map(|time: f64| force(&[bypass.clone(), ("actuator.bypass_time", time.into())]));
    keep("valve closed in 0.1 s", &[("force", closed), ("bypass in 50 ms", late), ("in 20 ms", early)]);
    assert!(late < 0.5 * closed && early < 0.5 * closed, "{closed} {late} {early}");
}
