//! The plant sample by sample, compared with a whole test.

use eft_sim::closed_loop::{Method, PlantStepper, simulate_actuators};
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{Error, RigConfig, SimulateOptions, simulate};

const RATE: f64 = 2048.0;
const MASS: f64 = 7040.0;
const DAMPING: f64 = 4330.0;
const STIFFNESS: f64 = 693.8e3;

fn digital() -> RigConfig {
    RigConfig::zhao2005().replace(&[("controller.realization", "digital".into())]).unwrap()
}

fn runge_kutta() -> SimulateOptions {
    SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() }
}

/// The paper's rig on each of several floors.
fn building(stories: usize) -> RigConfig {
    let list = |value: f64| toml::Value::Array(vec![value.into(); stories]);
    digital()
        .replace(&[
            ("structure.kind", "shear_building".into()),
            ("structure.stories.masses", list(MASS)),
            ("structure.stories.dampings", list(DAMPING)),
            ("structure.stories.stiffnesses", list(STIFFNESS)),
        ])
        .unwrap()
}

#[test]
fn stepping_under_the_commands_of_a_test_gives_the_test() {
    let command = sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0).unwrap();
    for method in [Method::RungeKutta, Method::Exponential] {
        let options = SimulateOptions { method, ..SimulateOptions::default() };
        let run = simulate::<f64>(&digital(), &command, &options, |_, _| true).unwrap();
        let mut plant = PlantStepper::new(&digital(), 4096.0, &options).unwrap();
        for (i, v) in run.valve_command.iter().enumerate() {
            let now = plant.readings()[0];
            assert_eq!((now.force, now.displacement), (run.force[i], run.displacement[i]), "sample {i}");
            plant.step(&[*v]).unwrap();
        }
        plant.reset();
        assert_eq!((plant.readings()[0].force, plant.readings()[0].time), (0.0, 0.0));
    }
}

#[test]
fn stepping_a_building_under_the_commands_of_a_test_gives_the_test() {
    let tone = |amplitude: f64, i: u32| amplitude * (0.004 * f64::from(i)).sin();
    let command = |amplitude| Command::new((0..4096).map(|i| tone(amplitude, i)).collect(), RATE).unwrap();
    let (rig, options) = (building(2), SimulateOptions::default());
    let runs = simulate_actuators::<f64>(&rig, &[command(3e3), command(5e3)], &options, |_, _| true).unwrap();
    let mut plant = PlantStepper::new(&rig, RATE, &options).unwrap();
    for i in 0..4096 {
        for (reading, run) in plant.readings().iter().zip(&runs) {
            assert_eq!((reading.force, reading.displacement), (run.force[i], run.displacement[i]));
        }
        plant.step(&[runs[0].valve_command[i], runs[1].valve_command[i]]).unwrap();
    }
    plant.reset();
    assert_eq!(plant.readings()[1].force, 0.0);
}

/// Largest error of the forces (N) with the rig's own stories as external structure, exchanged at a rate
/// (Hz).
fn exchange_error(rig: &RigConfig, rate: f64) -> f64 {
    let options = runge_kutta();
    let mut inside = PlantStepper::new(rig, rate, &options).unwrap();
    let mut outside = inside.clone();
    let stories = inside.readings().len();
    let (mut x, mut v, mut worst) = (vec![0.0; stories], vec![0.0; stories], 0.0_f64);
    for i in 0..(2.0 * rate) as u32 {
        // Held over the samples of the lowest rate, so that every rate runs the same test.
        let t = (f64::from(i) / rate * 512.0).floor() / 512.0;
        let commands = [0.1 * (10.0 * t).sin(), 0.05 * (11.0 * t).sin()];
        let truth = inside.step(&commands[..stories]).unwrap();
        let force = outside.push(&commands[..stories]).unwrap();
        // The structure under the mean forces, in many small midpoint steps.
        let h = 1.0 / rate / 50.0;
        let accelerations = |x: &[f64], v: &[f64]| {
            let below = |values: &[f64], i: usize| if i == 0 { 0.0 } else { values[i - 1] };
            let columns = |i: usize| match i < stories {
                true => STIFFNESS * (x[i] - below(x, i)) + DAMPING * (v[i] - below(v, i)),
                false => 0.0,
            };
            (0..stories).map(|i| (force[i] - columns(i) + columns(i + 1)) / MASS).collect::<Vec<_>>()
        };
        for _ in 0..50 {
            let after = |from: &[f64], rate: &[f64], h: f64| {
                from.iter().zip(rate).map(|(from, rate)| from + h * rate).collect::<Vec<_>>()
            };
            let half = after(&v, &accelerations(&x, &v), 0.5 * h);
            x = after(&x, &half, h);
            v = after(&half, &accelerations(&x, &half), 0.5 * h);
        }
        outside.follow(&x, &v).unwrap();
        for (a, b) in outside.readings().iter().zip(&truth) {
            worst = worst.max((a.force - b.force).abs());
        }
    }
    worst
}

#[test]
fn the_exchange_is_of_second_order() {
    let linear = digital().replace(&[("structure.kind", "linear".into())]).unwrap();
    for rig in [linear, building(2)] {
        let errors = [1024.0, 2048.0, 4096.0].map(|rate| exchange_error(&rig, rate));
        for pair in errors.windows(2) {
            assert!(pair[1] < pair[0] / 3.0, "{errors:?}");
        }
    }
}

#[test]
fn bad_input_is_named() {
    let text = |error: Error| error.to_string();
    let mut plant = PlantStepper::new(&building(2), RATE, &SimulateOptions::default()).unwrap();
    assert!(text(plant.step(&[0.0]).unwrap_err()).starts_with("valve_command = 1 values: must be one"));
    assert!(text(plant.step(&[0.0, f64::NAN]).unwrap_err()).starts_with("valve_command = NaN"));
    assert!(text(plant.follow(&[0.0; 2], &[f64::INFINITY; 2]).unwrap_err()).starts_with("velocity = inf"));
    let mut plant = PlantStepper::new(&digital(), RATE, &SimulateOptions::default()).unwrap();
    assert!(text(plant.follow(&[f64::INFINITY], &[0.0]).unwrap_err()).starts_with("displacement = inf"));
    let error = plant.push(&[0.0]).unwrap_err();
    assert!(text(error).starts_with("method = Exponential: must be RungeKutta"));
    let error = PlantStepper::new(&digital(), -1.0, &SimulateOptions::default()).unwrap_err();
    assert!(text(error).starts_with("sample_rate = -1"));
}
