//! Common parts of the tests beyond the paper: deviating rigs, sensors, measures of the result.

use eft::core::status;
use eft::sim::batch::{BatchOptions, Test, simulate_batch};
use eft::sim::excitation::{Command, sine_sweep};
use eft::sim::metrics::{fft_ratio, nrmse};
use eft::sim::{RigConfig, SimulateOptions, TestRun, simulate};
use toml::Value;

pub(crate) type Change = (String, Value);

pub(crate) const RATE: f64 = 4096.0;

pub(crate) fn sweep(amplitude: f64) -> Command {
    sine_sweep(amplitude, 0.0, 10.0, 32.0, RATE).unwrap()
}

pub(crate) fn set(key: &str, value: impl Into<Value>) -> Change {
    (key.into(), value.into())
}

/// Noise of 0.05 % of the range per sample and 16 bits, on every sensor.
pub(crate) fn noise(seed: i64) -> Vec<Change> {
    let ranges = [("force", 156e3), ("displacement", 0.127), ("spool", 1.0), ("velocity", 1.05)];
    let sensor = |(name, range): (&str, f64)| {
        [
            set(&format!("sensors.{name}.noise"), 5e-4 * range),
            set(&format!("sensors.{name}.range"), range),
            set(&format!("sensors.{name}.bits"), 16),
        ]
    };
    ranges.into_iter().flat_map(sensor).chain([set("sensors.seed", seed)]).collect()
}

/// The true flow over that of the controller's curve.
pub(crate) fn flow_gain(scale: f64) -> Change {
    set("servovalve.flow_gain_scale", scale)
}

/// A true valve of this response delay (s), 2ζ/ω_n = A_v/(K_3·K_vp), through the pilot's flow gain.
pub(crate) fn valve_delay(delay: f64) -> Change {
    set("servovalve.pilot_flow_gain", 1.964e-4 / (3579.13 * delay))
}

pub(crate) fn damping_ratio(ratio: f64) -> Change {
    set("structure.damping", 2.0 * ratio * (693.8e3_f64 * 7040.0).sqrt())
}

/// The paper's rig with these changes.
pub(crate) fn rig(changes: &[Change]) -> RigConfig {
    RigConfig::zhao2005().replace(changes).unwrap()
}

/// Feedforward, estimators with one flow gain, and guard on; the controller's configuration stays the nominal rig's.
pub(crate) fn adaptive(changes: &[Change]) -> RigConfig {
    correcting(false, changes)
}

/// With one flow gain, and with the flow curve corrected.
pub(crate) const EITHER: [bool; 2] = [false, true];

/// Name of the scheme with or without the correction of the curve.
pub(crate) fn flow(curve: bool) -> &'static str {
    if curve { "flow curve" } else { "one gain" }
}

/// [`adaptive`], with the flow curve corrected or not.
pub(crate) fn correcting(curve: bool, changes: &[Change]) -> RigConfig {
    let switches = ["feedforward", "adaptive", "curve_correction"]
        .map(|switch| set(&format!("compensation.{switch}"), switch != "curve_correction" || curve));
    rig(&switches).replace(changes).unwrap()
}

/// A sensor that fails for a duration (s).
pub(crate) fn fault(signal: &str, kind: &str, start: f64, duration: f64) -> Vec<Change> {
    vec![
        set("sensors.fault.signal", signal),
        set("sensors.fault.kind", kind),
        set("sensors.fault.start", start),
        set("sensors.fault.duration", duration),
    ]
}

pub(crate) fn run(rig: &RigConfig, command: &Command) -> TestRun {
    simulate::<f64>(rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
}

/// The tests of some rigs under one command, side by side, with the bits of [`run`].
pub(crate) fn runs(rigs: &[RigConfig], command: &Command) -> Vec<TestRun> {
    let commands = std::slice::from_ref(command);
    let tests: Vec<_> = rigs.iter().map(|rig| Test { rig, commands }).collect();
    let options = BatchOptions { traces: true, ..BatchOptions::default() };
    let outcomes = simulate_batch::<f64>(&tests, &options, |_, _| true).unwrap();
    outcomes.into_iter().flat_map(|outcome| outcome.unwrap().runs).collect()
}

pub(crate) fn error(run: &TestRun) -> f64 {
    nrmse(&run.command, &run.force).unwrap()
}

/// Least and largest ratio of the spectra in a band (Hz).
pub(crate) fn ratio(run: &TestRun, low: f64, high: f64) -> (f64, f64) {
    let ratio = fft_ratio(&run.command, &run.force, run.sample_rate, low, high).unwrap();
    (ratio.min().0, ratio.max().0)
}

#[track_caller]
pub(crate) fn assert_within(what: &str, (least, largest): (f64, f64), lowest: f64, highest: f64) {
    assert!(
        least >= lowest && largest <= highest,
        "{what}: ratio {least:.4} to {largest:.4}, wanted {lowest} to {highest}"
    );
}

#[track_caller]
pub(crate) fn assert_quiet(run: &TestRun) {
    let expected = status::SPOOL_WARNING;
    assert_eq!(run.status_union() & !expected, 0, "flags");
}

pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

/// Largest distance of a trace from a value within these samples.
pub(crate) fn moved(trace: &[f64], from: f64, samples: std::ops::Range<usize>) -> f64 {
    trace[samples].iter().fold(0.0, |most: f64, value| most.max((value - from).abs()))
}

/// The largest relative distance of the found curve from the known one times a flow gain, for openings from 4 % to
/// `widest`.
pub(crate) fn curve_departure(run: &TestRun, gain: f64, widest: f64) -> f64 {
    let known = &run.rig.servovalve.flow_table;
    let expected = known.openings.iter().zip(&known.flows).zip(&run.found_flows);
    let seen: Vec<_> = expected.filter(|((x, _), _)| (0.04..widest).contains(&x.abs())).collect();
    assert!(!seen.is_empty(), "no opening to judge by");
    seen.into_iter().fold(0.0, |most: f64, ((_, q), found)| most.max((found / (gain * q) - 1.0).abs()))
}

/// The largest ratio of the running peaks of true and ideal displacement, after the begin of the motion.
pub(crate) fn overshoot(run: &eft::sim::TestRun, ideal: &[f64]) -> f64 {
    let began = 0.2 * largest(ideal);
    let (mut peak, mut ideal_peak, mut worst) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (x, ideal) in run.displacement.iter().zip(ideal) {
        peak = peak.max(x.abs());
        ideal_peak = ideal_peak.max(ideal.abs());
        if ideal_peak > began {
            worst = worst.max(peak / ideal_peak);
        }
    }
    worst
}
