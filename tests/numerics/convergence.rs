//! The simulation converges, and the default step is fine enough at every sample rate in use.

use eft::core::status;
use eft::sim::closed_loop::{DEFAULT_STEP, Method};
use eft::sim::excitation::sine_sweep;
use eft::sim::{RigConfig, SimulateOptions, simulate};

use crate::results::keep;

/// Force of the 8.9 kN sweep to 10 Hz with steps of `step` s.
fn force(rig: &RigConfig, sample_rate: f64, step: f64, method: Method) -> Vec<f64> {
    let command = sine_sweep(8900.0, 0.0, 10.0, 32.0, sample_rate).unwrap();
    let options = SimulateOptions { largest_step: step, method };
    simulate::<f64>(rig, &command, &options, |_, _| true).unwrap().traces.force
}

/// The force with a sixteenth of the default step.
fn converged(rig: &RigConfig, sample_rate: f64) -> Vec<f64> {
    force(rig, sample_rate, DEFAULT_STEP / 16.0, Method::RungeKutta)
}

/// Largest difference, against the largest force of the reference.
fn distance(a: &[f64], reference: &[f64]) -> f64 {
    let peak = reference.iter().fold(0.0_f64, |most, f| f.abs().max(most));
    a.iter().zip(reference).fold(0.0_f64, |most, (a, b)| (a - b).abs().max(most)) / peak
}

fn realization(name: &str) -> RigConfig {
    RigConfig::zhao2005().replace(&[("controller.realization", name.into())]).unwrap()
}

/// Realization, sample rate (Hz), and for some methods the least factor by which half the step lowers the error.
type Case<'a> = (&'a str, f64, &'a [(Method, f64)]);

/// With the lowest rates at which the paper's rig is stable, a factor of two apart.
const CASES: [Case; 6] = [
    ("analog", 1024.0, &[(Method::Exponential, 3.0), (Method::RungeKutta, 2.0)]),
    ("digital", 2048.0, &[(Method::Exponential, 3.0)]),
    ("analog", 4096.0, &[]),
    ("digital", 4096.0, &[]),
    ("analog", 10_000.0, &[]),
    ("digital", 10_000.0, &[]),
];

fn check_order(name: &str, sample_rate: f64, method: Method, factor: f64, converged: &[f64]) {
    let rig = realization(name);
    let errors = [2048.0, 4096.0, 8192.0]
        .map(|rate| distance(&force(&rig, sample_rate, 1.0 / rate, method), converged));
    for pair in errors.windows(2) {
        // The error of smooth parts falls by 8 and by 16. Steps over a kink limit the order of the largest error.
        assert!(pair[1] < pair[0] / factor, "{name}, {method:?}: {errors:?}");
    }
}

#[test]
fn half_the_step_lowers_the_error_and_the_default_one_is_within_1e_4_of_the_converged_force() {
    for (name, sample_rate, methods) in CASES {
        let rig = realization(name);
        let converged = converged(&rig, sample_rate);
        for (method, factor) in methods {
            check_order(name, sample_rate, *method, *factor, &converged);
        }
        for method in [Method::Exponential, Method::RungeKutta] {
            let error = distance(&force(&rig, sample_rate, DEFAULT_STEP, method), &converged);
            keep(format_args!("{name} at {sample_rate} Hz, {method:?}"), &[("error", error)]);
            assert!(error < 1e-4, "{name} at {sample_rate} Hz, {method:?}: {error:.1e}");
        }
    }
}

// The spool slams from stop to stop, which multiplies every error; only the higher order gets through.
#[test]
fn half_the_step_lowers_the_error_of_an_unstable_loop() {
    let converged = converged(&realization("digital"), 1024.0);
    check_order("digital", 1024.0, Method::RungeKutta, 2.0, &converged);
}

#[test]
fn the_methods_agree_where_spool_and_command_are_limited() {
    let sweep = |amplitude| sine_sweep(amplitude, 0.0, 10.0, 8.0, 4096.0).unwrap();
    let limited = RigConfig::zhao2005().replace(&[("limits.valve_command", 1.0.into())]).unwrap();
    for (rig, command, flag) in
        [(RigConfig::zhao2005(), sweep(80_000.0), status::SPOOL_STOP), (limited, sweep(8900.0), 0)]
    {
        let run = |options| simulate::<f64>(&rig, &command, &options, |_, _| true).unwrap();
        let (default, converged) = (run(SimulateOptions::default()), run(SimulateOptions::CONVERGED));
        assert_eq!(default.status_union() & flag, flag, "the limit is reached");
        let error = distance(&default.force, &converged.force);
        assert!(error < 1e-3, "{error:.1e}");
    }
}
