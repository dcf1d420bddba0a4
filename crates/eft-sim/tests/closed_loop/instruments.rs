//! Sensors and converter in a whole test.

use eft_core::status;
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{RigConfig, SimulateOptions, TestRun, simulate};

const RATE: f64 = 4096.0;

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

fn run(changes: &[(&str, toml::Value)]) -> TestRun {
    let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE).unwrap();
    simulate::<f64>(&rig(changes), &command, &SimulateOptions::default(), |_, _| true).unwrap()
}

#[test]
fn ideal_sensors_read_the_truth() {
    let run = run(&[]);
    assert_eq!(run.measured_force(), run.force);
    assert_eq!(run.measured_velocity(), run.velocity);
}

#[test]
fn a_sensor_beyond_the_controller_changes_no_bit() {
    // The displacement is recorded, not fed back.
    let (plain, noisy) = (run(&[]), run(&[("sensors.displacement.noise", 1e-3.into())]));
    assert_eq!(plain.force, noisy.force);
    assert_eq!(noisy.measured_force(), noisy.force);
    assert_ne!(noisy.measured_displacement(), noisy.displacement);
}

#[test]
fn a_lost_sample_holds_the_output() {
    let run = run(&[("sensors.velocity.dropout", 0.05.into())]);
    for (i, read) in run.measured_velocity().iter().enumerate() {
        let invalid = run.status[i] & status::INVALID_MEASUREMENT != 0;
        assert_eq!(read.is_nan(), invalid, "tick {i}");
        assert!(!invalid || i == 0 || run.compensation[i] == run.compensation[i - 1]);
    }
}

#[test]
fn same_seed_same_bits_other_seed_other_noise() {
    let with = |seed: i64| {
        run(&[
            ("sensors.seed", seed.into()),
            ("sensors.force.noise", 20.0.into()),
            ("sensors.spool.noise", 1e-3.into()),
        ])
    };
    let first = with(1);
    // Each on a separate thread.
    let again = std::thread::spawn(move || with(1)).join().unwrap();
    assert_eq!(first, again);
    assert_ne!(first.force, with(2).force);
}

#[test]
fn a_gain_of_the_cell_scales_the_loop_and_its_command() {
    const GAIN: f64 = 1.05;
    let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE).unwrap();
    let less = Command::new(command.values.iter().map(|value| value / GAIN).collect(), RATE).unwrap();
    for realization in ["analog", "digital"] {
        let linear = [("compensation.mode", "linear".into()), ("controller.realization", realization.into())];
        let test = |change: (&'static str, f64), command: &Command| {
            let rig = rig(&linear).replace(&[(change.0, change.1.into())]).unwrap();
            simulate::<f64>(&rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
        };
        let with = test(("sensors.force.gain", GAIN), &command);
        let other = test(("controller.force_sensitivity", GAIN * 5.6e-5), &less);
        let differences = with.force.iter().zip(&other.force).map(|(a, b)| (a - b).abs());
        let worst = differences.fold(0.0, f64::max);
        assert!(worst < 1e-4, "{realization}: {worst} N");
        let read = with.measured_force().iter().zip(&with.force);
        assert!(read.into_iter().all(|(measured, force)| *measured == GAIN * force));
    }
}

#[test]
fn bias_of_the_cell_shifts_the_force_in_both_realizations() {
    for realization in ["analog", "digital"] {
        let rig = rig(&[
            ("sensors.force.bias", 1000.0.into()),
            ("controller.realization", realization.into()),
            ("structure.kind", "linear".into()),
        ]);
        let command = Command::new(vec![0.0; 16384], RATE).unwrap();
        let run = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();
        // At rest the flow is C_l·F/A, so F = −bias·L/(1 + L) with the static loop gain L.
        let (c, a, v) = (&rig.controller, &rig.actuator, &rig.servovalve);
        let slope = v.flow_table.flows[11] / 0.1;
        let retracting = -v.flow_table.flows[9] / 0.1;
        let gain = |slope: f64| {
            c.force_sensitivity * c.proportional_gain / (v.spool_sensitivity * v.spool_stroke)
                * slope
                * a.piston_area
                / a.leakage
        };
        let force = *run.force.last().unwrap();
        let expected = |slope| -1000.0 * gain(slope) / (1.0 + gain(slope));
        let (low, high) =
            (expected(slope).min(expected(retracting)), expected(slope).max(expected(retracting)));
        assert!(force > low - 1.0 && force < high + 1.0, "{realization}: {force}, between {low} and {high}");
    }
}

#[test]
fn faults_reach_the_loop_in_both_realizations() {
    let fault = |kind, more: &[(&'static str, toml::Value)]| {
        let changes: [(&str, toml::Value); 3] = [
            ("sensors.fault.signal", "force".into()),
            ("sensors.fault.kind", toml::Value::from(kind)),
            ("sensors.fault.start", 0.0.into()),
        ];
        [&changes, more].concat()
    };
    for realization in ["analog", "digital"] {
        let test = |changes: &[(&'static str, toml::Value)]| {
            run(&[&[("controller.realization", realization.into())], changes].concat())
        };
        let biased = test(&[("sensors.force.bias", 500.0.into())]);
        let offset = test(&fault("offset", &[("sensors.fault.offset", 500.0.into())]));
        assert!(offset.force == biased.force, "{realization}");
        assert!(test(&fault("dead", &[])).force == test(&fault("zero", &[])).force, "{realization}");
        let disturbed = |kind, size| {
            let run = test(&fault(kind, &[(size, 500.0.into())]));
            let added = run.measured_force().iter().zip(&run.force).map(|(read, force)| read - force);
            (run.force.last().copied().unwrap(), added.collect::<Vec<_>>())
        };
        let (drifted, added) = disturbed("drift", "sensors.fault.drift");
        assert!(added.iter().enumerate().all(|(i, one)| (one - 500.0 * i as f64 / RATE).abs() < 1e-9));
        // 2 kN after 4 s. The loop's static error is 2 %, and its response late by a few ms.
        let moved = test(&[]).force.last().unwrap() - drifted;
        assert!((moved / 2000.0 - 1.0).abs() < 0.1, "{realization}: {moved} N");
        let (_, added) = disturbed("noise", "sensors.fault.noise");
        let power = added.iter().map(|one| one * one).sum::<f64>() / added.len() as f64;
        assert!((power.sqrt() / 500.0 - 1.0).abs() < 0.03, "{realization}");
    }
}

#[test]
fn a_late_converter_outputs_an_earlier_sample() {
    let command = sine_sweep(4000.0, 0.0, 10.0, 1.0, RATE).unwrap();
    let test = |changes: &[(&str, toml::Value)]| {
        simulate::<f64>(&rig(changes), &command, &SimulateOptions::default(), |_, _| true).unwrap()
    };
    // With an analog loop it delays the compensation, as a computation delay does.
    let late = test(&[("dac.delay", 3.into())]);
    assert_eq!(late.first_difference(&test(&[("compensation.computation_delay", 3.into())])), None);
    assert!(late.first_difference(&test(&[])).is_some());
    // With a digital loop it delays the whole valve command, which responds to the first force before any motion.
    let digital = ("controller.realization", toml::Value::from("digital"));
    let [now, late] = [0, 3].map(|delay| test(&[digital.clone(), ("dac.delay", delay.into())]));
    let first = |run: &TestRun| run.valve_command.iter().position(|v| *v != 0.0).unwrap();
    assert_eq!(first(&late), first(&now) + 3);
    assert_eq!(late.valve_command[first(&late)], now.valve_command[first(&now)]);
}

#[test]
fn converter_of_the_output_limits_and_rounds() {
    for realization in ["analog", "digital"] {
        let run = run(&[
            ("controller.realization", realization.into()),
            ("dac.range", 1.0.into()),
            ("dac.bits", 8.into()),
        ]);
        let out = if realization == "analog" { &run.compensation } else { &run.valve_command };
        let step = 2.0 / 256.0;
        assert!(out.iter().all(|v| (v / step).fract() == 0.0 && (-1.0..=1.0 - step).contains(v)));
        assert!(run.status_union() & status::COMMAND_LIMITED != 0);
    }
}
