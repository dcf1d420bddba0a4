//! The controller uses only its measurements and its own configuration.

use eft::core::{Input, Parameters, Realization};
use eft::sim::RigConfig;
use eft::sim::closed_loop::{RigChannel, parameters};

use crate::rigs::*;

/// Rigs whose true plants all differ from the paper's, with the paper's controller.
fn other_plants(changes: &[Change]) -> Vec<RigConfig> {
    let nominal = &RigConfig::zhao2005().servovalve.flow_table;
    let flows: Vec<f64> = nominal.flows.iter().map(|q| if *q > 0.0 { 1.05 * q } else { 0.9 * q }).collect();
    let truths = [
        vec![flow_gain(0.9), valve_delay(8e-3), set("servovalve.pilot_time_constant", 3e-3)],
        vec![damping_ratio(0.2)],
        vec![set("structure.mass", 3000.0)],
        vec![set("structure.kind", "linear"), set("structure.stiffness", 4.0 * 693.8e3)],
        vec![
            set("servovalve.true_flow_table.openings", nominal.openings.clone()),
            set("servovalve.true_flow_table.flows", flows),
        ],
        vec![
            set("supply.schedule.times", vec![0.0, 2.0, 4.0]),
            set("supply.schedule.pressures", vec![1.9e7, 1.9e7, 1.5e7]),
        ],
        vec![
            set("truth.actuator.piston_area", 8.0e-3),
            set("truth.actuator.compressibility", 5e-13),
            set("truth.actuator.leakage", 5e-11),
            set("truth.supply.pressure", 1.6e7),
            set(
                "truth.servovalve.flow_table.flows",
                nominal.flows.iter().map(|q| 0.9 * q).collect::<Vec<_>>(),
            ),
            set("truth.sensors.velocity.delay", 3),
        ],
    ];
    truths.into_iter().map(|truth| adaptive(&[changes, &truth].concat())).collect()
}

// Controllers of rigs with different true plants get the measurements of one rig.
#[test]
fn equal_measurements_give_equal_bits() {
    let sources = [
        vec![],
        vec![set("controller.velocity_source", "derivative")],
        vec![set("controller.velocity_source", "observer"), set("controller.observer_mass", 7000.0)],
        vec![set("controller.velocity_source", "accelerometer"), set("sensors.acceleration.noise", 0.01)],
        vec![set("compensation.supply_correction", true), set("compensation.curve_correction", true)],
    ];
    for source in sources {
        let changes = [noise(9), source].concat();
        let seen = run(&adaptive(&[changes.clone(), vec![flow_gain(1.06)]].concat()), &sweep(2200.0));
        let outputs = |rig: &RigConfig| -> Vec<u64> {
            let digital = Parameters { realization: Realization::Digital, ..parameters(rig, RATE).unwrap() };
            let mut controller = RigChannel::<f64>::new(&digital, None).unwrap();
            let step = |i: usize| {
                let input = Input {
                    command: seen.command[i],
                    next_command: seen.command[i + 1],
                    velocity: seen.measured_velocity()[i],
                    force: seen.measured_force()[i],
                    spool: seen.measured_spool()[i],
                    displacement: seen.measured_displacement()[i],
                    valve_command: seen.valve_command[i],
                    supply_pressure: seen.measured_supply_pressure()[i],
                    acceleration: seen.measured_acceleration().get(i).copied().unwrap_or(0.0),
                    ..Input::default()
                };
                controller.step(&input).voltage.to_bits()
            };
            (0..8 * 4096).map(step).collect()
        };
        let own = outputs(&seen.rig);
        assert!(own.iter().any(|bits| *bits != own[0]));
        for (i, other) in other_plants(&changes).iter().enumerate() {
            assert!(outputs(other) == own, "{:?}, plant {i}", seen.rig.controller.velocity_source);
        }
    }
}

// With a correct compensation the guard changes no bit.
#[test]
fn a_guard_changes_no_bit_of_a_correct_compensation() {
    let plain = run(&rig(&[]), &sweep(8900.0));
    let watched = [set("compensation.guard", true), set("compensation.supply_correction", true)];
    let watched = run(&rig(&watched), &sweep(8900.0));
    assert!(watched.level().values().iter().all(|level| level.to_bits() == 1.0_f64.to_bits()));
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same(&plain.force, &watched.force) && same(&plain.valve_command, &watched.valve_command));
}
