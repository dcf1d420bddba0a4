use super::*;
use crate::config::RigConfig;
use crate::ground_motion::excitation::{Command, sine_sweep};
use crate::{SimulateOptions, TestRun, simulate};

const RATE: f64 = 4096.0;
const STILL: Signals<f64> = Signals {
    displacement: 0.0,
    velocity: 0.0,
    force: 0.0,
    spool: 0.0,
    supply_pressure: 0.0,
    acceleration: 0.0,
};

fn rig(changes: &[(&str, toml::Value)]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

fn sensors(changes: &[(&str, toml::Value)], actuator: u64) -> Option<Sensors<f64>> {
    let rig = rig(changes);
    Sensors::new(|_| &rig, RATE, actuator)
}

fn run(changes: &[(&str, toml::Value)]) -> TestRun {
    let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE).unwrap();
    simulate::<f64>(&rig(changes), &command, &SimulateOptions::default(), |_, _| true).unwrap()
}

/// Readings of a force that rises by 1 N per tick.
fn ramp(changes: &[(&str, toml::Value)], ticks: usize) -> Vec<f64> {
    let mut sensors = sensors(changes, 0).unwrap();
    let truth = |tick: usize| Signals { force: tick as f64, supply_pressure: 1.9e7, ..STILL };
    (0..ticks).map(|tick| sensors.read(&truth(tick)).0.force).collect()
}

#[test]
fn ideal_sensors_are_none() {
    assert!(sensors(&[], 0).is_none());
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
fn delay_is_in_samples_and_starts_at_rest() {
    assert_eq!(ramp(&[("sensors.force.delay", 3.into())], 6), [0.0, 0.0, 0.0, 0.0, 1.0, 2.0]);
}

#[test]
fn gain_bias_range_and_resolution() {
    let scaled = ramp(&[("sensors.force.gain", 0.5.into()), ("sensors.force.bias", 5.0.into())], 3);
    assert_eq!(scaled, [5.0, 5.5, 6.0]);
    assert_eq!(ramp(&[("sensors.force.bias", 5.0.into())], 3), [5.0, 6.0, 7.0]);
    assert_eq!(ramp(&[("sensors.force.range", 1.5.into())], 3), [0.0, 1.0, 1.5]);
    let coarse = ramp(&[("sensors.force.range", 8.0.into()), ("sensors.force.bits", 3.into())], 9);
    // Eight codes over ±8 N, a step of 2 N.
    assert_eq!(coarse, [0.0, 2.0, 2.0, 4.0, 4.0, 6.0, 6.0, 6.0, 6.0]);
}

#[test]
fn bandwidth_lags_a_ramp_by_its_time_constant() {
    let mut sensors = sensors(&[("sensors.velocity.bandwidth", 100.0.into())], 0).unwrap();
    let read = |tick: u32| sensors.read(&Signals { velocity: f64::from(tick), ..STILL }).0.velocity;
    let last = (0..4096).map(read).last().unwrap();
    let lag = RATE / (std::f64::consts::TAU * 100.0);
    assert!((last - (4095.0 - lag)).abs() < 1e-6);
}

#[test]
fn noise_has_its_deviation_and_no_memory() {
    let read = ramp(&[("sensors.force.noise", 20.0.into())], 20_000);
    let errors: Vec<f64> = read.iter().enumerate().map(|(i, r)| r - i as f64).collect();
    let power = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
    assert!((power.sqrt() / 20.0 - 1.0).abs() < 0.02);
}

#[test]
fn lost_samples_come_at_their_share_and_hold_the_output() {
    let lost = ramp(&[("sensors.force.dropout", 0.1.into())], 20_000).iter().filter(|r| r.is_nan()).count();
    assert!((1830..2170).contains(&lost), "{lost}");
    let run = run(&[("sensors.velocity.dropout", 0.05.into())]);
    for (i, read) in run.measured_velocity().iter().enumerate() {
        let invalid = run.status[i] & eft_core::status::INVALID_MEASUREMENT != 0;
        assert_eq!(read.is_nan(), invalid, "tick {i}");
        assert!(!invalid || i == 0 || run.compensation[i] == run.compensation[i - 1]);
    }
}

#[test]
fn faults_start_and_end_on_their_tick() {
    let fault = |kind: &str| {
        let at = |tick: f64| toml::Value::from(tick / RATE);
        let changes = [
            ("sensors.fault.signal", "force".into()),
            ("sensors.fault.kind", kind.into()),
            ("sensors.fault.start", at(2.0)),
            ("sensors.fault.duration", at(2.0)),
            ("sensors.fault.gain", 1.5.into()),
        ];
        ramp(if kind == "gain" { &changes } else { &changes[..4] }, 6)
    };
    assert_eq!(fault("zero"), [0.0, 1.0, 0.0, 0.0, 4.0, 5.0]);
    assert_eq!(fault("sign"), [0.0, 1.0, -2.0, -3.0, 4.0, 5.0]);
    assert_eq!(fault("stuck"), [0.0, 1.0, 1.0, 1.0, 4.0, 5.0]);
    assert_eq!(fault("gain"), [0.0, 1.0, 3.0, 4.5, 4.0, 5.0]);
    assert!(fault("lost")[2..4].iter().all(|r| r.is_nan()));
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
    let other = sensors(&[("sensors.force.noise", 20.0.into())], 1).unwrap();
    let mine = sensors(&[("sensors.force.noise", 20.0.into())], 0).unwrap();
    let read = |mut sensors: Sensors<f64>| sensors.read(&STILL).0.force;
    assert_ne!(read(other), read(mine), "two actuators share a stream");
}

#[test]
fn a_gain_of_the_cell_is_one_of_the_loop_and_of_its_command() {
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
fn a_late_converter_gives_what_it_was_given_samples_before() {
    let command = sine_sweep(4000.0, 0.0, 10.0, 1.0, RATE).unwrap();
    let test = |changes: &[(&str, toml::Value)]| {
        simulate::<f64>(&rig(changes), &command, &SimulateOptions::default(), |_, _| true).unwrap()
    };
    // With an analog loop it delays the compensation, as a computation delay does.
    let late = test(&[("dac.delay", 3.into())]);
    assert_eq!(late.first_difference(&test(&[("compensation.computation_delay", 3.into())])), None);
    assert!(late.first_difference(&test(&[])).is_some());
    // With a digital loop it delays the whole valve command, which responds to the first force before any
    // motion.
    let digital = ("controller.realization", toml::Value::from("digital"));
    let [now, late] = [0, 3].map(|delay| test(&[digital.clone(), ("dac.delay", delay.into())]));
    let first = |run: &crate::TestRun| run.valve_command.iter().position(|v| *v != 0.0).unwrap();
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
        assert!(run.status_union() & eft_core::status::COMMAND_LIMITED != 0);
    }
}
