//! A control loop in Rust as it would run on a board: timer tick, sample, step, command, watchdog on overrun.
//!
//! Samples come from the file `to-firmware` and commands go to `from-firmware`, by semihosting, where a board has its
//! converters.
#![no_std]
#![no_main]

#[cfg_attr(feature = "guarded", path = "guarded.rs")]
#[cfg_attr(not(feature = "guarded"), path = "plain.rs")]
mod firmware;
#[cfg(feature = "flipped")]
mod flipped;

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{Peripherals, syst::SystClkSource};
use cortex_m_rt::{entry, exception};
use eft_core::ControllerOutput;
use firmware::{Firmware, SAMPLE_RATE};
use semihosting::fs::{File, OpenOptions};
use semihosting::io::{Read, Write};
use semihosting::{println, process};

/// The clock of both QEMU machines' timers (Hz).
const CLOCK: u32 = 25_000_000;

/// Ticks since the start; only the interrupt writes it.
static TICKS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    TICKS.store(TICKS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
}

/// One tick's command and measurements, as the converters would give them.
#[allow(dead_code)] // each firmware reads what its rig measures
struct Sample {
    /// Force command (N).
    command: f32,
    /// Piston velocity (m/s), where a sensor measures it.
    velocity: f32,
    /// Force (N).
    force: f32,
    /// Spool opening (1).
    spool: f32,
    /// Displacement (m).
    displacement: f32,
    /// Supply pressure (Pa), where a transducer measures it.
    supply_pressure: f32,
    /// Acceleration (m/s²), where an accelerometer measures it.
    acceleration: f32,
    /// Force command (N) of the next tick, where it is known.
    next_command: f32,
}

/// One tick's result, and what the controller believes.
struct Answer {
    output: ControllerOutput<f32>,
    /// Velocity (m/s) that it took.
    velocity: f32,
    /// True flow over the table's (1).
    flow_gain: f32,
    /// Delay (s) that it makes up for.
    response_delay: f32,
    /// The spool's gain over the configured one (1).
    valve_gain: f32,
    /// The guard's factor on the compensation level (1).
    level: f32,
}

/// None at the end of the test.
fn sample(input: &mut File) -> Option<Sample> {
    let mut bytes = [[0; 4]; 8];
    input.read_exact(bytes.as_flattened_mut()).ok()?;
    let [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command] =
        bytes.map(f32::from_le_bytes);
    Some(Sample {
        command,
        velocity,
        force,
        spool,
        displacement,
        supply_pressure,
        acceleration,
        next_command,
    })
}

fn write(output: &mut File, a: &Answer) -> bool {
    let Answer { output: out, velocity, flow_gain, response_delay, valve_gain, level } = a;
    let bytes = [
        out.valve_command.to_le_bytes(),
        out.compensation.to_le_bytes(),
        out.status.to_le_bytes(),
        velocity.to_le_bytes(),
        flow_gain.to_le_bytes(),
        response_delay.to_le_bytes(),
        valve_gain.to_le_bytes(),
        level.to_le_bytes(),
    ];
    output.write_all(bytes.as_flattened()).is_ok()
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = Peripherals::take() else { process::exit(2) };
    let Ok(mut input) = File::open(c"to-firmware") else { process::exit(2) };
    let Ok(mut output) = OpenOptions::new().write(true).truncate(true).create(true).open(c"from-firmware")
    else {
        process::exit(2)
    };
    let mut firmware = Firmware::new();

    let mut timer = peripherals.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload((CLOCK as f64 / SAMPLE_RATE) as u32 - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();

    let mut done = TICKS.load(Ordering::Acquire);
    loop {
        while TICKS.load(Ordering::Acquire) == done {
            cortex_m::asm::wfi();
        }
        done = done.wrapping_add(1);
        let Some(sample) = sample(&mut input) else { process::exit(0) };
        if !write(&mut output, &firmware.tick(&sample)) {
            process::exit(2)
        }
        // The watchdog: the work must be done before the next tick.
        if TICKS.load(Ordering::Acquire) != done {
            println!("overrun at tick {done}");
            process::exit(4)
        }
    }
}

#[exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    println!("hard fault");
    process::exit(3)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    println!("{info}");
    process::exit(2)
}
