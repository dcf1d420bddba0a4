//! Compressibility of the virtual rig from noisy sensors, compared with their true values.

use eft_sim::excitation::sine_sweep;
use eft_sim::identification::{Estimate, MotionSignals, identify_force_loop};
use eft_sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

const RATE: f64 = 2048.0;
/// Capacities that the noise is relative to: force (N), velocity (m/s) and opening (1).
const FULL_SCALES: [(&str, f64); 3] = [("force", 156e3), ("velocity", 1.0), ("spool", 1.0)];

/// Uniform numbers in [0, 1).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

/// Errors in deviations of what is found in 24 sweeps of 2.2 or 8.9 kN to 40 Hz, with up to 0.1 % of noise.
fn errors(rig: &RigConfig, found: impl Fn(&TestRun) -> Estimate) -> Vec<f64> {
    let mut state = 11;
    let sweep = |seed: i64| {
        let (share, oil) = (1e-3 * uniform(&mut state), 0.7 + 0.7 * uniform(&mut state));
        let duration = 16.0 + 16.0 * uniform(&mut state);
        let oil = oil * rig.actuator.compressibility;
        let noise = FULL_SCALES.map(|(sensor, full)| (format!("truth.sensors.{sensor}.noise"), share * full));
        let mut keys: Vec<(&str, Value)> =
            noise.iter().map(|(key, noise)| (key.as_str(), Value::from(*noise))).collect();
        keys.push(("truth.sensors.seed", seed.into()));
        keys.push(("truth.actuator.compressibility", oil.into()));
        let sweep = sine_sweep([2200.0, 8900.0][seed as usize % 2], 0.0, 40.0, duration, RATE).unwrap();
        let rig = rig.replace(&keys).unwrap();
        let run = simulate::<f64>(&rig, &sweep, &SimulateOptions::default(), |_, _| true).unwrap();
        let found = found(&run);
        (found.value - oil) / found.uncertainty
    };
    (0..24).map(sweep).collect()
}

fn motion(run: &TestRun) -> MotionSignals<'_> {
    MotionSignals { spool: &run.measured_spool, velocity: &run.measured_velocity, force: &run.measured_force }
}

/// Refuses errors of which too few are within two deviations, or that are too large or all too small.
fn check(name: &str, errors: &[f64], least: f64, largest: f64) {
    let count = errors.len() as f64;
    let share = errors.iter().filter(|error| error.abs() < 2.0).count() as f64 / count;
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
    let holds = share >= least && (1.0 / 3.0..largest).contains(&rms);
    assert!(holds, "{name}: {share:.2} within two deviations, rms {rms:.2}");
}

#[test]
fn the_uncertainty_of_the_compressibility_holds_with_noise_in_a_force_loop_test() {
    let rig = RigConfig::zhao2005().replace(&[("controller.force_loop", "robust".into())]).unwrap();
    let oil = errors(&rig, |run| {
        identify_force_loop(&rig, &run.valve_command, motion(run), RATE).unwrap().compressibility
    });
    check("compressibility", &oil, 0.9, 1.3);
}
