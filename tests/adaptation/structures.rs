//! Self-calibration without retuning on structures that yield, that have little damping, and on buildings.

use eft::sim::SimulateOptions;
use eft::sim::closed_loop::simulate_actuators;

use crate::results::keep;
use crate::rigs::*;

/// A hysteretic spring that keeps half of its stiffness beyond 10 mm.
fn bouc_wen() -> Vec<Change> {
    vec![
        set("structure.kind", "bouc_wen"),
        set("structure.bouc_wen.yield_displacement", 0.010),
        set("structure.bouc_wen.post_yield_ratio", 0.5),
        set("structure.bouc_wen.exponent", 2.0),
        set("structure.bouc_wen.shape", 0.5),
    ]
}

/// An elastic spring that keeps half of its stiffness beyond 15 mm.
fn bilinear() -> Vec<Change> {
    vec![
        set("structure.kind", "bilinear"),
        set("structure.softening.displacement", 0.015),
        set("structure.softening.stiffness", 693.8e3 / 2.0),
    ]
}

// A nonlinear structure spreads the sweep's frequencies, but force and command are judged by the same spectra.
#[test]
fn structures_that_yield_are_followed() {
    for (name, structure) in [("Bouc-Wen", bouc_wen()), ("bilinear", bilinear())] {
        for damping in [0.01, 0.2] {
            for sensors in [vec![], noise(1)] {
                let changes = [structure.clone(), vec![damping_ratio(damping)], sensors.clone()].concat();
                let run = run(&adaptive(&changes), &sweep(8900.0));
                // It yields unless the damping prevents the motion.
                assert!(damping > 0.1 || largest(&run.displacement) > 0.03, "{}", largest(&run.displacement));
                let (least, largest) = ratio(&run, 0.5, 9.5);
                let noise = if sensors.is_empty() { "" } else { ", noise" };
                keep(
                    format_args!("{name}, damping {damping}{noise}"),
                    &[("least", least), ("largest", largest)],
                );
                assert_within(&format!("{changes:?}"), (least, largest), 0.95, 1.05);
            }
        }
    }
}

// A frame with very little damping, and one whose natural frequency lies at the end of the sweep.
#[test]
fn structures_of_little_damping_are_followed() {
    let linear = || set("structure.kind", "linear");
    let ringing = [
        ("damping 0.3 %", vec![linear(), damping_ratio(0.003)]),
        ("stiff", vec![linear(), set("structure.stiffness", 25.0 * 693.8e3), damping_ratio(0.01)]),
    ];
    for ((name, structure), curve) in ringing.iter().flat_map(|ringing| EITHER.map(|curve| (ringing, curve)))
    {
        let changes = [structure.clone(), vec![flow_gain(1.06)]].concat();
        let run = run(&correcting(curve, &changes), &sweep(2200.0));
        let (what, (least, largest)) = (format!("{name}, {}", flow(curve)), ratio(&run, 0.5, 9.0));
        let found = curve_departure(&run, 1.06, 0.15);
        keep(&what, &[("least", least), ("largest", largest), ("curve", found)]);
        assert_within(&what, (least, largest), 0.95, 1.05);
        assert!(!curve || found < 0.02, "{what}: {found}");
    }
}

#[test]
fn other_structures_do_not_change_the_curve() {
    let yielding = vec![
        set("structure.kind", "bouc_wen"),
        set("structure.bouc_wen.yield_displacement", 0.012),
        set("structure.bouc_wen.post_yield_ratio", 0.5),
        set("structure.bouc_wen.exponent", 1.0),
        set("structure.bouc_wen.shape", 0.5),
    ];
    let soft = vec![set("structure.kind", "linear"), set("structure.stiffness", 0.5 * 693.8e3)];
    // At 8.9 kN and 1 % the softer structure needs more than the valve's flow and the stroke.
    for (name, changes, amplitude) in [("yielding", yielding, 8900.0), ("half the stiffness", soft, 4450.0)] {
        for damping in [0.01, 0.2] {
            let changes = [changes.clone(), vec![damping_ratio(damping)]].concat();
            let run = run(&correcting(true, &changes), &sweep(amplitude));
            let (what, (least, largest)) = (format!("{name}, damping {damping}"), ratio(&run, 0.5, 9.5));
            keep(
                &what,
                &[("least", least), ("largest", largest), ("curve", curve_departure(&run, 1.0, 0.5))],
            );
            assert_within(&what, (least, largest), 0.95, 1.05);
            assert!(curve_departure(&run, 1.0, 0.3) < 0.01, "{what}");
        }
    }
}

fn building(changes: Vec<Change>) -> Vec<Change> {
    let list = |value: f64| vec![value; 3];
    let building = vec![
        set("structure.kind", "shear_building"),
        set("structure.stories.masses", list(7040.0)),
        set("structure.stories.dampings", list(4330.0)),
        set("structure.stories.stiffnesses", list(693.8e3)),
    ];
    [building, changes].concat()
}

// Every floor's actuator moves with the whole building, and each calibrates itself on its own.
#[test]
fn every_actuator_of_a_building_adapts() {
    for (name, changes) in [
        ("slow valve", vec![flow_gain(0.93), valve_delay(6.5e-3)]),
        ("fast valve", vec![flow_gain(1.07), valve_delay(3.5e-3)]),
        ("noise", [vec![flow_gain(1.05)], noise(3)].concat()),
    ] {
        let rig = adaptive(&building(changes));
        let commands = vec![sweep(2000.0); 3];
        let runs =
            simulate_actuators::<f64>(&rig, &commands, &SimulateOptions::default(), |_, _| true).unwrap();
        for (floor, run) in runs.iter().enumerate() {
            let (least, largest) = ratio(run, 0.5, 9.5);
            keep(
                format_args!("floor {floor}, {name}"),
                &[("least", least), ("largest", largest), ("NRMSE", error(run))],
            );
            assert_within(&format!("floor {floor}, {name}"), (least, largest), 0.95, 1.05);
        }
    }
}
