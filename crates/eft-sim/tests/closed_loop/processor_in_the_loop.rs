//! An external controller in place of the simulator's.

use eft_core::{Input, status};
use eft_sim::closed_loop::{Precision, parameters};
use eft_sim::config::Realization;
use eft_sim::excitation::sine_sweep;
use eft_sim::processor_in_the_loop::{ExternalOutput, run_with};
use eft_sim::{Error, Result, RigConfig, SimulateOptions, simulate};

fn digital() -> RigConfig {
    RigConfig::zhao2005().with(|rig| rig.controller.realization = Realization::Digital).unwrap()
}

/// The core as an external controller, as in firmware.
fn firmware(rig: &RigConfig) -> impl FnMut([f32; 8]) -> Result<ExternalOutput> + Send + 'static {
    let parameters = parameters(rig, 4096.0).unwrap();
    let channel = <f32 as Precision>::channel(&parameters).unwrap();
    let learner = <f32 as Precision>::learner(&parameters).unwrap();
    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
    move |[command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command]| {
        let input = Input {
            command,
            velocity,
            force,
            spool,
            displacement,
            supply_pressure,
            acceleration,
            next_command,
            ..Input::default()
        };
        let out = channel.step(&mut state, &input);
        // The calibration of this tick.
        let calibration = *state.calibration();
        if let Some(window) = out.window {
            channel.publish(&mut state, learner.update(&mut learned, &window));
        }
        Ok(ExternalOutput {
            valve_command: out.voltage,
            compensation: out.compensation,
            status: out.status,
            velocity: out.velocity,
            flow_gain: calibration.flow_gain,
            response_delay: calibration.response_delay,
            valve_gain: calibration.valve_gain,
            level: calibration.level,
        })
    }
}

#[test]
fn the_loop_around_an_external_controller_has_the_simulations_bits() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs/guarded.toml");
    let rig = RigConfig::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
    let stuck = [
        ("sensors.fault.signal", "displacement".into()),
        ("sensors.fault.kind", "stuck".into()),
        ("sensors.fault.start", 4.0.into()),
    ];
    let command = sine_sweep(8900.0, 1.0, 3.0, 8.0, 4096.0).unwrap();
    let options = SimulateOptions::default();
    let ahead =
        [("compensation.look_ahead", true.into()), ("controller.velocity_source", "accelerometer".into())];
    let (faulty, ahead) = (rig.replace::<&str>(&stuck).unwrap(), rig.replace::<&str>(&ahead).unwrap());
    for (rig, trips) in [(rig, false), (ahead, false), (faulty, true)] {
        let simulated = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
        let outside = run_with(&rig, &command, &options, firmware(&rig), None, |_, _| true).unwrap();
        assert_eq!(simulated.first_difference(&outside), None);
        let seen = simulated.status.iter().fold(0, |seen, bits| seen | bits);
        assert_eq!(seen & status::TRIPPED != 0, trips, "{seen:#x}");
        // The controller has learned during the test.
        assert!(simulated.flow_gain_estimate().values().iter().any(|gain| (gain - 1.0).abs() > 1e-3));
        // Learned flows stay in the firmware; the run does not report its table instead.
        assert!(!simulated.found_flows.is_empty() && outside.found_flows.is_empty());
        let refused = outside.corrected_rig().unwrap_err().to_string();
        assert!(refused.starts_with("found_flows = none: must have been found here"), "{refused}");
    }
}

#[test]
fn an_externally_closed_loop_has_the_simulations_bits() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 2.0, 4096.0).unwrap();
    let noisy = [("sensors.force.noise", 20.0.into()), ("sensors.velocity.noise", 1.0e-3.into())];
    let wrong = [
        ("truth.structure.mass", toml::Value::from(8e3)),
        ("truth.sensors.force.gain", 1.01.into()),
        ("truth.dac.delay", 1.into()),
        ("dac.range", 8.0.into()),
    ];
    for rig in [digital(), digital().replace(&noisy).unwrap(), digital().replace(&wrong).unwrap()] {
        let options = SimulateOptions::default();
        let simulated = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
        let outside = run_with(&rig, &command, &options, firmware(&rig), None, |_, _| true).unwrap();
        assert_eq!(simulated.first_difference(&outside), None);
        // A controller other than the rig's gives a different run.
        let other = rig.replace(&[("compensation.level", 1.000_001.into())]).unwrap();
        let outside = run_with(&rig, &command, &options, firmware(&other), None, |_, _| true).unwrap();
        assert!(simulated.first_difference(&outside).is_some());
    }
}

#[test]
fn a_controller_that_fails_ends_the_run() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 20.0, 4096.0).unwrap();
    let mut ticks = 0;
    let fails = move |_| {
        ticks += 1;
        if ticks < 10 {
            Ok(ExternalOutput::default())
        } else {
            Err(Error::value("tick", ticks, "must be below 10"))
        }
    };
    let error =
        run_with(&digital(), &command, &SimulateOptions::default(), fails, None, |_, _| true).unwrap_err();
    assert_eq!(error.to_string(), "tick = 10: must be below 10");
}

#[test]
fn features_that_firmware_does_not_have_are_refused() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 1.0, 4096.0).unwrap();
    for change in [
        ("controller.realization", "analog".into()),
        ("compensation.computation_delay", 1.into()),
        ("protection.soft_end", true.into()),
    ] {
        let on = ("protection.enabled", true.into());
        let rig = digital().replace(&[on, change.clone()]).unwrap();
        let idle = |_| Ok(ExternalOutput::default());
        let error =
            run_with(&rig, &command, &SimulateOptions::default(), idle, None, |_, _| true).unwrap_err();
        assert!(error.to_string().starts_with(change.0), "{error}");
    }
}
