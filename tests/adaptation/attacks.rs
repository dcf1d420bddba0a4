//! Self-calibration under disturbances, with one flow gain and with the flow curve corrected: no motion, saturation,
//! offsets, a falling supply, a wrong sign that persists.

use eft::core::status;
use eft::sim::excitation::{Command, effective_force};
use eft::sim::records::read_record;

use crate::results::keep;
use crate::rigs::*;

#[test]
fn nothing_is_learned_in_minutes_without_motion() {
    let (moving, silence) = (sweep(2200.0).values, vec![0.0; (180.0 * RATE) as usize]);
    let command = |parts: &[&[f64]]| Command { values: parts.concat(), sample_rate: RATE };
    let changes = [noise(7), vec![flow_gain(1.07)]].concat();
    for curve in EITHER {
        let rig = correcting(curve, &changes);
        let (moved, silent) = (run(&rig, &command(&[&moving])), run(&rig, &command(&[&moving, &silence])));
        let (before, after) = (32 * 4096 + 4096, (32 + 180) * 4096 - 1);
        let (gain, delay) =
            (silent.flow_gain_estimate().samples(), silent.response_delay_estimate().samples());
        assert!((gain[after] - gain[before]).abs() < 1e-3, "{} {}", gain[before], gain[after]);
        assert!((delay[after] - delay[before]).abs() < 1e-4, "{} {}", delay[before], delay[after]);
        for (a, b) in moved.found_flows.iter().zip(&silent.found_flows) {
            assert!((a - b).abs() <= 2e-3 * a.abs(), "{a} {b}");
        }
    }
}

#[test]
fn a_spool_offset_does_not_change_the_flow_gain() {
    for curve in EITHER {
        for bias in [0.01, -0.01] {
            let changes = [set("sensors.spool.bias", bias), flow_gain(0.95)];
            let run = run(&correcting(curve, &changes), &sweep(2200.0));
            let (least, largest) = ratio(&run, 0.5, 9.5);
            let found = curve_departure(&run, 0.95, 0.15);
            keep(
                format_args!("spool offset {bias}, {}", flow(curve)),
                &[("least", least), ("largest", largest), ("curve", found)],
            );
            assert_within("spool offset of 1 %", (least, largest), 0.95, 1.05);
        }
    }
}

#[test]
fn falling_supply_is_followed_with_and_without_a_transducer() {
    let falling = [
        set("supply.schedule.times", vec![0.0, 2.0, 22.0]),
        set("supply.schedule.pressures", vec![1.9e7, 1.9e7, 0.8 * 1.9e7]),
    ];
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/python/eft/data/RSN6_IMPVALL.I_I-ELC180-hor1.AT2");
    let command = effective_force(&read_record(path).unwrap(), 7040.0, RATE, 1.0).unwrap();
    let constant = error(&run(&adaptive(&[]), &command));
    for transducer in [true, false] {
        let changes = [falling.to_vec(), vec![set("compensation.supply_correction", transducer)]].concat();
        let falling = error(&run(&adaptive(&changes), &command));
        keep(
            format_args!("falling supply, transducer {transducer}"),
            &[("NRMSE", falling), ("constant supply", constant)],
        );
        assert!(falling <= 1.5 * constant, "transducer {transducer}: {falling} against {constant}");
    }
}

/// A protection with trip levels of force and displacement (N, m). It trips after a second in which the models are
/// contradicted, because the estimators already wait a tenth of a second after a lost sample. The plausibility watch is
/// off, because it would notice each of these faults first.
fn protected() -> Vec<Change> {
    vec![
        set("protection.enabled", true),
        set("protection.plausibility", false),
        set("protection.fault_time", 1.0),
        set("protection.ramp_time", 0.5),
        set("protection.force_trip", 120e3),
        set("protection.displacement_trip", 0.1),
    ]
}

// With a sensor of wrong sign the compensation acts in the wrong direction. The estimators' models do not explain the
// measurements, so the test trips.
#[test]
fn a_wrong_sign_that_persists_is_ramped_down() {
    for (curve, signal) in EITHER.into_iter().flat_map(|curve| [(curve, "velocity"), (curve, "spool")]) {
        let changes = [fault(signal, "sign", 6.0, 1e3), protected(), noise(10)].concat();
        let run = run(&correcting(curve, &changes), &sweep(2200.0));
        let tripped = run.status.iter().position(|flags| flags & status::TRIPPED != 0).unwrap();
        let after = tripped as f64 / RATE - 6.0;
        let what = format!("wrong sign of {signal}, {}", flow(curve));
        let displacement = largest(&run.displacement);
        let (gain, found) = (
            moved(&run.flow_gain_estimate().samples(), 1.0, 0..run.force.len()),
            curve_departure(&run, 1.0, 0.15),
        );
        keep(
            &what,
            &[("tripped after", after), ("displacement", displacement), ("gain", gain), ("curve", found)],
        );
        assert!((1.0..3.0).contains(&after), "{what}: {after} s");
        assert!(displacement < 0.1, "{what}: {displacement}");
        let ended = largest(&run.force[31 * 4096..]);
        assert!(ended < 500.0, "{what}: {ended}");
        assert!(curve || gain < 0.03, "{what}: {gain}");
        assert!(!curve || found < 0.01, "{what}: {found}");
    }
}

#[test]
fn a_short_fault_trips_nothing() {
    for curve in EITHER {
        let changes = [fault("velocity", "lost", 6.0, 0.002), protected()].concat();
        let run = run(&correcting(curve, &changes), &sweep(2200.0));
        assert_eq!(run.status_union() & status::TRIPPED, 0);
        assert_within("after a lost sample", ratio(&run, 0.5, 9.5), 0.95, 1.05);
    }
}

// A force of wrong sign makes the force loop unstable under any compensation, so the protection must end the test.
#[test]
fn the_protection_ends_a_test_with_a_force_of_wrong_sign() {
    let trip = vec![set("protection.force_trip", 30e3)];
    let changes = [fault("force", "sign", 6.0, 1e3), protected(), trip, noise(11)].concat();
    let run = run(&adaptive(&changes), &sweep(2200.0));
    assert_ne!(run.status_union() & status::TRIPPED, 0);
    keep(
        "wrong sign of force",
        &[("displacement", largest(&run.displacement)), ("force", largest(&run.force))],
    );
    assert!(largest(&run.displacement) < 0.127);
}

// The command exceeds the valve's capacity. The estimates must not change while the valve is saturated.
#[test]
fn saturation_does_not_change_the_estimates() {
    for curve in EITHER {
        let run = run(&correcting(curve, &[flow_gain(0.95), damping_ratio(0.01)]), &sweep(14_000.0));
        assert_ne!(run.status_union() & status::DEMAND_SATURATED, 0);
        let gain = moved(&run.flow_gain_estimate().samples(), 0.95, 4 * 4096..run.force.len());
        let found = curve_departure(&run, 0.95, 0.75);
        keep(format_args!("saturation, {}", flow(curve)), &[("gain", gain), ("curve", found)]);
        assert!(curve || gain < 0.02, "{gain}");
        assert!(!curve || found < 0.03, "{found}");
    }
}
