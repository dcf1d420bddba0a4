//! A real processor, or an emulated one, closes the loop with the plant: nothing of the controller runs here.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::thread;

use eft_core::ControllerState;

use crate::closed_loop::{PlantStepper, Precision, SimulateOptions, TestRun};
use crate::config::RigConfig;
use crate::error::{Error, Result};
use crate::excitation::Command;

/// What a controller answers to one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Valve command (V).
    pub valve_command: f32,
    /// Compensation signal (V) in it.
    pub compensation: f32,
    /// Bits of `eft_core::status`.
    pub status: u32,
}

/// Runs `command` on the plant of `rig` with a controller from outside: `tick` takes the force command (N), velocity
/// (m/s), force (N) and spool opening (1), each rounded to `f32`, as a converter would.
///
/// # Errors
/// An invalid configuration or command, and what `tick` reports.
pub fn run_with(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    mut tick: impl FnMut([f32; 4]) -> Result<Answer>,
) -> Result<TestRun> {
    command.validate()?;
    let mut plant = PlantStepper::new(rig, command.sample_rate, options)?;
    let mut run = TestRun::with_capacity(rig, command.sample_rate, command.values.len());
    let mut now = plant.reading();
    for &wanted in &command.values {
        let answer = tick([wanted as f32, now.velocity as f32, now.force as f32, now.spool as f32])?;
        run.command.push(wanted);
        run.force.push(now.force);
        run.displacement.push(now.displacement);
        run.velocity.push(now.velocity);
        run.spool.push(now.spool);
        run.load_pressure.push(now.load_pressure);
        run.supply_pressure.push(now.supply_pressure);
        run.valve_command.push(f64::from(answer.valve_command));
        run.compensation.push(f64::from(answer.compensation));
        run.flow_gain_estimate.push(1.0);
        run.status.push(answer.status | now.status);
        now = plant.step(f64::from(answer.valve_command))?;
    }
    Ok(run)
}

/// As [`run_with`], with the controller of `eft-core` in `f32` on this machine: what a processor must answer bit for
/// bit.
///
/// # Errors
/// As [`run_with`], and a configuration that the controller refuses.
pub fn run_on_host(rig: &RigConfig, command: &Command, options: &SimulateOptions) -> Result<TestRun> {
    let controller = <f32 as Precision>::controller(rig, command.sample_rate)?;
    let mut state = ControllerState::default();
    run_with(rig, command, options, |[command, velocity, force, spool]| {
        let out = controller.step(&mut state, command, velocity, force, spool);
        Ok(Answer { valve_command: out.valve_command, compensation: out.compensation, status: out.status })
    })
}

/// Runs `command` with the firmware `image` on QEMU's `machine` ("mps2-an386", "mps2-an500") as the controller. The
/// firmware reads its samples from the file `to-firmware` and writes its answers to `from-firmware`, by semihosting.
///
/// # Errors
/// As [`run_with`]; QEMU that cannot be started or ends early, by the name of the image.
pub fn run_in_qemu(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    image: &Path,
    machine: &str,
) -> Result<TestRun> {
    let failed = |source: std::io::Error| Error::Io { path: image.to_owned(), source };
    let image = image.canonicalize().map_err(failed)?;
    let folder = Folder::new().map_err(failed)?;
    let (to, from) = (folder.0.join("to-firmware"), folder.0.join("from-firmware"));
    Process::new("mkfifo").args([&to, &from]).status().map_err(failed)?;
    let mut child = Process::new("qemu-system-arm")
        .args([
            "-M",
            machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
            "-icount",
            "shift=6,sleep=off",
        ])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&image)
        .current_dir(&folder.0)
        .stdin(Stdio::null())
        .spawn()
        .map_err(failed)?;
    // When the processor ends, early or not, nobody must wait for it at either pipe.
    let pipes = [to.clone(), from.clone()];
    let watch = thread::spawn(move || {
        let ended = child.wait();
        for pipe in pipes {
            drop(OpenOptions::new().read(true).write(true).open(pipe));
        }
        ended
    });
    let mut writer = OpenOptions::new().write(true).open(&to).map_err(failed)?;
    let mut reader = File::open(&from).map_err(failed)?;
    let run = run_with(rig, command, options, |sample| {
        let mut request = [0; 16];
        for (to, value) in request.chunks_exact_mut(4).zip(sample) {
            to.copy_from_slice(&value.to_le_bytes());
        }
        let mut answer = [[0; 4]; 3];
        writer.write_all(&request).map_err(failed)?;
        reader.read_exact(answer.as_flattened_mut()).map_err(failed)?;
        let [valve_command, compensation, status] = answer;
        Ok(Answer {
            valve_command: f32::from_le_bytes(valve_command),
            compensation: f32::from_le_bytes(compensation),
            status: u32::from_le_bytes(status),
        })
    });
    drop(writer);
    let ended = watch.join().map_err(|_| Error::value("machine", machine, "its watch ended early"))?;
    let run = run?;
    match ended.map_err(failed)?.code() {
        Some(0) => Ok(run),
        code => {
            Err(Error::File { path: image, message: format!("ended with {code:?}: an overrun or a fault") })
        }
    }
}

/// A folder of our own that goes when we go.
struct Folder(PathBuf);

impl Folder {
    fn new() -> std::io::Result<Self> {
        for n in 0..1000 {
            let path = std::env::temp_dir().join(format!("eft-loop-{}-{n}", std::process::id()));
            match std::fs::create_dir(&path) {
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                made => return made.map(|()| Self(path)),
            }
        }
        Err(std::io::ErrorKind::AlreadyExists.into())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::Method;
    use crate::config::Realization;
    use crate::excitation::sine_sweep;
    use crate::simulate;

    #[test]
    fn loop_closed_from_outside_follows_the_simulation() {
        let mut rig = RigConfig::zhao2005();
        rig.controller.realization = Realization::Digital;
        let command = sine_sweep(8900.0, 0.0, 10.0, 2.0, 4096.0).unwrap();
        // The outer loop's own method, or the two would differ by the error of both.
        let options = SimulateOptions { method: Method::RungeKutta, ..SimulateOptions::default() };
        let simulated = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
        let outside = run_on_host(&rig, &command, &options).unwrap();
        // The plant is stepped by another routine, equal up to rounding.
        for (a, b) in simulated.force.iter().zip(&outside.force) {
            assert!((a - b).abs() < 0.1, "{a} {b}");
        }
        assert_eq!(simulated.force.len(), outside.force.len());
    }
}
