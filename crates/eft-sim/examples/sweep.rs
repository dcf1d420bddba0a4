//! The paper's sweep on a rig, alone or eight times side by side, for counting or profiling:
//! `cargo run --release --package eft-sim --example sweep -- one|batch SECONDS [RIG]`, with a rig of `plain`,
//! `adaptive`,
//! `noisy` (adaptive, with noise on every sensor), `traces` (plain, traces kept), `stories` and `runge-kutta`.

use std::process::ExitCode;

use eft_sim::batch::{BatchOptions, Test, simulate_batch};
use eft_sim::closed_loop::{Method, simulate_actuators};
use eft_sim::excitation::{Command, sine_sweep};
use eft_sim::{Error, Result, RigConfig, SimulateOptions};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let what = arguments.first().map(String::as_str);
    let seconds = arguments.get(1).and_then(|text| text.parse().ok());
    let rig = arguments.get(2).map_or("plain", String::as_str);
    let (Some(what @ ("one" | "batch")), Some(seconds)) = (what, seconds) else {
        eprintln!("usage: sweep one|batch SECONDS [plain|adaptive|noisy|traces|stories|runge-kutta]");
        return ExitCode::from(2);
    };
    match run(what == "batch", seconds, rig) {
        Ok(metric) => {
            println!("{metric}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// The last force (N) of one test, or the NRMSE of the last of eight.
fn run(batch: bool, seconds: f64, name: &str) -> Result<f64> {
    let (rig, floors) = rig(name)?;
    let sweep = sine_sweep(8900.0 / floors as f64, 0.0, 10.0, seconds, 4096.0)?;
    let commands: Vec<Command> = vec![sweep; floors];
    let method = if name == "runge-kutta" { Method::RungeKutta } else { Method::Exponential };
    let simulate = SimulateOptions { method, ..SimulateOptions::default() };
    if !batch {
        let runs = simulate_actuators::<f64>(&rig, &commands, &simulate, |_, _| true)?;
        return Ok(runs[0].force.last().copied().unwrap_or_default());
    }
    let options = BatchOptions { simulate, threads: Some(1), traces: name == "traces", fft: false };
    let outcomes =
        simulate_batch::<f64>(&[Test { rig: &rig, commands: &commands }; 8], &options, |_, _| true)?;
    let nrmse = |outcome: eft_sim::batch::Outcome| outcome.metrics.get("nrmse").unwrap_or(f64::NAN);
    outcomes.into_iter().next_back().map_or(Ok(f64::NAN), |outcome| outcome.map(nrmse))
}

/// A rig by its name, and its floors.
fn rig(name: &str) -> Result<(RigConfig, usize)> {
    let floors = if name == "stories" { 3 } else { 1 };
    let all = |value: f64| toml::Value::Array(vec![value.into(); floors]);
    let changes: Vec<(&str, toml::Value)> = match name {
        "plain" | "traces" | "runge-kutta" => vec![],
        "adaptive" => vec![("compensation.adaptive", true.into())],
        "noisy" => vec![
            ("compensation.adaptive", true.into()),
            ("sensors.force.noise", 20.0.into()),
            ("sensors.velocity.noise", 1e-3.into()),
            ("sensors.displacement.noise", 1e-5.into()),
            ("sensors.spool.noise", 1e-3.into()),
        ],
        "stories" => vec![
            ("structure.kind", "shear_building".into()),
            ("structure.stories.masses", all(7040.0)),
            ("structure.stories.dampings", all(4330.0)),
            ("structure.stories.stiffnesses", all(693.8e3)),
        ],
        _ => return Err(Error::value("rig", name, "must be one that the usage names")),
    };
    Ok((RigConfig::zhao2005().replace(&changes)?, floors))
}
