//! A plant with values under `truth`, compared with a loop of the two rigs that is closed by hand.

use eft::core::{Input, Parameters, Realization};
use eft::sim::batch::{BatchOptions, Test, simulate_batch};
use eft::sim::closed_loop::{
    Method, PlantReading, PlantStepper, RigChannel, energy_balance, ideal_responses, parameters,
    simulate_actuators,
};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::feasibility::check_feasibility;
use eft::sim::identification::{flow_test, free_vibration, valve_test};
use eft::sim::linear::{FlowGain, Time, delay_budget, linearize, stability_margins, valve_response};
use eft::sim::{RigConfig, SimulateOptions, TestRun, ideal_response, simulate};
use toml::Value;

const RATE: f64 = 4096.0;

type Change = (String, Value);

fn set(key: &str, value: impl Into<Value>) -> Change {
    (key.into(), value.into())
}

fn rig(changes: &[Change]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

/// The same changes under `truth`.
fn as_truth(changes: &[Change]) -> Vec<Change> {
    changes.iter().map(|(key, value)| (format!("truth.{key}"), value.clone())).collect()
}

fn command() -> Command {
    sine_sweep(2200.0, 0.5, 5.0, 1.0, RATE).unwrap()
}

fn run(rig: &RigConfig, method: Method) -> TestRun {
    let options = SimulateOptions { method, ..SimulateOptions::default() };
    simulate::<f64>(rig, &command(), &options, |_, _| true).unwrap()
}

/// Plants that differ from the paper's in values that the paper's controller does not use.
fn plants() -> Vec<Vec<Change>> {
    let flows: Vec<f64> =
        RigConfig::zhao2005().servovalve.flow_table.flows.iter().map(|q| 0.95 * q).collect();
    let openings = RigConfig::zhao2005().servovalve.flow_table.openings.clone();
    vec![
        vec![set("servovalve.flow_gain_scale", 0.93)],
        vec![set("servovalve.pilot_time_constant", 1.1e-3), set("servovalve.pilot_flow_gain", 0.9e-5)],
        vec![
            set("servovalve.true_flow_table.openings", openings),
            set("servovalve.true_flow_table.flows", flows),
        ],
        vec![set("structure.mass", 9e3), set("structure.damping", 3e3), set("structure.stiffness", 9e5)],
        vec![set("structure.kind", "linear"), set("structure.stiffness", 5e5)],
        vec![set("actuator.compressibility", 9e-13), set("actuator.leakage", 2e-11)],
        vec![
            set("servovalve.leakage.constant", 4e-5),
            set("actuator.stop_stiffness", 1e8),
            set("actuator.dead_length", 0.01),
        ],
        vec![set("supply.schedule.times", vec![0.0]), set("supply.schedule.pressures", vec![1.5e7])],
        vec![
            set("sensors.force.noise", 20.0),
            set("sensors.velocity.gain", 0.98),
            set("sensors.force.bandwidth", 900.0),
            set("sensors.velocity.delay", 2),
            set("sensors.seed", 7),
        ],
        vec![set("dac.range", 5.0), set("dac.bits", 10)],
        vec![set("dac.delay", 3)],
    ]
}

#[test]
fn a_value_that_the_controller_does_not_use_may_be_under_truth() {
    let time = Time::Sampled(RATE);
    for realization in ["analog", "digital"] {
        let base =
            rig(&[set("controller.realization", realization), set("controller.proportional_gain", 0.5)]);
        let methods = [Method::Exponential, Method::RungeKutta].map(|method| (method, run(&base, method)));
        for (n, changes) in plants().iter().enumerate() {
            let (known, hidden) = (base.replace(changes).unwrap(), base.replace(&as_truth(changes)).unwrap());
            assert_ne!(known, hidden);
            for (method, base) in &methods {
                let [known, hidden] = [&known, &hidden].map(|rig| run(rig, *method));
                assert_eq!(known.first_difference(&hidden), None, "plant {n}, {realization}");
                assert!(known.first_difference(base).is_some(), "plant {n} makes no difference");
            }
            let of =
                |judge: &dyn Fn(&RigConfig) -> String| assert_eq!(judge(&known), judge(&hidden), "plant {n}");
            let (command, options) = (command(), SimulateOptions::default());
            of(&|rig| {
                format!("{:?}", energy_balance(rig, std::slice::from_ref(&command), &options).unwrap())
            });
            of(&|rig| format!("{:?}", linearize(rig, FlowGain::Mean, time).unwrap()));
            of(&|rig| format!("{:?}", linearize(rig, FlowGain::Nominal, Time::Continuous).unwrap()));
            of(&|rig| format!("{:?}", delay_budget(rig, RATE, (0.5, 10.0)).unwrap()));
            let mut steppers = [&known, &hidden].map(|rig| PlantStepper::new(rig, RATE, &options).unwrap());
            for _ in 0..20 {
                let [known, hidden] = steppers.each_mut().map(|plant| plant.step(&[0.2]).unwrap());
                assert_eq!(known, hidden);
            }
            // The others look at the plant alone, or at the linear models that were just compared.
            if realization == "analog" {
                continue;
            }
            of(&|rig| format!("{:?}", ideal_response(rig, &command, &options).unwrap()));
            of(&|rig| format!("{:?}", stability_margins(rig, FlowGain::Steeper, time).unwrap()));
            of(&|rig| format!("{:?}", valve_response(rig, 20.0)));
            of(&|rig| format!("{:?}", check_feasibility(rig, std::slice::from_ref(&command)).unwrap()));
            of(&|rig| format!("{:?}", valve_test(rig, 0.0254, 512.0).unwrap()));
            of(&|rig| format!("{:?}", flow_test(rig, 0.03, 3.0, 0.2, 20.0, 1024.0).unwrap()));
            of(&|rig| format!("{:?}", free_vibration(rig, 0.03, 0.5, 512.0).unwrap()));
        }
    }
}

#[test]
fn side_by_side_too() {
    let (command, options) = (command(), BatchOptions::default());
    let of = |change: fn(&[Change]) -> Vec<Change>| {
        let rigs: Vec<_> = plants().iter().map(|changes| rig(&change(changes))).collect();
        let tests: Vec<_> =
            rigs.iter().map(|rig| Test { rig, commands: std::slice::from_ref(&command) }).collect();
        let outcomes = simulate_batch::<f64>(&tests, &options, |_, _| true).unwrap();
        outcomes.into_iter().map(Result::unwrap).collect::<Vec<_>>()
    };
    assert_eq!(of(<[Change]>::to_vec), of(as_truth));
}

#[test]
fn buildings_too() {
    let list = |value: f64| vec![value; 2];
    let base = rig(&[
        set("structure.kind", "shear_building"),
        set("structure.stories.masses", list(7040.0)),
        set("structure.stories.dampings", list(4330.0)),
        set("structure.stories.stiffnesses", list(693.8e3)),
    ]);
    let changes = [
        set("structure.stories.masses", vec![6000.0, 8000.0]),
        set("servovalve.flow_gain_scale", 0.95),
        set("supply.droop", 3e8),
        set("supply.accumulator", 5e-10),
        set("sensors.spool.noise", 1e-3),
    ];
    let rigs = [base.replace(&changes).unwrap(), base.replace(&as_truth(&changes)).unwrap()];
    let (commands, options) = (vec![command(); 2], SimulateOptions::default());
    let [known, hidden] =
        rigs.each_ref().map(|rig| simulate_actuators::<f64>(rig, &commands, &options, |_, _| true).unwrap());
    for (known, hidden) in known.iter().zip(&hidden) {
        assert_eq!(known.first_difference(hidden), None);
    }
    let [known, hidden] = rigs.each_ref().map(|rig| ideal_responses(rig, &commands, &options).unwrap());
    assert_eq!(known, hidden);
    let [known, hidden] =
        rigs.each_ref().map(|rig| linearize(rig, FlowGain::Mean, Time::Sampled(RATE)).unwrap());
    assert_eq!(known, hidden);
    let [known, hidden] = rigs.each_ref().map(|rig| {
        let mut plant = PlantStepper::new(rig, RATE, &options).unwrap();
        plant.step(&[0.2, 0.1]).unwrap()
    });
    assert_eq!(known, hidden);
}

/// A digital test of the controller of one rig on the plant of another, the two of them stepped by hand.
fn by_hand(controller: &RigConfig, plant: &RigConfig) -> Vec<PlantReading> {
    let command = command();
    let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
    let mut plant = PlantStepper::new(plant, RATE, &options).unwrap();
    let digital = Parameters { realization: Realization::Digital, ..parameters(controller, RATE).unwrap() };
    let mut channel = RigChannel::<f64>::new(&digital, None).unwrap();
    let step = |(i, now): (usize, &f64)| {
        let seen = plant.readings()[0];
        let input = Input {
            command: *now,
            next_command: command.values.get(i + 1).copied().unwrap_or(*now),
            velocity: seen.velocity,
            force: seen.force,
            spool: seen.spool,
            displacement: seen.displacement,
            valve_command: 0.0,
            supply_pressure: seen.supply_pressure,
            acceleration: seen.acceleration,
            ..Input::default()
        };
        plant.step(&[channel.step(&input).voltage]).unwrap();
        seen
    };
    command.values.iter().enumerate().map(step).collect()
}

#[test]
fn a_value_that_the_controller_uses_differs_under_truth() {
    let changes = [
        set("actuator.piston_area", 8.0e-3),
        set("actuator.compressibility", 6e-13),
        set("actuator.leakage", 3e-11),
        set("supply.pressure", 1.7e7),
        set("structure.mass", 8e3),
    ];
    for scheme in ["compensation.feedforward", "compensation.adaptive"] {
        // With a leakage the simulation uses the general plant, as the stepper always does.
        let base = rig(&[
            set("controller.realization", "digital"),
            set("controller.proportional_gain", 0.5),
            set("servovalve.leakage.proportional", 1e-12),
            set("compensation.feedforward", true),
            set(scheme, true),
        ]);
        let hidden = run(&base.replace(&as_truth(&changes)).unwrap(), Method::RungeKutta);
        let known = base.replace(&changes).unwrap();
        for (i, reading) in by_hand(&base, &known).iter().enumerate() {
            assert_eq!(reading.force, hidden.force[i], "{scheme}, sample {i}");
            assert_eq!(reading.displacement, hidden.displacement[i], "{scheme}, sample {i}");
        }
        assert!(run(&known, Method::RungeKutta).first_difference(&hidden).is_some());
    }
}

#[test]
fn the_found_flow_curve_does_not_change_the_true_one() {
    let flows: Vec<f64> =
        RigConfig::zhao2005().servovalve.flow_table.flows.iter().map(|q| 0.95 * q).collect();
    let rig = rig(&[
        set("compensation.adaptive", true),
        set("truth.servovalve.flow_table.flows", flows.clone()),
        set("truth.structure.mass", 8e3),
    ]);
    let found = run(&rig, Method::Exponential);
    let corrected = found.corrected_rig().unwrap();
    assert_eq!(corrected.plant().servovalve.true_flow_table.as_ref().unwrap().flows, flows);
    assert_eq!(corrected.servovalve.flow_table.flows, found.found_flows);
    assert_eq!(corrected.plant().structure.mass, 8e3);
}
