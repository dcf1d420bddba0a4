//! The linear models compared with the simulator. The two share the configuration, but no equation.

use std::f64::consts::TAU;

use eft::sim::config::{MotionAt, Realization, RigValues, SupplySchedule, VelocitySource};
use eft::sim::excitation::Command;
use eft::sim::linear::{FlowGain, Time, linearize, stability_margin};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};

const RATE: f64 = 4096.0;

fn run(rig: &RigConfig, values: Vec<f64>) -> TestRun {
    let command = Command::new(values, RATE).unwrap();
    let options = SimulateOptions { largest_step: 1.0 / 16384.0, ..SimulateOptions::default() };
    simulate::<f64>(rig, &command, &options, |_, _| true).unwrap()
}

/// Fourier coefficient of each signal at a frequency (Hz) over whole periods.
fn coefficients<const N: usize>(signals: [&[f64]; N], frequency: f64) -> [(f64, f64); N] {
    let samples = signals[0].len();
    let mut sums = [(0.0, 0.0); N];
    for i in 0..samples {
        let (sin, cos) = (TAU * frequency * i as f64 / RATE).sin_cos();
        for ((re, im), signal) in sums.iter_mut().zip(signals) {
            *re += 2.0 / samples as f64 * signal[i] * cos;
            *im -= 2.0 / samples as f64 * signal[i] * sin;
        }
    }
    sums
}

/// Tones of the command (Hz).
const TONES: [f64; 13] = [0.5, 1.0, 1.5, 1.75, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 40.0, 50.0];
/// Time to settle to half a per cent of the structure's motion, and after it the common period of the tones (s).
const SETTLE: f64 = 12.0;
const PERIOD: f64 = 4.0;

/// Phases that keep the peaks low; 1 N a tone keeps the spool below 1e-3.
fn tones() -> Vec<f64> {
    let value = |i: usize| {
        let t = i as f64 / RATE;
        TONES.iter().enumerate().map(|(k, f)| (TAU * f * t + (k * k) as f64).sin()).sum()
    };
    (0..((SETTLE + PERIOD) * RATE) as usize).map(value).collect()
}

/// Largest relative error of the predicted response of every output at the tones.
fn worst_error(rig: &RigConfig, tones: &[f64]) -> (f64, String) {
    let run = run(rig, tones.to_vec());
    let model = linearize(rig, FlowGain::Mean, Time::Sampled(RATE)).unwrap();
    let mut worst = (0.0, String::new());
    let outputs = ["force", "velocity", "spool", "compensation", "measured_velocity"];
    let signals: [&[f64]; 6] =
        [&run.command, &run.force, &run.velocity, &run.spool, &run.compensation, run.measured_velocity()];
    let settled = signals.map(|signal| &signal[(SETTLE * RATE) as usize..]);
    for frequency in TONES {
        let [(re, im), found @ ..] = coefficients(settled, frequency);
        for (name, (x, y)) in outputs.into_iter().zip(found) {
            let expected = model.response(name, frequency).unwrap();
            let size = re * re + im * im;
            let got = ((x * re + y * im) / size, (y * re - x * im) / size);
            let error = (got.0 - expected.re).hypot(got.1 - expected.im) / expected.norm();
            if error > worst.0 {
                worst = (error, format!("{name} at {frequency} Hz: {got:?}, predicted {expected}"));
            }
        }
    }
    worst
}

/// A symmetric flow table from the negative half of Table 2. With the kink at the origin, even harmonics of one tone
/// would coincide with other tones.
fn symmetric(change: impl Fn(&mut RigValues)) -> RigConfig {
    let rig = RigConfig::zhao2005().with(|rig| {
        let flows = &mut rig.servovalve.flow_table.flows;
        let last = flows.len() - 1;
        for i in 0..last / 2 {
            flows[last - i] = -flows[i];
        }
        rig.compensation.level = 0.97;
        change(rig);
    });
    rig.unwrap()
}

type Case<'a> = (&'a str, &'a dyn Fn(&mut RigValues));

#[test]
fn sampled_model_predicts_the_small_signal_response_to_50_hz() {
    let cases: [Case; 21] = [
        ("analog", &|_| ()),
        ("digital", &|rig| rig.controller.realization = Realization::Digital),
        ("late", &|rig| rig.compensation.computation_delay = 3),
        ("late converter", &|rig| rig.dac.delay = 3),
        ("late converter, digital", &|rig| {
            rig.controller.realization = Realization::Digital;
            rig.controller.proportional_gain = 0.4;
            rig.dac.delay = 3;
        }),
        ("sensor gains", &|rig| {
            rig.sensors.force.gain = 1.05;
            rig.sensors.velocity.gain = 0.97;
        }),
        ("sensor gains, digital", &|rig| {
            rig.controller.realization = Realization::Digital;
            rig.controller.proportional_gain = 0.4;
            rig.sensors.force.gain = 0.95;
            rig.sensors.velocity.gain = 1.02;
        }),
        ("feedforward", &|rig| rig.compensation.feedforward = true),
        ("sensors", &|rig| {
            rig.controller.realization = Realization::Digital;
            rig.sensors.velocity.bandwidth = Some(300.0);
            rig.sensors.velocity.delay = 2;
            rig.sensors.force.bandwidth = Some(2000.0);
            rig.sensors.force.delay = 1;
            rig.controller.proportional_gain = 0.4;
        }),
        ("load cell, analog", &|rig| {
            rig.sensors.force.bandwidth = Some(800.0);
            rig.sensors.cell_mass = Some(200.0);
            rig.controller.proportional_gain = 0.4;
        }),
        ("torque motor", &|rig| {
            rig.servovalve.torque_motor_frequency = Some(250.0);
            rig.controller.proportional_gain = 0.3;
        }),
        ("torque motor, digital", &|rig| {
            rig.controller.realization = Realization::Digital;
            rig.servovalve.torque_motor_frequency = Some(300.0);
            rig.controller.proportional_gain = 0.3;
        }),
        ("attachment, measured at the piston", &|rig| {
            rig.actuator.attachment_stiffness = Some(5e8);
            rig.controller.proportional_gain = 0.3;
            rig.sensors.velocity.bandwidth = Some(500.0);
            rig.compensation.feedforward = true;
        }),
        ("attachment, measured at the structure, and areas", &|rig| {
            rig.actuator.attachment_stiffness = Some(3e8);
            rig.sensors.motion_at = MotionAt::Structure;
            rig.controller.proportional_gain = 0.4;
            rig.actuator.area_ratio = 1.3;
            // The valve's curve cancels the effect of the unequal areas, because a kink at the origin has no linear
            // model.
            let pulling = (2.0 / (1.0 + 1.3_f64.powi(3))).sqrt();
            for flow in &mut rig.servovalve.flow_table.flows {
                *flow /= pulling * if *flow < 0.0 { 1.3_f64.sqrt() } else { 1.0 };
            }
        }),
        ("derivative", &|rig| {
            rig.controller.velocity_source = VelocitySource::Derivative;
            rig.sensors.displacement.delay = 2;
            rig.sensors.displacement.bandwidth = Some(400.0);
            rig.sensors.displacement.gain = 0.98;
        }),
        ("derivative at a soft attachment", &|rig| {
            rig.controller.velocity_source = VelocitySource::Derivative;
            rig.actuator.attachment_stiffness = Some(2e8);
            rig.controller.proportional_gain = 0.3;
        }),
        ("observer at a soft attachment", &|rig| {
            rig.controller.velocity_source = VelocitySource::Observer;
            rig.controller.observer_mass = Some(7000.0);
            rig.controller.realization = Realization::Digital;
            rig.actuator.attachment_stiffness = Some(2e8);
            rig.controller.proportional_gain = 0.3;
            rig.sensors.displacement.delay = 8;
            rig.sensors.force.delay = 1;
            rig.sensors.force.gain = 1.02;
        }),
        ("accelerometer", &|rig| {
            rig.controller.velocity_source = VelocitySource::Accelerometer;
            rig.sensors.acceleration.bandwidth = Some(500.0);
            rig.sensors.acceleration.delay = 1;
            rig.sensors.acceleration.gain = 1.03;
        }),
        ("underlap", &|rig| {
            rig.servovalve.overlap = -0.005;
            rig.controller.proportional_gain = 0.3;
            rig.compensation.level = 0.45;
        }),
        ("leakage and a low supply", &|rig| {
            rig.servovalve.leakage.proportional = 2e-11;
            rig.servovalve.pilot_flow_limit = Some(1e-4);
            let schedule = SupplySchedule { times: vec![0.0], pressures: vec![0.97 * 1.9e7] };
            rig.supply.schedule = Some(schedule);
        }),
        ("measured supply", &|rig| {
            let schedule = SupplySchedule { times: vec![0.0], pressures: vec![0.8 * 1.9e7] };
            rig.supply.schedule = Some(schedule);
            rig.compensation.supply_correction = true;
            rig.sensors.supply_pressure.gain = 1.04;
        }),
    ];
    let tones = tones();
    for (name, change) in cases {
        let (error, what) = worst_error(&symmetric(change), &tones);
        assert!(error < 0.01, "{name}: {error} {what}");
    }
}

#[test]
fn sampled_model_is_of_the_true_plant_under_the_controller_as_configured() {
    for realization in ["analog", "digital"] {
        let changes = [
            ("controller.realization", realization.into()),
            ("controller.proportional_gain", 0.5.into()),
            ("compensation.feedforward", true.into()),
            ("compensation.level", 0.95.into()),
            ("truth.actuator.piston_area", (1.02 * 8.212e-3).into()),
            ("truth.actuator.compressibility", 6e-13.into()),
            ("truth.servovalve.pilot_time_constant", 1.8e-3.into()),
            ("truth.structure.mass", 8000.0.into()),
            ("truth.sensors.velocity.delay", 1.into()),
            ("truth.sensors.force.bandwidth", 1500.0.into()),
        ];
        let rig = symmetric(|_| ()).replace::<&str>(&changes).unwrap();
        let (error, what) = worst_error(&rig, &tones());
        assert!(error < 0.01, "{realization}: {error} {what}");
    }
}

/// Whether a small push has grown after 20 s.
fn grows(rig: &RigConfig, level: f64) -> bool {
    let rig = rig.with(|rig| rig.compensation.level = level).unwrap();
    let samples = (44.0 * RATE) as usize;
    let push = |i: usize| if i < 400 { 20.0 } else { 0.0 };
    let run = run(&rig, (0..samples).map(push).collect());
    let energy = |from: f64| -> f64 {
        let part = &run.velocity[(from * RATE) as usize..((from + 4.0) * RATE) as usize];
        part.iter().map(|v| v * v).sum()
    };
    energy(40.0) > energy(20.0)
}

#[test]
fn the_simulator_is_stable_half_a_percent_below_the_linear_margin_and_not_above() {
    for realization in [Realization::Analog, Realization::Digital] {
        let rig = RigConfig::zhao2005().with(|rig| rig.controller.realization = realization).unwrap();
        let margin = stability_margin(&rig, FlowGain::Mean, Time::Sampled(RATE)).unwrap();
        let grows = [0.995, 1.005].map(|share| grows(&rig, share * margin));
        assert_eq!(grows, [false, true], "{realization:?}: {margin}");
    }
}
