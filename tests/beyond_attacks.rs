//! What the adaptive controller survives: sensors that fail, silence, saturation, a supply that falls; and that it
//! sees measurements only.

mod beyond;

use beyond::*;
use eft::core::{Measurements, status};
use eft::sim::closed_loop::Precision;
use eft::sim::closed_loop::simulate_building;
use eft::sim::excitation::Command;
use eft::sim::excitation::effective_force;
use eft::sim::records::read_record;
use eft::sim::{RigConfig, SimulateOptions};

/// A sweep that its structure is asked to follow after minutes of nothing.
fn after_silence(seconds: f64, amplitude: f64) -> Command {
    let silence = vec![0.0; (seconds * RATE) as usize];
    Command {
        values: [sweep(amplitude).values, silence, sweep(amplitude).values].concat(),
        sample_rate: RATE,
    }
}

fn fault(signal: &str, kind: &str, start: f64, duration: f64) -> Vec<Change> {
    vec![
        set("sensors.fault.signal", signal),
        set("sensors.fault.kind", kind),
        set("sensors.fault.start", start),
        set("sensors.fault.duration", duration),
    ]
}

// Controllers of rigs whose true plants differ in everything, fed with one rig's measurements.
#[test]
fn equal_measurements_give_equal_bits() {
    let seen = run(&adaptive(&[noise(9), vec![flow_gain(1.06)]].concat()), &sweep(2200.0));
    let others = [
        adaptive(&[flow_gain(0.9), valve_delay(8e-3)]),
        adaptive(&[
            damping_ratio(0.2),
            set("structure.mass", 3000.0),
            set("servovalve.pilot_time_constant", 3e-3),
        ]),
    ];
    let outputs = |rig: &RigConfig| -> Vec<u64> {
        let controller = <f64 as Precision>::adaptive(rig, RATE).unwrap();
        let mut state = controller.at_rest();
        let step = |i: usize| {
            let measured = Measurements {
                velocity: seen.measured_velocity()[i],
                force: seen.measured_force()[i],
                spool: seen.measured_spool()[i],
                valve_command: seen.valve_command[i],
                supply_pressure: 1.9e7,
            };
            controller.step(&mut state, seen.command[i], &measured).valve_command.to_bits()
        };
        (0..8 * 4096).map(step).collect()
    };
    let own = outputs(&seen.rig);
    assert!(own.iter().any(|bits| *bits != own[0]));
    for other in &others {
        assert!(outputs(other) == own);
    }
}

#[test]
fn minutes_of_silence_teach_nothing() {
    let rig = adaptive(&[noise(7), vec![flow_gain(1.07)]].concat());
    let run = run(&rig, &after_silence(180.0, 2200.0));
    let (before, after) = (32 * 4096 + 4096, (32 + 180) * 4096 - 1);
    let (gain, delay) = (&run.flow_gain_estimate, &run.response_delay_estimate);
    assert!((gain[after] - gain[before]).abs() < 1e-3, "{} {}", gain[before], gain[after]);
    assert!((delay[after] - delay[before]).abs() < 1e-4, "{} {}", delay[before], delay[after]);
}

// The transducer that fails is the controller's only one for its signal: nothing can be compensated meanwhile. What
// counts is that the estimates are not led astray, and that the test comes back.
#[test]
fn a_failed_sensor_leaves_the_estimates_where_they_were() {
    for signal in ["velocity", "spool"] {
        for kind in ["lost", "zero", "stuck", "sign"] {
            let rig = adaptive(&[fault(signal, kind, 12.0, 0.5), noise(8)].concat());
            let run = run(&rig, &sweep(2200.0));
            let moved = |trace: &[f64]| {
                let span = &trace[12 * 4096..14 * 4096];
                span.iter().fold(0.0_f64, |most, v| most.max((v - trace[12 * 4096]).abs()))
            };
            let (gain, delay) = (moved(&run.flow_gain_estimate), moved(&run.response_delay_estimate));
            println!(
                "{signal} {kind}: gain {gain:.4}, delay {delay:.2e}, x {:.3}",
                largest(&run.displacement)
            );
            assert!(gain < 0.03, "{signal} {kind}: {gain}");
            assert!(delay < 1e-3, "{signal} {kind}: {delay}");
            assert_ne!(run.status_union() & status::ADAPTATION_FROZEN, 0, "{signal} {kind}");
        }
    }
}

#[test]
fn spool_offset_is_no_gain() {
    let run = run(&adaptive(&[set("sensors.spool.bias", 0.01), flow_gain(0.95)]), &sweep(2200.0));
    assert_within("spool offset of 1 %", ratio(&run, 0.5, 9.5), 0.95, 1.05);
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
        println!("transducer {transducer}: {falling} against {constant}");
        assert!(falling <= 1.5 * constant, "transducer {transducer}: {falling} against {constant}");
    }
}

// Every floor's actuator moves with the whole building, and each calibrates itself on its own.
#[test]
fn every_actuator_of_a_building_adapts() {
    let list = |value: f64| vec![value; 3];
    let building = [
        set("structure.kind", "shear_building"),
        set("structure.stories.masses", list(7040.0)),
        set("structure.stories.dampings", list(4330.0)),
        set("structure.stories.stiffnesses", list(693.8e3)),
        flow_gain(1.05),
    ];
    let rig = adaptive(&building);
    let commands = vec![sweep(2000.0); 3];
    let runs = simulate_building::<f64>(&rig, &commands, &SimulateOptions::default(), |_, _| true).unwrap();
    for (floor, run) in runs.iter().enumerate() {
        println!("floor {floor}: {:?}, {:.4}", ratio(run, 0.5, 9.5), error(run));
        assert_within(&format!("floor {floor}"), ratio(run, 0.5, 9.5), 0.95, 1.05);
    }
}
