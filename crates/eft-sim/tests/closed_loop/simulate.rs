//! Tests of buildings against single rigs and their own energy; the digital side against the firmware's channel.

use eft_sim::closed_loop::{
    Method, Precision, energy_balance, ideal_responses, simulate_actuators, simulate_by_channel,
};
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{RigConfig, SimulateOptions, TestRun, simulate};

const RATE: f64 = 2048.0;

fn building(stories: usize, changes: &[(&str, toml::Value)]) -> RigConfig {
    let list = |value: f64| toml::Value::Array(vec![value.into(); stories]);
    let mut all = vec![
        ("structure.kind", "shear_building".into()),
        ("structure.stories.masses", list(7040.0)),
        ("structure.stories.dampings", list(4330.0)),
        ("structure.stories.stiffnesses", list(693.8e3)),
    ];
    all.extend(changes.iter().cloned());
    RigConfig::zhao2005().replace(&all).unwrap()
}

fn run(rig: &RigConfig, commands: &[Command]) -> Vec<TestRun> {
    simulate_actuators::<f64>(rig, commands, &SimulateOptions::default(), |_, _| true).unwrap()
}

#[test]
fn a_building_of_one_story_is_the_single_rig_to_the_last_bit() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, RATE).unwrap();
    let mut all_effects = vec![
        ("actuator.dead_length", toml::Value::from(0.01)),
        ("actuator.friction", 200.0.into()),
        ("supply.droop", 3e8.into()),
        ("supply.accumulator", 5e-10.into()),
        ("servovalve.leakage.constant", 4e-5.into()),
        ("sensors.force.bandwidth", 500.0.into()),
    ];
    all_effects.push(("controller.realization", "digital".into()));
    let analog = vec![("sensors.force.noise", toml::Value::from(20.0))];
    let digital = vec![("controller.realization", toml::Value::from("digital"))];
    for changes in [analog, digital, all_effects] {
        let building = building(1, &changes);
        let single = building.replace(&[("structure.kind", toml::Value::from("linear"))]).unwrap();
        // The method of buildings, because two methods differ by their errors.
        let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
        let commands = std::slice::from_ref(&command);
        let [one, alone] = [&building, &single]
            .map(|rig| simulate_actuators::<f64>(rig, commands, &options, |_, _| true).unwrap().remove(0));
        assert!(one.force.iter().any(|force| force.abs() > 5e3));
        for (a, b) in [(&one.force, &alone.force), (&one.displacement, &alone.displacement)] {
            assert_eq!(a, b, "{changes:?}");
        }
        let ideals = [&building, &single].map(|rig| ideal_responses(rig, commands, &options).unwrap());
        assert_eq!(ideals[0], ideals[1]);
        let balances = [&building, &single].map(|rig| energy_balance(rig, commands, &options).unwrap());
        assert_eq!(balances[0], balances[1]);
    }
}

#[test]
fn every_actuator_has_noise_of_its_own() {
    let command = sine_sweep(2000.0, 0.0, 10.0, 0.5, RATE).unwrap();
    let rig = building(3, &[("sensors.velocity.noise", 1e-3.into())]);
    let runs = run(&rig, &vec![command; 3]);
    let noise = |run: &TestRun| {
        let pairs = run.measured_velocity().iter().zip(&run.velocity);
        pairs.map(|(a, b)| a - b).collect::<Vec<_>>()
    };
    assert_ne!(noise(&runs[0]), noise(&runs[1]));
    assert_ne!(noise(&runs[1]), noise(&runs[2]));
}

#[test]
fn compensated_actuators_move_the_building_as_ideal_ones_do() {
    let command = sine_sweep(3000.0, 0.2, 6.0, 16.0, RATE).unwrap();
    let commands = vec![command; 3];
    let errors = |mode: &str, feedforward: bool| {
        let rig = building(
            3,
            &[("compensation.mode", mode.into()), ("compensation.feedforward", feedforward.into())],
        );
        let ideal = ideal_responses(&rig, &commands, &SimulateOptions::default()).unwrap();
        let pairs = ideal.into_iter().zip(run(&rig, &commands));
        pairs
            .map(|(ideal, real)| eft_sim::metrics::nrmse(&ideal.displacement, &real.displacement).unwrap())
            .collect::<Vec<_>>()
    };
    let (with, without) = (errors("nonlinear", true), errors("off", false));
    for (with, without) in with.iter().zip(&without) {
        assert!(*with < 0.15 && *without > 0.5, "{with} against {without}");
    }
}

#[test]
fn energy_of_a_building_adds_up_and_closer_with_a_smaller_step() {
    let command = sine_sweep(6000.0, 0.2, 6.0, 4.0, RATE).unwrap();
    let rig = building(
        3,
        &[
            ("actuator.dead_length", 0.01.into()),
            ("actuator.friction", 200.0.into()),
            ("supply.droop", 3e8.into()),
            ("supply.accumulator", 5e-10.into()),
            ("servovalve.leakage.proportional", 2e-12.into()),
            ("servovalve.leakage.constant", 4e-5.into()),
        ],
    );
    let gap = |divisor: f64| {
        let options =
            SimulateOptions { largest_step: 1.0 / (4096.0 * divisor), ..SimulateOptions::default() };
        let balance = energy_balance(&rig, &vec![command.clone(); 3], &options).unwrap();
        for part in [balance.droop, balance.valve, balance.leakage, balance.friction, balance.damping] {
            assert!(part > 1e-4 * balance.supplied, "{balance:?}");
        }
        balance.gap().abs()
    };
    let gaps = [0.5, 2.0].map(gap);
    assert!(gaps[0] < 1e-6 && gaps[1] < gaps[0] / 4.0, "{gaps:?}");
}

#[test]
fn a_command_that_does_not_fit_the_building_is_refused() {
    let command = sine_sweep(2000.0, 0.0, 10.0, 0.5, RATE).unwrap();
    let rig = building(2, &[]);
    let refused = |commands: &[Command]| {
        let options = SimulateOptions::default();
        simulate_actuators::<f64>(&rig, commands, &options, |_, _| true).unwrap_err().to_string()
    };
    assert!(refused(std::slice::from_ref(&command)).contains("must be one for each of 2 stories"));
    let other = sine_sweep(2000.0, 0.0, 10.0, 0.25, RATE).unwrap();
    assert!(refused(&[command.clone(), other]).contains("must all have"));
    let options = SimulateOptions::default();
    let error = simulate::<f64>(&rig, &command, &options, |_, _| true).unwrap_err().to_string();
    assert!(error.starts_with("structure.kind = \"shear_building\""), "{error}");
    let plain = simulate_actuators::<f64>(&RigConfig::zhao2005(), &vec![command; 2], &options, |_, _| true);
    assert!(plain.unwrap_err().to_string().starts_with("commands = 2: must be one for each of 1 story"));
}

/// A test whose digital side is the channel and the learner of the firmware.
fn by_channel<P: Precision>(rig: &RigConfig, command: &Command) -> TestRun {
    simulate_by_channel(rig, command, P::WIDTH).unwrap()
}

#[test]
fn a_test_that_learns_has_the_bits_of_channel_and_learner() {
    let command = sine_sweep(6000.0, 0.0, 10.0, 2.0, 4096.0).unwrap();
    let noise: [(&str, toml::Value); 4] = [
        ("sensors.force.noise", 20.0.into()),
        ("sensors.velocity.noise", 1e-3.into()),
        ("sensors.velocity.dropout", 0.01.into()),
        ("sensors.spool.noise", 1e-3.into()),
    ];
    let changes: [&[(&str, toml::Value)]; 8] = [
        &[],
        &noise,
        &[("controller.realization", "digital".into()), ("truth.servovalve.flow_gain_scale", 0.9.into())],
        &[("compensation.mode", "linear".into()), ("compensation.curve_correction", false.into())],
        &[("structure.mass", 1e-3.into())],
        &[("limits.velocity_range", 0.05.into())],
        &[("compensation.computation_delay", 2.into()), ("compensation.feedforward", true.into())],
        &[("compensation.supply_correction", true.into()), ("compensation.level", 1.3.into())],
    ];
    for change in changes {
        let learns = [("compensation.adaptive", true.into())];
        let rig = RigConfig::zhao2005().replace(&[&learns, change].concat()).unwrap();
        let options = SimulateOptions::default();
        let double = simulate::<f64>(&rig, &command, &options, |_, _| true).unwrap();
        let single = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
        for (run, firmware) in
            [(double, by_channel::<f64>(&rig, &command)), (single, by_channel::<f32>(&rig, &command))]
        {
            assert_eq!(run.first_difference(&firmware), None, "{change:?}");
            assert_eq!(run.found_flows, firmware.found_flows, "{change:?}");
        }
    }
}

#[test]
fn a_test_of_many_steps_asks_soon_whether_to_go_on() {
    // Its friction needs seven thousand steps per tick.
    let rig = RigConfig::zhao2005().replace(&[("actuator.friction", 1e8.into())]).unwrap();
    let command = sine_sweep(2000.0, 1.0, 1.0, 48.0 / RATE, RATE).unwrap();
    let mut asked = Vec::new();
    let options = SimulateOptions::default();
    simulate::<f64>(&rig, &command, &options, |done, _| {
        asked.push(done);
        true
    })
    .unwrap();
    assert!(asked.windows(2).all(|two| two[1] - two[0] <= 20), "{asked:?}");
}
