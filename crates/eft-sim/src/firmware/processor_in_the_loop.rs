//! A real or emulated processor runs the controller; this program runs the plant.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

pub use crate::closed_loop::ExternalOutput;
use crate::closed_loop::{SimulateOptions, Specimen, TestRun, simulate_controlled};
use crate::config::{Realization, RigConfig};
use crate::firmware::export::exportable;
use crate::ground_motion::excitation::Command;
use crate::{Error, Result, checks};

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
    mut tick: impl FnMut([f32; 8]) -> Result<ExternalOutput> + Send + 'static,
    specimen: Option<Specimen>,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<TestRun> {
    check(rig)?;
    let failure = Arc::new(Mutex::new(None));
    let seen = Arc::clone(&failure);
    let mut last = ExternalOutput::default();
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
    let ends_softly = rig.protection.enabled && rig.protection.soft_end;
    let allowed = "must be false with the processor in the loop, which does not know the end";
    checks::require(!ends_softly, "protection.soft_end", true, allowed)?;
    let is_digital = rig.controller.realization == Realization::Digital;
    let allowed = "must be \"digital\" with the processor in the loop";
    checks::require(is_digital, "controller.realization", "\"analog\"", allowed)
}

/// Runs `command` with the firmware `image` on QEMU's `machine` ("mps2-an386", "mps2-an500") as the
/// controller. The firmware reads its samples from the file `to-firmware` by semihosting, eight `f32` in the
/// order of [`run_with`]. It writes its answers to `from-firmware`, the fields of [`ExternalOutput`] in their order.
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
        // An instruction takes 32 ns: at 4096 Hz a tick has room for 7,600, of which tick and learner need about 4,000.
        .args(["-icount", "shift=5,sleep=off"])
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
    let opened = Arc::new(AtomicBool::new(false));
    let both = Arc::clone(&opened);
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
        // When the processor has ended, no thread may wait for it at a pipe, or come to wait there.
        loop {
            let there = pipes.iter().all(|pipe| OpenOptions::new().read(true).write(true).open(pipe).is_ok());
            if both.load(Ordering::Acquire) || !there {
                break ended;
            }
            thread::sleep(Duration::from_millis(1));
        }
    });
    let mut writer = OpenOptions::new().write(true).open(&to).map_err(&failed)?;
    let mut reader = File::open(&from).map_err(&failed)?;
    opened.store(true, Ordering::Release);
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
        Ok(ExternalOutput {
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
    let code = ended.map_err(&failed)?.code();
    match run {
        // A pipe breaks when QEMU ends, so its end is the reason.
        Ok(_) | Err(Error::Io { .. }) if code != Some(0) => {
            let reason = code.map_or_else(
                || format!("ended by a signal: a fault, or no answer for {} s", PATIENCE.as_secs()),
                |code| format!("ended with code {code}: no image for this machine, an overrun or a fault"),
            );
            Err(Error::File { path: image, message: format!("QEMU's {machine} {reason}") })
        }
        run => run,
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
