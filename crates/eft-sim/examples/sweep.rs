//! The paper's sweep, alone or eight times side by side, to be counted or profiled:
//! `cargo run --release --package eft-sim --example sweep -- one|batch SECONDS`.

use std::process::ExitCode;

use eft_sim::batch::{BatchOptions, Test, simulate_batch};
use eft_sim::excitation::sine_sweep;
use eft_sim::{Result, RigConfig, SimulateOptions, simulate};

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (what, seconds) = (arguments.next(), arguments.next().and_then(|text| text.parse().ok()));
    match (what.as_deref(), seconds) {
        (Some("one"), Some(seconds)) => end(one(seconds)),
        (Some("batch"), Some(seconds)) => end(batch(seconds)),
        _ => {
            eprintln!("usage: sweep one|batch SECONDS");
            ExitCode::from(2)
        }
    }
}

fn end(force: Result<f64>) -> ExitCode {
    match force {
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

/// The last force (N).
fn one(seconds: f64) -> Result<f64> {
    let command = sine_sweep(8900.0, 0.0, 10.0, seconds, 4096.0)?;
    let run = simulate::<f64>(&RigConfig::zhao2005(), &command, &SimulateOptions::default(), |_, _| true)?;
    Ok(run.force.last().copied().unwrap_or_default())
}

/// The NRMSE of the last of the eight.
fn batch(seconds: f64) -> Result<f64> {
    let (rig, command) = (RigConfig::zhao2005(), sine_sweep(8900.0, 0.0, 10.0, seconds, 4096.0)?);
    let options = BatchOptions { threads: Some(1), ..BatchOptions::default() };
    let outcomes = simulate_batch::<f64>(&[Test { rig: &rig, command: &command }; 8], &options, |_, _| true)?;
    let nrmse = |outcome: eft_sim::batch::Outcome| outcome.metrics.get("nrmse").unwrap_or(f64::NAN);
    outcomes.into_iter().next_back().map_or(Ok(f64::NAN), |outcome| outcome.map(nrmse))
}
