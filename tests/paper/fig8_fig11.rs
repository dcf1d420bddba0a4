//! Figs. 8 and 11 of the paper: sweeps under each compensation scheme, level and delay, compared with the results of an
//! independent model in `python/eft/data/paper.toml`.

use eft::core::status;
use eft::sim::excitation::sine_sweep;
use eft::sim::metrics::{fft_ratio, nrmse};
use eft::sim::{RigConfig, SimulateOptions, simulate};
use toml::{Table, Value};

/// A number of a table.
fn number(table: &Table, key: &str) -> f64 {
    let value = &table[key];
    value.as_float().or(value.as_integer().map(|i| i as f64)).unwrap()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

fn assert_near(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got}, reference {expected}");
}

/// Runs the case of that key and compares it with its reference.
fn check(key: &str) {
    let data: Table = include_str!("../../python/eft/data/paper.toml").parse().unwrap();
    let mut cases = data["case"].as_array().unwrap().iter().filter_map(Value::as_table);
    let case = cases.find(|case| case["key"].as_str() == Some(key)).unwrap();
    let (sweep, tolerance) = (data["sweep"].as_table().unwrap(), data["tolerance"].as_table().unwrap());
    let reference = case["reference"].as_table().unwrap();

    let changes = case["set"].as_table().unwrap();
    let changes: Vec<(&str, Value)> =
        changes.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
    let rig = RigConfig::zhao2005().replace(&changes).unwrap();
    let [start, end, duration, rate] =
        ["f_start", "f_end", "duration", "sample_rate"].map(|k| number(sweep, k));
    let command = sine_sweep(number(case, "amplitude"), start, end, duration, rate).unwrap();
    let run = simulate::<f64>(&rig, &command, &SimulateOptions::default(), |_, _| true).unwrap();

    let band: Vec<f64> =
        sweep["ratio_band"].as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect();
    let ratio = fft_ratio(&run.command, &run.force, run.sample_rate, band[0], band[1]).unwrap();
    let ((low, low_at), (high, high_at)) = (ratio.min(), ratio.max());
    let values = [
        ("max_spool", largest(&run.spool)),
        ("max_displacement", largest(&run.displacement)),
        ("nrmse", nrmse(&run.command, &run.force).unwrap()),
        ("ratio_min", low),
        ("ratio_max", high),
    ];
    for (name, got) in values {
        let expected = number(reference, name);
        assert_near(name, got, expected, number(tolerance, "relative") * expected);
    }
    let bins = number(tolerance, "bins") / duration + 1e-9;
    assert_near("ratio_min_at", low_at, number(reference, "ratio_min_at"), bins);
    assert_near("ratio_max_at", high_at, number(reference, "ratio_max_at"), bins);
    assert_eq!(run.status_union() & !status::SPOOL_WARNING, 0, "flags");
}

#[test]
fn fig8_nonlinear_compensation() {
    check("8.9-nonlinear");
}

#[test]
fn fig8_linear_compensation() {
    check("8.9-linear");
}

#[test]
fn fig8_without_compensation() {
    check("8.9-off");
}

#[test]
fn fig11a_level_0_98() {
    check("2.2-level-0.98");
}

#[test]
fn fig11a_level_1_02() {
    check("2.2-level-1.02");
}

#[test]
fn fig11b_delay_3_ms() {
    check("2.2-delay-3");
}

#[test]
fn fig11b_delay_7_ms() {
    check("2.2-delay-7");
}
