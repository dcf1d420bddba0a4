//! usage: processor_in_the_loop IMAGE MACHINE [short | RIG.toml]
//!
//! The 8.9 kN sweep and the El Centro earthquake with the firmware in the loop, compared bit for bit with the
//! simulation with a controller in f32. A rig with a protection also runs the sweep with a stuck spool
//! sensor, and its first quarter with a lost supply transducer. "short" is the first second of the sweep on
//! the paper's rig. The exit code is 1 if they differ.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use eft_sim::config::Realization;
use eft_sim::excitation::{Command, effective_force, sine_sweep};
use eft_sim::records::read_record;
use eft_sim::{RigConfig, SimulateOptions, processor_in_the_loop, simulate};

const ELCENTRO: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../python/eft/data/RSN6_IMPVALL.I_I-ELC180-hor1.AT2");

type Test = (&'static str, RigConfig, Command);

fn tests(rig: RigConfig, short: bool) -> eft_sim::Result<Vec<Test>> {
    let rate = rig.controller.sample_rate;
    if short {
        let command = sine_sweep(8900.0, 0.0, 10.0, 1.0, rate)?;
        return Ok(vec![("first second of the sweep", rig, command)]);
    }
    let sweep = sine_sweep(8900.0, 0.0, 10.0, 32.0, rate)?;
    let earthquake = effective_force(&read_record(ELCENTRO)?, rig.structure.mass, rate, 1.0)?;
    let mut tests =
        vec![("8.9 kN sweep", rig.clone(), sweep.clone()), ("El Centro", rig.clone(), earthquake)];
    if rig.protection.enabled {
        let failing = |signal: &str, kind: &str| {
            rig.replace(&[
                ("sensors.fault.signal", signal.into()),
                ("sensors.fault.kind", kind.into()),
                ("sensors.fault.start", 6.0.into()),
            ])
        };
        let first = sine_sweep(8900.0, 0.0, 2.5, 8.0, rate)?;
        tests.push(("8.9 kN sweep with a stuck spool sensor", failing("spool", "stuck")?, sweep));
        tests.push(("8.9 kN with a lost supply transducer", failing("supply_pressure", "lost")?, first));
    }
    Ok(tests)
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let (image, machine, what) = match &arguments[..] {
        [_, image, machine] => (image, machine, None),
        [_, image, machine, what] => (image, machine, Some(what.as_str())),
        _ => return Err("usage: IMAGE MACHINE [short | RIG.toml]".into()),
    };
    let rig = match what {
        None | Some("short") => {
            RigConfig::zhao2005().with(|rig| rig.controller.realization = Realization::Digital)?
        }
        Some(path) => RigConfig::from_toml(&std::fs::read_to_string(path)?)?,
    };
    let options = SimulateOptions::default();
    for (name, rig, command) in tests(rig, what == Some("short"))? {
        let host = simulate::<f32>(&rig, &command, &options, |_, _| true)?;
        let image = Path::new(image);
        let run =
            processor_in_the_loop::run_in_qemu(&rig, &command, &options, image, machine, None, |_, _| true)?;
        if let Some((trace, tick)) = host.first_difference(&run) {
            println!("{machine}, {name}: {trace} differs from tick {tick} on");
            return Ok(ExitCode::FAILURE);
        }
        println!("{machine}, {name}: every trace of {} ticks equals the simulation's", host.force.len());
    }
    Ok(ExitCode::SUCCESS)
}
