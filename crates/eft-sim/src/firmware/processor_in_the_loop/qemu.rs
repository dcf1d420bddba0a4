//! Firmware on a processor that QEMU emulates.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use super::{ExternalOutput, check, run_with};
use crate::closed_loop::{SimulateOptions, Specimen, TestRun};
use crate::config::RigConfig;
use crate::ground_motion::excitation::Command;
use crate::{Error, Result};

/// Time without an answer after which the firmware counts as stopped.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the run tells the thread that watches QEMU.
struct Progress {
    /// Odd while waiting for the firmware.
    exchanges: AtomicU64,
    /// Whether both pipes are open.
    opened: AtomicBool,
}

/// Runs `command` with the firmware `image` on QEMU's `machine` ("mps2-an386", "mps2-an500") as the
/// controller. The firmware reads its samples from the file `to-firmware` by semihosting, eight `f32` in the
/// order of [`run_with`](super::run_with). It writes its answers to `from-firmware`, the fields of [`ExternalOutput`] in their order.
/// All data is little-endian. The firmware must have the sample rate of the command and the controller of
/// `rig`.
///
/// # Errors
/// As [`run_with`](super::run_with), or if QEMU cannot be started or ends early; the error names the image.
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
    let failed = move |source: io::Error| Error::Io { path: named.clone(), source };
    let image = image.canonicalize().map_err(&failed)?;
    let folder = Folder::new().map_err(&failed)?;
    let pipes = ["to-firmware", "from-firmware"].map(|name| folder.0.join(name));
    Process::new("mkfifo").args(&pipes).status().map_err(&failed)?;
    let child = start(&image, machine, &folder.0)?;
    let progress = Arc::new(Progress { exchanges: AtomicU64::new(1), opened: AtomicBool::new(false) });
    let (seen, watched) = (Arc::clone(&progress), pipes.clone());
    let watch = thread::spawn(move || watch(child, &seen, &watched));
    let [to, from] = &pipes;
    let mut writer = OpenOptions::new().write(true).open(to).map_err(&failed)?;
    let mut reader = File::open(from).map_err(&failed)?;
    progress.opened.store(true, Ordering::Release);
    let lost = failed.clone();
    let tick = move |sample| {
        progress.exchanges.fetch_or(1, Ordering::Relaxed);
        let answer = exchange(&mut writer, &mut reader, sample).map_err(&lost)?;
        progress.exchanges.fetch_add(1, Ordering::Relaxed);
        Ok(answer)
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

/// Starts QEMU with an image in a folder.
fn start(image: &Path, machine: &str, folder: &Path) -> Result<Child> {
    Process::new("qemu-system-arm")
        .args(["-M", machine, "-nographic", "-monitor", "none", "-serial", "none"])
        // An instruction takes 32 ns: at 4096 Hz a tick has room for 7,600, of which tick and learner need about 4,000.
        .args(["-icount", "shift=5,sleep=off"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(folder)
        .stdin(Stdio::null())
        .spawn()
        .map_err(|source| Error::Io { path: "qemu-system-arm".into(), source })
}

/// Ends QEMU if it no longer answers. Returns how it ended.
fn watch(mut child: Child, progress: &Progress, pipes: &[PathBuf]) -> io::Result<ExitStatus> {
    let (mut last, mut since) = (0, Instant::now());
    let ended = loop {
        match child.try_wait() {
            Ok(None) => thread::sleep(Duration::from_millis(5)),
            Ok(Some(status)) => break Ok(status),
            Err(error) => break Err(error),
        }
        let now = progress.exchanges.load(Ordering::Relaxed);
        if now.is_multiple_of(2) || now != last {
            (last, since) = (now, Instant::now());
        } else if since.elapsed() > PATIENCE {
            drop(child.kill());
        }
    };
    // When the processor has ended, no thread may wait for it at a pipe, or come to wait there.
    loop {
        let there = pipes.iter().all(|pipe| OpenOptions::new().read(true).write(true).open(pipe).is_ok());
        if progress.opened.load(Ordering::Acquire) || !there {
            return ended;
        }
        thread::sleep(Duration::from_millis(1));
    }
}

/// Sends a sample to the firmware, and waits for its answer.
fn exchange(writer: &mut File, reader: &mut File, sample: [f32; 8]) -> io::Result<ExternalOutput> {
    writer.write_all(sample.map(f32::to_le_bytes).as_flattened())?;
    let mut answer = [[0; 4]; 8];
    reader.read_exact(answer.as_flattened_mut())?;
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
