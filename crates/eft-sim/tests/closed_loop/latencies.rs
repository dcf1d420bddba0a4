//! Valve, oil and latencies of the sensors from one test of the virtual rig, compared with its true values.

use eft_sim::excitation::sine_sweep;
use eft_sim::identification::{ForceLoopEstimate, MotionSignals, identify_force_loop};
use eft_sim::{Result, RigConfig, SimulateOptions, TestRun, simulate};

const RATE: f64 = 2048.0;

fn rig(keys: &[(&str, toml::Value)]) -> RigConfig {
    let robust = ("controller.force_loop", toml::Value::from("robust"));
    RigConfig::zhao2005().replace(&[&[robust], keys].concat()).unwrap()
}

fn swept(keys: &[(&str, toml::Value)], top: f64) -> TestRun {
    let sweep = sine_sweep(4000.0, 0.0, top, 16.0, RATE).unwrap();
    simulate::<f64>(&rig(keys), &sweep, &SimulateOptions::default(), |_, _| true).unwrap()
}

fn found(run: &TestRun) -> Result<ForceLoopEstimate> {
    let signals = MotionSignals {
        spool: &run.measured_spool,
        velocity: &run.measured_velocity,
        force: &run.measured_force,
    };
    identify_force_loop(&rig(&[]), &run.valve_command, signals, RATE)
}

#[test]
fn the_sensors_latencies_are_separated_from_the_valve() {
    for (force, spool) in [(3, 1), (1, 3)] {
        let delays =
            [("truth.sensors.force.delay", force.into()), ("truth.sensors.spool.delay", spool.into())];
        let found = found(&swept(&delays, 40.0)).unwrap();
        assert!((found.force_delay.value - f64::from(force) / RATE).abs() < 1e-4, "{found:?}");
        assert!((found.spool_delay.value - f64::from(spool) / RATE).abs() < 1e-4, "{found:?}");
        assert!((found.response_delay.value - 5.18e-3).abs() < 1e-4, "{found:?}");
    }
}

#[test]
fn a_rig_takes_what_was_found() {
    let found = found(&swept(&[("truth.sensors.force.delay", 3.into())], 40.0)).unwrap();
    let given = rig(&[
        ("actuator.friction", 200.0.into()),
        ("actuator.attachment_stiffness", 1e9.into()),
        ("sensors.motion_at", "structure".into()),
    ]);
    let known = given.replace(&found.keys(&given)).unwrap();
    assert_eq!(known.controller.force_delay, found.force_delay.value);
    assert_eq!(known.servovalve.pilot_time_constant, found.pilot_time_constant.value);
    let valve = &known.servovalve;
    let delay = valve.spool_area / (valve.spool_sensitivity * valve.pilot_flow_gain);
    assert!((delay / found.response_delay.value - 1.0).abs() < 1e-12);
    // The measured motion includes that of the attachment.
    let attachment = known.actuator.piston_area.powi(2) / 1e9;
    let oil = known.actuator.compressibility;
    assert!(((oil + attachment) / found.compressibility.value - 1.0).abs() < 1e-12);
    let flow = |rig: &RigConfig| rig.actuator.friction * rig.actuator.compressibility;
    assert!((flow(&known) / flow(&given) - 1.0).abs() < 1e-12);
    assert!(known.controller.identified_plant);
}

#[test]
fn a_test_without_these_frequencies_is_refused() {
    let noise = ("truth.sensors.force.noise", 100.0.into());
    let refused = found(&swept(&[noise], 5.0)).unwrap_err().to_string();
    assert!(refused.contains("run a sweep to 40 Hz"), "{refused}");
    let still = vec![0.0; 16 * RATE as usize];
    let signals = MotionSignals { spool: &still, velocity: &still, force: &still };
    let refused = identify_force_loop(&rig(&[]), &still, signals, RATE).unwrap_err().to_string();
    assert!(refused.contains("run a sweep to 40 Hz"), "{refused}");
}
