//! usage: processor_in_the_loop IMAGE MACHINE [RIG.toml]
//!
//! The 8.9 kN sweep with the firmware in the loop, held bit for bit against the host's f32 run. Exits with 1 where
//! they differ.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use eft_sim::config::Realization;
use eft_sim::excitation::sine_sweep;
use eft_sim::{RigConfig, SimulateOptions, processor_in_the_loop};

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, image, machine] = &arguments[..] else { return Err("usage: IMAGE MACHINE".into()) };
    let mut rig = RigConfig::zhao2005();
    rig.controller.realization = Realization::Digital;
    let options = SimulateOptions::default();
    let command = sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)?;
    let host = processor_in_the_loop::run_on_host(&rig, &command, &options)?;
    let loop_ = processor_in_the_loop::run_in_qemu(&rig, &command, &options, Path::new(image), machine)?;
    let pairs = [
        ("force", &host.force, &loop_.force),
        ("valve_command", &host.valve_command, &loop_.valve_command),
        ("compensation", &host.compensation, &loop_.compensation),
        ("spool", &host.spool, &loop_.spool),
    ];
    for (name, a, b) in pairs {
        if let Some(n) = (0..a.len().max(b.len()))
            .find(|&n| a.get(n).map(|x| x.to_bits()) != b.get(n).map(|x| x.to_bits()))
        {
            println!("{machine}: {name} differs from tick {n} on: {:?} {:?}", a.get(n), b.get(n));
            return Ok(ExitCode::FAILURE);
        }
    }
    println!("{machine}: {} ticks equal the host's f32 run bit for bit", host.force.len());
    Ok(ExitCode::SUCCESS)
}
