//! Sensors that fail for a short time, with one flow gain and with the flow curve corrected. The estimates must return
//! to their earlier values soon afterwards.

use eft::core::status;
use eft::sim::excitation::Command;

use crate::results::keep;
use crate::rigs::*;

/// The sweep up to a time (s).
fn sweep_until(amplitude: f64, end: f64) -> Command {
    let values = sweep(amplitude).values[..(end * RATE) as usize].to_vec();
    Command { values, sample_rate: RATE }
}

// The controller has one sensor per signal, so it cannot compensate during the fault. The estimates must stay near
// their values, and the test must continue.
#[test]
fn a_failed_sensor_hardly_changes_the_estimates() {
    for (signal, kinds, duration) in [
        ("velocity", &["lost", "zero", "stuck", "sign"][..], 0.5),
        ("spool", &["lost", "zero", "stuck", "sign"], 0.5),
        ("force", &["lost", "zero", "stuck"], 0.2),
    ] {
        let cases: Vec<_> = kinds.iter().flat_map(|kind| EITHER.map(|curve| (kind, curve))).collect();
        let failing = |(kind, curve): &(&&str, bool)| {
            correcting(*curve, &[fault(signal, kind, 12.0, duration), noise(8)].concat())
        };
        let rigs: Vec<_> = cases.iter().map(failing).collect();
        for ((kind, curve), run) in cases.into_iter().zip(runs(&rigs, &sweep(2200.0))) {
            let (start, end) = (12 * 4096, if signal == "force" { run.force.len() } else { 14 * 4096 });
            let (gain, delay) = (run.flow_gain_estimate().samples(), run.response_delay_estimate().samples());
            let moved = |trace: &[f64]| moved(trace, trace[start], start..end);
            let what = format!("{signal} {kind}, {}", flow(curve));
            let found = curve_departure(&run, 1.0, 0.2);
            keep(
                &what,
                &[
                    ("gain", moved(&gain)),
                    ("delay", moved(&delay)),
                    ("curve", found),
                    ("displacement", largest(&run.displacement)),
                ],
            );
            assert!(moved(&gain) < 0.03, "{what}: {}", moved(&gain));
            assert!(signal == "force" || moved(&delay) < 1e-3, "{what}: {}", moved(&delay));
            assert!(signal != "force" || (gain[end - 1] - 1.0).abs() < 5e-3, "{what}: {}", gain[end - 1]);
            assert!(!curve || found < 0.01, "{what}: {found}");
            assert_ne!(run.status_union() & status::ADAPTATION_FROZEN, 0, "{what}");
            assert_eq!(run.status_union() & status::DIVERGED, 0, "{what}");
        }
    }
}

// At and near resonance, where a wrong flow gain causes the largest error.
#[test]
fn the_estimates_recover_from_a_short_fault() {
    let signals = ["velocity", "spool", "force"];
    let faults = signals.map(|signal| ["lost", "zero", "stuck", "sign"].map(|kind| (signal, kind))).concat();
    for (amplitude, start, duration) in
        [(2200.0, 4.7, 0.5), (2200.0, 5.1, 0.5), (8900.0, 5.3, 0.5), (8900.0, 6.0, 0.05)]
    {
        let failing = |(signal, kind): &(&str, &str)| adaptive(&fault(signal, kind, start, duration));
        let rigs: Vec<_> = faults.iter().map(failing).collect();
        for ((signal, kind), run) in faults.iter().zip(runs(&rigs, &sweep_until(amplitude, start + 8.0))) {
            let at = |seconds: f64| (seconds * RATE) as usize;
            let (before, settled, end) = (at(start), at(start + 3.0), run.force.len());
            let moved = |trace: &[f64]| moved(trace, trace[before], settled..end);
            let (gain, delay) =
                (moved(&run.flow_gain_estimate().samples()), moved(&run.response_delay_estimate().samples()));
            let what = format!("{signal} {kind}, {amplitude} N, {start} s, {duration} s");
            keep(&what, &[("gain", gain), ("delay", delay)]);
            // Without its sensor the force is not controlled, and it oscillates for some time afterwards.
            let (most_gain, most_delay) = if *signal == "force" { (0.02, 2e-3) } else { (0.01, 5e-4) };
            assert!(gain < most_gain, "{what}: gain {gain}");
            assert!(delay < most_delay, "{what}: delay {delay}");
        }
    }
}

// Without its sensor the force becomes large, and openings are visited that no sound motion visits again.
#[test]
fn a_fault_of_the_force_leaves_an_error_in_the_curve_that_decreases() {
    for kind in ["lost", "zero", "stuck", "sign"] {
        for (amplitude, start) in [(2200.0, 4.7), (2200.0, 5.1), (8900.0, 5.3)] {
            let rig = correcting(true, &fault("force", kind, start, 0.5));
            let run = run(&rig, &sweep_until(amplitude, start + 12.0));
            let at = |seconds: f64| ((start + seconds) * RATE) as usize;
            let gain = run.flow_gain_estimate().samples();
            let moved = |from: f64| moved(&gain, gain[at(-0.01)], at(from)..gain.len());
            let what = format!("force {kind}, {amplitude} N, {start} s, curve corrected");
            keep(&what, &[("gain after 3 s", moved(3.0)), ("after 8 s", moved(8.0))]);
            assert!(moved(3.0) < 0.1 && moved(8.0) < 0.05, "{what}: {} {}", moved(3.0), moved(8.0));
        }
    }
}

// At and near resonance, where every signal is large. A fault that ends before it is noticed leaves an error.
#[test]
fn the_curve_recovers_from_a_short_fault() {
    for (amplitude, start, duration, most) in [
        (2200.0, 4.7, 0.5, 0.01),
        (2200.0, 5.5, 0.5, 0.01),
        (8900.0, 5.5, 0.5, 0.01),
        (8900.0, 6.0, 0.05, 0.06),
    ] {
        let sound = run(&correcting(true, &[]), &sweep_until(amplitude, start));
        let table = &sound.rig.servovalve.flow_table.flows;
        for signal in ["velocity", "spool"] {
            for kind in ["lost", "zero", "stuck", "sign"] {
                let failing = correcting(true, &fault(signal, kind, start, duration));
                let run = run(&failing, &sweep_until(amplitude, start + 4.0));
                let pairs = run.found_flows.iter().zip(&sound.found_flows).zip(table);
                let moved = pairs.fold(0.0_f64, |moved, ((found, before), flow)| {
                    if *flow == 0.0 { moved } else { moved.max(((found - before) / flow).abs()) }
                });
                let what = format!("curve after {signal} {kind}, {amplitude} N, {start} s, {duration} s");
                keep(&what, &[("moved", moved)]);
                assert!(moved < most, "{what}: {moved}");
            }
        }
    }
}

// The fault lasts longer than the means are held. They are then wrong and must recover.
#[test]
fn learning_continues_after_a_long_fault() {
    for signal in ["velocity", "spool"] {
        let changes = [fault(signal, "stuck", 8.3, 6.0), vec![flow_gain(0.95)]].concat();
        let run = run(&adaptive(&changes), &sweep(2200.0));
        let end = run.force.len();
        let frozen = |from: usize| run.status[from..].iter().any(|s| s & status::ADAPTATION_FROZEN != 0);
        assert!(frozen(10 * 4096) && !frozen(end - 8 * 4096), "{signal}");
        let gain = run.flow_gain_estimate().at(end - 1);
        assert!((gain - 0.95).abs() < 0.01, "{signal}: {gain}");
    }
}

#[test]
fn single_lost_samples_cost_little() {
    let lossy = ["force", "velocity", "spool"].map(|signal| set(&format!("sensors.{signal}.dropout"), 1e-3));
    for (curve, most) in [(false, 0.01), (true, 0.011)] {
        let rig = correcting(curve, &[lossy.to_vec(), vec![flow_gain(0.95)]].concat());
        let run = run(&rig, &sweep(8900.0));
        assert!(error(&run) < most, "{}: {}", flow(curve), error(&run));
        assert_within("lost samples", ratio(&run, 0.5, 9.5), 0.97, 1.03);
    }
}

#[test]
fn a_velocity_offset_does_not_lower_the_level() {
    let rest = vec![0.0; 20 * 4096];
    let command = Command { values: [rest, sweep(8900.0).values].concat(), sample_rate: RATE };
    let run = run(&adaptive(&[set("sensors.velocity.bias", 1e-3)]), &command);
    assert!(run.level().values().iter().all(|level| *level > 0.99));
}
