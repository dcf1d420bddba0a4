//! Fig. 9 of the paper: the full-scale 0.84 g Northridge record, which saturates the servovalve. The record cannot
//! ship; the tests read it from the folder that `EFT_RECORDS` names.

use std::path::PathBuf;

use eft::core::status;
use eft::sim::excitation::{Command, effective_force};
use eft::sim::metrics::nrmse;
use eft::sim::records::read_record;
use eft::sim::{RigConfig, SimulateOptions, TestRun, ideal_response, simulate};

fn sylmar(scale: f64) -> Option<Command> {
    let Some(folder) = std::env::var_os("EFT_RECORDS") else {
        eprintln!("skipped: EFT_RECORDS does not name a folder with the Sylmar record");
        return None;
    };
    let record = read_record(PathBuf::from(folder).join("northridge1994_sylmar_county_360.csv")).unwrap();
    Some(effective_force(&record, 7040.0, 4096.0, scale).unwrap())
}

fn run(mode: &str, command: &Command) -> TestRun {
    let rig = RigConfig::zhao2005().replace(&[("compensation.mode", mode.into())]).unwrap();
    simulate::<f64>(&rig, command, &SimulateOptions::default(), |_, _| true).unwrap()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, v| v.abs().max(most))
}

#[test]
fn full_scale_saturates_the_valve_with_a_flag_and_stays_finite() {
    let Some(command) = sylmar(1.0) else { return };
    let run = run("nonlinear", &command);
    let flags = run.status_union();
    for flag in [status::SPOOL_WARNING, status::DEMAND_SATURATED, status::SPOOL_STOP] {
        assert_ne!(flags & flag, 0, "{flag:#x} of {flags:#x}");
    }
    assert_eq!(flags & (status::DIVERGED | status::INVALID_MEASUREMENT), 0, "{flags:#x}");
    assert_eq!(run.force.len(), command.values.len());
    assert!((largest(&run.spool) - 1.0).abs() < 1e-12);
    // The moving piston's pumping can raise the force slightly above that of the supply pressure.
    assert!(largest(&run.force) < 2.0 * 8.212e-3 * 1.9e7);
}

#[test]
fn without_compensation_the_displacement_is_far_too_small() {
    let Some(command) = sylmar(0.5) else { return };
    let ideal =
        ideal_response(&RigConfig::zhao2005(), &command, &SimulateOptions::default()).unwrap().displacement;
    let error = |mode: &str| nrmse(&ideal, &run(mode, &command).displacement).unwrap();
    let (off, linear, nonlinear) = (error("off"), error("linear"), error("nonlinear"));
    assert!(nonlinear < 0.15 && nonlinear < 0.5 * linear && linear < off, "{off} {linear} {nonlinear}");
}
