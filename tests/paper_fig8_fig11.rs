//! Figs. 8 and 11 of the paper: sweeps under each compensation scheme, level and delay, against the reference
//! results of an independent model.
#![allow(clippy::unwrap_used)]

use eft::core::status;
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::metrics::{fft_ratio, nrmse};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};

/// What the independent model gave, at 10 kHz.
struct Reference {
    max_spool: f64,
    max_displacement: f64,
    nrmse: f64,
    lowest: (f64, f64),
    highest: (f64, f64),
}

fn sweep(amplitude: f64) -> Command {
    sine_sweep(amplitude, 0.0, 10.0, 32.0, 10_000.0).unwrap()
}

fn run(changes: &[(&str, toml::Value)], amplitude: f64) -> TestRun {
    let rig = RigConfig::zhao2005().replace(changes).unwrap();
    simulate::<f64>(&rig, &sweep(amplitude), &SimulateOptions::default(), |_, _| true).unwrap()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

fn assert_near(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got}, reference {expected}");
}

fn check(run: &TestRun, reference: &Reference) {
    let within = |what, got: f64, expected: f64| assert_near(what, got, expected, 0.02 * expected);
    within("largest spool opening", largest(&run.spool), reference.max_spool);
    within("largest displacement in mm", 1e3 * largest(&run.displacement), reference.max_displacement);
    within("NRMSE", nrmse(&run.command, &run.force).unwrap(), reference.nrmse);
    let ratio = fft_ratio(&run.command, &run.force, run.sample_rate, 1.2, 2.0).unwrap();
    let ((low, low_at), (high, high_at)) = (ratio.min(), ratio.max());
    let bin = 1.0 / 32.0 + 1e-9;
    within("lowest ratio", low, reference.lowest.0);
    assert_near("frequency of the lowest ratio", low_at, reference.lowest.1, bin);
    within("highest ratio", high, reference.highest.0);
    assert_near("frequency of the highest ratio", high_at, reference.highest.1, bin);
    assert_eq!(run.status_union() & !status::SPOOL_WARNING, 0, "flags");
}

#[test]
fn fig8_nonlinear_compensation() {
    let run = run(&[], 8900.0);
    check(
        &run,
        &Reference {
            max_spool: 0.5513,
            max_displacement: 86.91,
            nrmse: 0.0581,
            lowest: (0.9377, 1.531),
            highest: (1.0127, 1.344),
        },
    );
}

#[test]
fn fig8_linear_compensation() {
    let run = run(&[("compensation.mode", "linear".into())], 8900.0);
    check(
        &run,
        &Reference {
            max_spool: 0.2887,
            max_displacement: 52.83,
            nrmse: 0.1421,
            lowest: (0.5255, 1.438),
            highest: (1.0100, 1.219),
        },
    );
}

#[test]
fn fig8_without_compensation() {
    let run = run(&[("compensation.mode", "off".into())], 8900.0);
    check(
        &run,
        &Reference {
            max_spool: 0.0394,
            max_displacement: 12.31,
            nrmse: 0.5288,
            lowest: (0.0289, 1.563),
            highest: (0.3120, 1.219),
        },
    );
}

#[test]
fn fig11a_level_0_98() {
    let run = run(&[("compensation.level", 0.98.into())], 2200.0);
    check(
        &run,
        &Reference {
            max_spool: 0.0989,
            max_displacement: 19.32,
            nrmse: 0.0685,
            lowest: (0.6855, 1.594),
            highest: (0.9788, 1.219),
        },
    );
}

#[test]
fn fig11a_level_1_02() {
    let run = run(&[("compensation.level", 1.02.into())], 2200.0);
    check(
        &run,
        &Reference {
            max_spool: 0.1435,
            max_displacement: 26.56,
            nrmse: 0.1195,
            lowest: (0.9799, 1.906),
            highest: (1.9509, 1.563),
        },
    );
}

#[test]
fn fig11b_delay_3_ms() {
    let run = run(&[("compensation.response_delay", 3e-3.into())], 2200.0);
    check(
        &run,
        &Reference {
            max_spool: 0.1142,
            max_displacement: 22.25,
            nrmse: 0.0961,
            lowest: (0.7611, 1.625),
            highest: (1.3051, 1.531),
        },
    );
}

#[test]
fn fig11b_delay_7_ms() {
    let run = run(&[("compensation.response_delay", 7e-3.into())], 2200.0);
    check(
        &run,
        &Reference {
            max_spool: 0.1220,
            max_displacement: 22.60,
            nrmse: 0.0821,
            lowest: (0.8159, 1.531),
            highest: (1.2760, 1.625),
        },
    );
}
