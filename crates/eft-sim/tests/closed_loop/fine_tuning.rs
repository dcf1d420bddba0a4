//! Fine-tuning from a simulated test.

use eft_sim::config::{ForceLoop, Mode, Realization, RigValues};
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::identification::{FineTuning, TestSignals, fine_tune};
use eft_sim::linear::delay_budget;
use eft_sim::{RigConfig, SimulateOptions, TestRun, simulate};

const RATE: f64 = 2048.0;
const BAND: (f64, f64) = (0.25, 10.0);

fn sweep() -> Command {
    sine_sweep(2200.0, 0.0, 10.0, 32.0, RATE).unwrap()
}

fn run(rig: &RigConfig) -> TestRun {
    simulate::<f64>(rig, &sweep(), &SimulateOptions::default(), |_, _| true).unwrap()
}

fn tuned(rig: &RigConfig) -> FineTuning {
    let run = run(rig);
    let signals =
        TestSignals { command: &run.command, force: run.measured_force(), velocity: run.measured_velocity() };
    fine_tune(rig, signals, RATE, BAND).unwrap()
}

fn rig(level: f64, delay: f64, realization: Realization) -> RigConfig {
    let tuned = |rig: &mut RigValues| {
        (rig.compensation.level, rig.compensation.response_delay) = (level, delay);
        rig.controller.realization = realization;
    };
    RigConfig::zhao2005().with(tuned).unwrap()
}

#[test]
fn the_settings_of_fig_11_lead_back_to_the_tuned_ones() {
    for realization in [Realization::Analog, Realization::Digital] {
        for (level, delay) in [(0.98, 5e-3), (1.02, 5e-3), (1.0, 3e-3), (1.0, 7e-3), (0.98, 3e-3)] {
            let rig = rig(level, delay, realization);
            let found = tuned(&rig);
            // The valve's gain is 0.1001, and the lead network divides by 0.1.
            let exact = delay_budget(&rig, RATE, (1.0, 2.5)).unwrap().path;
            let told = format!("{realization:?}, {level}, {delay}: {found:?}, exact {exact}");
            assert!((found.level.value - 1.0).abs() < 0.005, "{told}");
            assert!((found.response_delay.value - exact).abs() < 0.15e-3, "{told}");
            assert!((found.natural_frequency - 1.58).abs() < 0.07, "{told}");
        }
    }
}

#[test]
fn the_integral_part_of_a_designed_loop_is_no_part_of_the_compensation() {
    for feedforward in [false, true] {
        for (level, delay) in [(0.97, 5.4e-3), (0.97, 3.2e-3), (1.0, 5.4e-3)] {
            let rig = rig(level, delay, Realization::Digital).with(|rig| {
                rig.controller.force_loop = ForceLoop::Robust;
                rig.compensation.feedforward = feedforward;
            });
            let rig = rig.unwrap();
            let found = tuned(&rig);
            let exact = delay_budget(&rig, RATE, (1.0, 2.5)).unwrap().path;
            let told = format!("{feedforward}, {level}, {delay}: {found:?}, exact {exact}");
            assert!((found.level.value - 1.0).abs() < 0.005, "{told}");
            assert!((found.response_delay.value - exact).abs() < 0.2e-3, "{told}");
        }
    }
}

#[test]
fn wrong_settings_have_the_effects_of_the_paper() {
    let seen = |level, delay| tuned(&rig(level, delay, Realization::Analog));
    assert!(seen(0.98, 5e-3).force_ratio < 0.8 && seen(1.02, 5e-3).force_ratio > 1.3);
    let (little, much) = (seen(1.0, 3e-3), seen(1.0, 7e-3));
    assert!(little.peak < little.valley && much.peak > much.valley);
}

#[test]
fn a_wrong_flow_gain_shows_as_a_level_and_noise_as_uncertainty() {
    let wrong = rig(1.0, 4e-3, Realization::Digital).with(|rig| {
        rig.servovalve.flow_gain_scale = 0.97;
        rig.sensors.force.noise = 30.0;
        rig.sensors.velocity.noise = 2e-3;
    });
    let wrong = wrong.unwrap();
    let found = tuned(&wrong);
    assert!((found.level.value - 1.0 / 0.97).abs() < 0.006, "{found:?}");
    let exact = delay_budget(&wrong, RATE, (1.0, 2.5)).unwrap().path;
    assert!((found.response_delay.value - exact).abs() < 0.3e-3, "{found:?}");
    let clean = tuned(&rig(1.0, 4e-3, Realization::Digital));
    assert!(found.level.uncertainty > 1.2 * clean.level.uncertainty);
}

#[test]
fn data_that_cannot_be_tuned_are_refused() {
    let rig = rig(1.0, 5e-3, Realization::Analog);
    let run = run(&rig);
    let text = |rig: &RigConfig, force: &[f64], velocity: &[f64], band| {
        let signals = TestSignals { command: &run.command, force, velocity };
        fine_tune(rig, signals, RATE, band).unwrap_err().to_string()
    };
    let in_mode = |mode| rig.with(|rig| rig.compensation.mode = mode).unwrap();
    let off = in_mode(Mode::Off);
    assert!(text(&off, &run.force, &run.velocity, BAND).starts_with("compensation.mode = \"off\""));
    let learning = rig.with(|rig| rig.compensation.adaptive = true).unwrap();
    assert!(text(&learning, &run.force, &run.velocity, BAND).starts_with("compensation.adaptive = true"));
    let guarded = rig.with(|rig| rig.compensation.guard = true).unwrap();
    assert!(text(&guarded, &run.force, &run.velocity, BAND).starts_with("compensation.guard = true"));
    assert!(text(&rig, &run.force[1..], &run.velocity, BAND).starts_with("force = "));
    assert!(text(&rig, &run.force, &run.velocity, (3.0, 2.0)).starts_with("band = (3, 2)"));
    let still = vec![0.0; run.force.len()];
    assert!(text(&rig, &run.force, &still, BAND).starts_with("velocity = "));
    let mut gap = run.force.clone();
    gap[7] = f64::NAN;
    assert!(text(&rig, &gap, &run.velocity, BAND).starts_with("force = NaN at sample 7"));
    let linear = in_mode(Mode::Linear);
    let fast: Vec<f64> = run.velocity.iter().map(|v| 3.0 * v).collect();
    assert!(text(&linear, &run.force, &fast, BAND).contains("where the compensation is linear"));
    // A velocity sensor of the wrong sign, or a force in another unit.
    let turned: Vec<f64> = run.velocity.iter().map(|v| -v).collect();
    let kilo: Vec<f64> = run.force.iter().map(|f| f / 1e3).collect();
    assert!(text(&rig, &run.force, &turned, BAND).starts_with("velocity = against the force"));
    assert!(text(&rig, &kilo, &run.velocity, BAND).contains("times the command: must be about"));
}
