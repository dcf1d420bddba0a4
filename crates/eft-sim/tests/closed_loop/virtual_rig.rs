//! The virtual rig and the controller in turn, compared with a whole test.

use eft_core::{Input, status};
use eft_sim::closed_loop::{Method, RigChannel, RigReading, VirtualRig, parameters, simulate_actuators};
use eft_sim::config::calibration_section;
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{Result, RigConfig, SimulateOptions, TestRun};

type Changes<'a> = &'a [(&'a str, toml::Value)];

fn rig(changes: Changes<'_>) -> RigConfig {
    let digital = RigConfig::zhao2005().replace(&[("controller.realization", "digital".into())]).unwrap();
    digital.replace(changes).unwrap()
}

/// Rigs on the fast path and beyond it, with every instrument, protection and learner.
fn rigs() -> Vec<RigConfig> {
    let noisy: Changes<'_> = &[
        ("sensors.force.noise", 20.0.into()),
        ("sensors.force.delay", 2.into()),
        ("sensors.velocity.bandwidth", 300.0.into()),
        ("sensors.velocity.noise", 1e-3.into()),
        ("sensors.spool.dropout", 0.01.into()),
        ("dac.delay", 3.into()),
        ("dac.range", 10.0.into()),
    ];
    let protected: Changes<'_> = &[
        ("protection.enabled", true.into()),
        ("protection.displacement_trip", 1e-3.into()),
        ("actuator.bypass_flow", 1e-3.into()),
        ("actuator.friction", 50.0.into()),
    ];
    let adaptive: Changes<'_> =
        &[("compensation.adaptive", true.into()), ("truth.servovalve.flow_gain_scale", 0.8.into())];
    let building: Changes<'_> = &[
        ("structure.kind", "shear_building".into()),
        ("structure.stories.masses", vec![7000.0, 6000.0].into()),
        ("structure.stories.dampings", vec![4000.0, 3000.0].into()),
        ("structure.stories.stiffnesses", vec![1.4e6, 1.0e6].into()),
        ("sensors.force.noise", 5.0.into()),
        ("protection.enabled", true.into()),
        ("protection.displacement_trip", 2e-3.into()),
        ("actuator.bypass_flow", 1e-3.into()),
    ];
    // The valve rests away from its true null, or at the one that an earlier test has taught.
    let told: Changes<'_> =
        &[("servovalve.null_bias", 0.01.into()), ("truth.servovalve.null_bias", 0.0.into())];
    let taught = rig(&[("compensation.adaptive", true.into()), ("truth.servovalve.null_bias", 0.01.into())]);
    let taught = taught.replace(&[("compensation.curve_correction", true.into())]).unwrap();
    let teacher = whole_test(&taught, &[sine_sweep(4000.0, 0.5, 6.0, 2.0, 4096.0).unwrap()]).remove(0);
    let saved = calibration_section(&teacher.calibration.unwrap()).unwrap();
    let mut rigs = [&[], noisy, protected, adaptive, building, told].map(rig).to_vec();
    rigs.push(taught.replace(&[("calibration", saved)]).unwrap());
    rigs
}

fn whole_test(rig: &RigConfig, commands: &[Command]) -> Vec<TestRun> {
    simulate_actuators::<f64>(rig, commands, &SimulateOptions::default(), |_, _| true).unwrap()
}

/// The controller's input at a sample.
fn input(reading: &RigReading, command: f64, next_command: f64) -> Input<f64> {
    Input {
        command,
        next_command,
        velocity: reading.measured.velocity,
        force: reading.measured.force,
        spool: reading.measured.spool,
        displacement: reading.measured.displacement,
        acceleration: reading.measured.acceleration,
        supply_pressure: reading.measured.supply_pressure,
        ..Input::default()
    }
}

#[test]
fn controller_and_rig_in_turn_reproduce_the_test() {
    for rig in rigs() {
        let floors = rig.structure.floors();
        let size = |floor| 4000.0 / f64::from(floor);
        let commands: Vec<_> =
            (1..).map(|floor| sine_sweep(size(floor), 0.5, 6.0, 2.0, 4096.0).unwrap()).take(floors).collect();
        let runs = whole_test(&rig, &commands);
        let channels = || -> Vec<_> {
            let parameters = parameters(&rig, 4096.0).unwrap();
            (0..floors).map(|_| RigChannel::<f64>::new(&parameters, rig.calibration.of(0)).unwrap()).collect()
        };
        let (mut controller, mut stand) = (channels(), VirtualRig::new(&rig).unwrap());
        let mut tripped = false;
        for i in 0..commands[0].values.len() {
            // The state is stored and restored into other objects during the test.
            if i % 1000 == 777 {
                let state = stand.state();
                stand = VirtualRig::new(&rig).unwrap();
                stand.go_to(&state).unwrap();
                let learned: Vec<_> = controller.iter().map(RigChannel::state).collect();
                controller = channels();
                controller.iter_mut().zip(&learned).for_each(|(one, state)| one.go_to(state).unwrap());
            }
            for (reading, run) in stand.readings().zip(&runs) {
                assert_eq!(reading.truth.force.to_bits(), run.force[i].to_bits(), "sample {i}");
            }
            if tripped {
                controller.iter_mut().for_each(RigChannel::trip);
            }
            let readings: Vec<_> = stand.readings().collect();
            let voltages: Vec<_> = (controller.iter_mut().zip(&readings).zip(&commands))
                .map(|((channel, reading), command)| {
                    let now = command.values[i];
                    let next = command.values.get(i + 1).copied().unwrap_or(now);
                    let out = channel.step(&input(reading, now, next));
                    tripped |= out.status & status::TRIPPED != 0;
                    out.voltage
                })
                .collect();
            stand.step(&voltages, tripped).unwrap();
            let estimates = runs[0].flow_gain_estimate();
            if !estimates.is_empty() {
                assert_eq!(controller[0].estimates(&rig)[0], ("flow_gain_estimate", estimates.at(i)));
            }
        }
    }
}

#[test]
fn bad_commands_and_states_are_named_and_change_nothing() {
    let mut stand = VirtualRig::new(&rig(&[])).unwrap();
    stand.step(&[0.1], false).unwrap();
    let state = stand.state();
    let text = |result: Result<()>| result.unwrap_err().to_string();
    assert!(text(stand.step(&[f64::NAN], false)).starts_with("valve_command = NaN"));
    assert!(text(stand.step(&[0.1, 0.1], false)).starts_with("valve_command = 2 values"));
    let short = format!("state = {} numbers", state.len() - 1);
    assert!(text(stand.go_to(&state[1..])).starts_with(&short));
    assert_eq!(stand.state(), state);
    assert!(text(stand.step(&[f64::MAX], false)).contains("diverge"));
}

#[test]
fn a_valve_off_its_null_starts_alike_on_the_fast_path_and_beyond_it() {
    for realization in ["digital", "analog"] {
        let rig = rig(&[
            ("controller.realization", realization.into()),
            ("servovalve.null_bias", 0.01.into()),
            ("truth.servovalve.null_bias", 0.0.into()),
        ]);
        let command = [sine_sweep(4000.0, 0.5, 6.0, 1.0, 4096.0).unwrap()];
        let run = |method| {
            let options = SimulateOptions { method, ..SimulateOptions::default() };
            simulate_actuators::<f64>(&rig, &command, &options, |_, _| true).unwrap().remove(0)
        };
        let (exact, by_steps) = (run(Method::Exponential), run(Method::RungeKutta));
        let early = |run: &TestRun| run.force[..40].iter().fold(0.0, |most, f| f64::max(most, f.abs()));
        let off = exact.force.iter().zip(&by_steps.force).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(early(&exact) > 3e3 && off < 1e-3 * early(&exact), "{realization}: {off} N");
    }
}
