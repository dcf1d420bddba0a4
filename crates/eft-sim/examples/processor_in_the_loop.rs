//! usage: processor_in_the_loop IMAGE MACHINE [short]
//!
//! The 8.9 kN sweep and the El Centro earthquake with the firmware in the loop, held bit for bit against the simulation
//! with a controller in f32; "short" is the first second of the sweep. Exits with 1 where they differ.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use eft_sim::config::Realization;
use eft_sim::excitation::{Command, effective_force, sine_sweep};
use eft_sim::records::read_record;
use eft_sim::{RigConfig, SimulateOptions, processor_in_the_loop, simulate};

const ELCENTRO: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../python/eft/data/RSN6_IMPVALL.I_I-ELC180-hor1.AT2");

fn tests(rig: &RigConfig, short: bool) -> eft_sim::Result<Vec<(&'static str, Command)>> {
    let rate = rig.controller.sample_rate;
    if short {
        return Ok(vec![("first second of the sweep", sine_sweep(8900.0, 0.0, 10.0, 1.0, rate)?)]);
    }
    let earthquake = effective_force(&read_record(ELCENTRO)?, rig.structure.mass, rate, 1.0)?;
    Ok(vec![("8.9 kN sweep", sine_sweep(8900.0, 0.0, 10.0, 32.0, rate)?), ("El Centro", earthquake)])
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let (image, machine, short) = match &arguments[..] {
        [_, image, machine] => (image, machine, false),
        [_, image, machine, short] if short == "short" => (image, machine, true),
        _ => return Err("usage: IMAGE MACHINE [short]".into()),
    };
    let mut rig = RigConfig::zhao2005();
    rig.controller.realization = Realization::Digital;
    let options = SimulateOptions::default();
    for (name, command) in tests(&rig, short)? {
        let host = simulate::<f32>(&rig, &command, &options, |_, _| true)?;
        let image = Path::new(image);
        let run = processor_in_the_loop::run_in_qemu(&rig, &command, &options, image, machine, |_, _| true)?;
        if let Some((trace, tick)) = host.first_difference(&run) {
            println!("{machine}, {name}: {trace} differs from tick {tick} on");
            return Ok(ExitCode::FAILURE);
        }
        println!("{machine}, {name}: every trace of {} ticks equals the simulation's", host.force.len());
    }
    Ok(ExitCode::SUCCESS)
}
