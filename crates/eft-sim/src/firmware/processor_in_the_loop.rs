//! A real or emulated processor runs the controller; this program runs the plant.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

pub use crate::closed_loop::Answer;
use crate::closed_loop::{SimulateOptions, Specimen, TestRun, simulate_controlled};
use crate::config::{Realization, RigConfig};
use crate::error::{Error, Result};
use crate::firmware::export::exportable;
use crate::ground_motion::excitation::Command;

/// Time without an answer after which the firmware counts as stopped.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs `command` on the plant of `rig` with an external controller. The arguments of `tick` are the force
/// command (N), the readings of velocity (m/s), force (N), spool opening (1), displacement (m), supply
/// pressure (Pa) and acceleration (m/s²), and the next tick's command (N), each rounded to `f32`. Velocity
/// estimate, adaptation and protection are tasks of the controller. Everything else is as in
/// [`simulate`](crate::simulate): a controller with the answers of the rig's own in `f32` gives the traces of
/// `simulate::<f32>` bit for bit. The learned flows stay in the controller. An external structure may replace
/// the rig's own.
///
/// # Errors
/// An invalid command, an analog controller, a computation delay, a soft end, an error of `tick`, or an
/// interruption as in [`simulate`](crate::simulate).
pub fn run_with(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    mut tick: impl FnMut([f32; 8]) -> Result<Answer> + Send + 'static,
    specimen: Option<Specimen>,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    check(rig)?;
    let failure = Arc::new(Mutex::new(None));
    let seen = Arc::clone(&failure);
    let mut last = Answer::default();
    let outside = Box::new(move |signals| {
        let mut failure = seen.lock().unwrap_or_else(PoisonError::into_inner);
        // After a failure `tick` is not called again; the run ends at its next check.
        if failure.is_none() {
            match tick(signals) {
                Ok(answer) => last = answer,
                Err(error) => *failure = Some(error),
            }
        }
        last
    });
    let failed = || failure.lock().unwrap_or_else(PoisonError::into_inner).is_some();
    let run = simulate_controlled(rig, command, options, outside, specimen, |done, total| {
        !failed() && go_on(done, total)
    });
    match failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(error) => Err(error),
        None => run,
    }
}

/// Refuses a rig whose controller cannot run in firmware.
fn check(rig: &RigConfig) -> Result<()> {
    exportable(rig)?;
    if rig.protection.enabled && rig.protection.soft_end {
        let allowed = "must be false with the processor in the loop, which does not know the end";
        return Err(Error::value("protection.soft_end", true, allowed));
    }
    if rig.controller.realization != Realization::Digital {
        let allowed = "must be \"digital\" with the processor in the loop";
        return Err(Error::value("controller.realization", "\"analog\"", allowed));
    }
    Ok(())
}

/// Runs `command` with the firmware `image` on QEMU's `machine` ("mps2-an386", "mps2-an500") as the
/// controller. The firmware reads its samples from the file `to-firmware` by semihosting, eight `f32` in the
/// order of [`run_with`]. It writes its answers to `from-firmware`, the fields of [`Answer`] in their order.
/// All data is little-endian. The firmware must have the sample rate of the command and the controller of
/// `rig`.
///
/// # Errors
/// As [`run_with`], or if QEMU cannot be started or ends early; the error names the image.
pub fn run_in_qemu(
    rig: &RigConfig,
    command: &Command,
    options: &SimulateOptions,
    image: &Path,
    machine: &str,
    specimen: Option<Specimen>,
    go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    check(rig)?;
    let named = image.to_owned();
    let failed = move |source: std::io::Error| Error::Io { path: named.clone(), source };
    let image = image.canonicalize().map_err(&failed)?;
    let folder = Folder::new().map_err(&failed)?;
    let (to, from) = (folder.0.join("to-firmware"), folder.0.join("from-firmware"));
    Process::new("mkfifo").args([&to, &from]).status().map_err(&failed)?;
    let mut child = Process::new("qemu-system-arm")
        .args(["-M", machine, "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-icount", "shift=6,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&image)
        .current_dir(&folder.0)
        .stdin(Stdio::null())
        .spawn()
        .map_err(|source| Error::Io { path: "qemu-system-arm".into(), source })?;
    // Odd while waiting for the firmware.
    let exchanges = Arc::new(AtomicU64::new(1));
    let seen = Arc::clone(&exchanges);
    let pipes = [to.clone(), from.clone()];
    let watch = thread::spawn(move || {
        let (mut last, mut since) = (0, Instant::now());
        let ended = loop {
            match child.try_wait() {
                Ok(None) => thread::sleep(Duration::from_millis(5)),
                Ok(Some(status)) => break Ok(status),
                Err(error) => break Err(error),
            }
            let now = seen.load(Ordering::Relaxed);
            if now.is_multiple_of(2) || now != last {
                (last, since) = (now, Instant::now());
            } else if since.elapsed() > PATIENCE {
                drop(child.kill());
            }
        };
        // When the processor has ended, no thread may wait for it at a pipe.
        for pipe in pipes {
            drop(OpenOptions::new().read(true).write(true).open(pipe));
        }
        ended
    });
    let mut writer = OpenOptions::new().write(true).open(&to).map_err(&failed)?;
    let mut reader = File::open(&from).map_err(&failed)?;
    let lost = failed.clone();
    let tick = move |sample: [f32; 8]| {
        let mut request = [0; 32];
        for (to, value) in request.chunks_exact_mut(4).zip(sample) {
            to.copy_from_slice(&value.to_le_bytes());
        }
        let mut answer = [[0; 4]; 8];
        exchanges.fetch_or(1, Ordering::Relaxed);
        writer.write_all(&request).map_err(&lost)?;
        reader.read_exact(answer.as_flattened_mut()).map_err(&lost)?;
        exchanges.fetch_add(1, Ordering::Relaxed);
        let [valve_command, compensation, status, velocity, learned @ ..] = answer;
        let [flow_gain, response_delay, valve_gain, level] = learned.map(f32::from_le_bytes);
        Ok(Answer {
            valve_command: f32::from_le_bytes(valve_command),
            compensation: f32::from_le_bytes(compensation),
            status: u32::from_le_bytes(status),
            velocity: f32::from_le_bytes(velocity),
            flow_gain,
            response_delay,
            valve_gain,
            level,
        })
    };
    // The end of the run closes the pipe to the firmware, which ends the firmware.
    let run = run_with(rig, command, options, tick, specimen, go_on);
    let ended = watch.join().map_err(|_| Error::value("machine", machine, "its watch ended early"))?;
    let run = run?;
    match ended.map_err(&failed)?.code() {
        Some(0) => Ok(run),
        code => {
            Err(Error::File { path: image, message: format!("ended with {code:?}: an overrun or a fault") })
        }
    }
}

/// A temporary folder that is removed at the end.
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
    use eft_core::{Input, status};

    use super::*;
    use crate::closed_loop::{Precision, parameters};
    use crate::ground_motion::excitation::sine_sweep;
    use crate::simulate;

    fn digital() -> RigConfig {
        RigConfig::zhao2005().with(|rig| rig.controller.realization = Realization::Digital).unwrap()
    }

    /// The core outside of the simulator, as firmware runs it.
    fn firmware(rig: &RigConfig) -> impl FnMut([f32; 8]) -> Result<Answer> + Send + 'static {
        let parameters = parameters(rig, 4096.0).unwrap();
        let channel = <f32 as Precision>::channel(&parameters).unwrap();
        let learner = <f32 as Precision>::learner(&parameters).unwrap();
        let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
        move |[command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command]| {
            let input = Input {
                command,
                velocity,
                force,
                spool,
                displacement,
                supply_pressure,
                acceleration,
                next_command,
                ..Input::default()
            };
            let out = channel.step(&mut state, &input);
            // The calibration of this tick.
            let calibration = *state.calibration();
            if let Some(window) = out.window {
                channel.publish(&mut state, learner.update(&mut learned, &window));
            }
            Ok(Answer {
                valve_command: out.voltage,
                compensation: out.compensation,
                status: out.status,
                velocity: out.velocity,
                flow_gain: calibration.flow_gain,
                response_delay: calibration.response_delay,
                valve_gain: calibration.valve_gain,
                level: calibration.level,
            })
        }
    }

    #[test]
    fn what_stands_around_the_controller_is_the_simulations_bit_for_bit() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/rigs/guarded.toml");
        let rig = RigConfig::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
        let stuck = [
            ("sensors.fault.signal", "displacement".into()),
            ("sensors.fault.kind", "stuck".into()),
            ("sensors.fault.start", 4.0.into()),
        ];
        let command = sine_sweep(8900.0, 1.0, 3.0, 8.0, 4096.0).unwrap();
        let options = SimulateOptions::default();
        let ahead = [
            ("compensation.look_ahead", true.into()),
            ("controller.velocity_source", "accelerometer".into()),
        ];
        let (faulty, ahead) = (rig.replace::<&str>(&stuck).unwrap(), rig.replace::<&str>(&ahead).unwrap());
        for (rig, trips) in [(rig, false), (ahead, false), (faulty, true)] {
            let simulated = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
            let outside = run_with(&rig, &command, &options, firmware(&rig), None, |_, _| true).unwrap();
            assert_eq!(simulated.first_difference(&outside), None);
            let seen = simulated.status.iter().fold(0, |seen, bits| seen | bits);
            assert_eq!(seen & status::TRIPPED != 0, trips, "{seen:#x}");
            // The controller has learned during the test.
            assert!(simulated.flow_gain_estimate.iter().any(|gain| (gain - 1.0).abs() > 1e-3));
            // Learned flows stay in the firmware; the run does not report its table instead.
            assert!(!simulated.found_flows.is_empty() && outside.found_flows.is_empty());
            let refused = outside.corrected_rig().unwrap_err().to_string();
            assert!(refused.starts_with("found_flows = none: must have been found here"), "{refused}");
        }
    }

    #[test]
    fn loop_closed_from_outside_is_the_simulation_bit_for_bit() {
        let command = sine_sweep(8900.0, 0.0, 10.0, 2.0, 4096.0).unwrap();
        let noisy = [("sensors.force.noise", 20.0.into()), ("sensors.velocity.noise", 1.0e-3.into())];
        let wrong = [
            ("truth.structure.mass", toml::Value::from(8e3)),
            ("truth.sensors.force.gain", 1.01.into()),
            ("truth.dac.delay", 1.into()),
            ("dac.range", 8.0.into()),
        ];
        for rig in [digital(), digital().replace(&noisy).unwrap(), digital().replace(&wrong).unwrap()] {
            let options = SimulateOptions::default();
            let simulated = simulate::<f32>(&rig, &command, &options, |_, _| true).unwrap();
            let outside = run_with(&rig, &command, &options, firmware(&rig), None, |_, _| true).unwrap();
            assert_eq!(simulated.first_difference(&outside), None);
            // A controller other than the rig's gives a different run.
            let other = rig.replace(&[("compensation.level", 1.000_001.into())]).unwrap();
            let outside = run_with(&rig, &command, &options, firmware(&other), None, |_, _| true).unwrap();
            assert!(simulated.first_difference(&outside).is_some());
        }
    }

    #[test]
    fn a_controller_that_fails_ends_the_run() {
        let command = sine_sweep(8900.0, 0.0, 10.0, 20.0, 4096.0).unwrap();
        let mut ticks = 0;
        let fails = move |_| {
            ticks += 1;
            if ticks < 10 {
                Ok(Answer::default())
            } else {
                Err(Error::value("tick", ticks, "must be below 10"))
            }
        };
        let error = run_with(&digital(), &command, &SimulateOptions::default(), fails, None, |_, _| true)
            .unwrap_err();
        assert_eq!(error.to_string(), "tick = 10: must be below 10");
    }

    #[test]
    fn what_firmware_has_not_is_refused() {
        let command = sine_sweep(8900.0, 0.0, 10.0, 1.0, 4096.0).unwrap();
        for change in [
            ("controller.realization", "analog".into()),
            ("compensation.computation_delay", 1.into()),
            ("protection.soft_end", true.into()),
        ] {
            let on = ("protection.enabled", true.into());
            let rig = digital().replace(&[on, change.clone()]).unwrap();
            let idle = |_| Ok(Answer::default());
            let error =
                run_with(&rig, &command, &SimulateOptions::default(), idle, None, |_, _| true).unwrap_err();
            assert!(error.to_string().starts_with(change.0), "{error}");
        }
    }
}
