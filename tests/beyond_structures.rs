//! Compensation that calibrates itself, on structures that yield, ring or shake together: nobody retunes anything.

mod beyond;

use beyond::*;
use eft::sim::SimulateOptions;
use eft::sim::closed_loop::simulate_building;

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
    for structure in [bouc_wen(), bilinear()] {
        for damping in [0.01, 0.2] {
            for sensors in [vec![], noise(1)] {
                let changes = [structure.clone(), vec![damping_ratio(damping)], sensors].concat();
                let run = run(&adaptive(&changes), &sweep(8900.0));
                // It did yield where the damping lets it move.
                assert!(damping > 0.1 || largest(&run.displacement) > 0.03, "{}", largest(&run.displacement));
                println!("damping {damping}: {:?}", ratio(&run, 0.5, 9.5));
                assert_within(&format!("{changes:?}"), ratio(&run, 0.5, 9.5), 0.95, 1.05);
            }
        }
    }
}

// A frame that hardly loses anything, and one whose frequency lies at the end of the sweep.
#[test]
fn structures_that_ring_are_followed() {
    let linear = || set("structure.kind", "linear");
    let ringing = [
        vec![linear(), damping_ratio(0.003)],
        vec![linear(), set("structure.stiffness", 25.0 * 693.8e3), damping_ratio(0.01)],
    ];
    for structure in ringing {
        let run = run(&adaptive(&[structure.clone(), vec![flow_gain(1.06)]].concat()), &sweep(2200.0));
        println!("{:?}", ratio(&run, 0.5, 9.0));
        assert_within(&format!("{structure:?}"), ratio(&run, 0.5, 9.0), 0.95, 1.05);
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
    for changes in [
        vec![flow_gain(0.93), valve_delay(6.5e-3)],
        vec![flow_gain(1.07), valve_delay(3.5e-3)],
        [vec![flow_gain(1.05)], noise(3)].concat(),
    ] {
        let rig = adaptive(&building(changes.clone()));
        let commands = vec![sweep(2000.0); 3];
        let runs =
            simulate_building::<f64>(&rig, &commands, &SimulateOptions::default(), |_, _| true).unwrap();
        for (floor, run) in runs.iter().enumerate() {
            println!("floor {floor}: {:?}, {:.4}", ratio(run, 0.5, 9.5), error(run));
            assert_within(&format!("floor {floor}, {changes:?}"), ratio(run, 0.5, 9.5), 0.95, 1.05);
        }
    }
}
