//! A control loop in Rust as it would run on a board: timer tick, sample, step, command, watchdog on overrun.
//!
//! Samples come from the file `to-firmware` and commands go to `from-firmware`, by semihosting, where a board has its
//! converters.
#![no_std]
#![no_main]

#[cfg(feature = "flipped")]
mod flipped;

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{Peripherals, syst::SystClkSource};
use cortex_m_rt::{entry, exception};
use eft_core::{Controller, ControllerState};
use eft_rigs::zhao2005::{CONTROLLER, POINTS, SAMPLE_RATE};
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

/// Velocity (m/s), force (N) and spool (1) behind the force command (N), as the converters would give them; none at the
/// end of the test.
fn sample(input: &mut File) -> Option<[f32; 4]> {
    let mut bytes = [0; 16];
    input.read_exact(&mut bytes).ok()?;
    let word = |n: usize| {
        let mut word = [0; 4];
        word.copy_from_slice(bytes.get(n * 4..n * 4 + 4).unwrap_or(&[0; 4]));
        f32::from_le_bytes(word)
    };
    Some([word(0), word(1), word(2), word(3)])
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = Peripherals::take() else { process::exit(2) };
    let Ok(mut input) = File::open(c"to-firmware") else { process::exit(2) };
    let Ok(mut output) = OpenOptions::new().write(true).truncate(true).create(true).open(c"from-firmware")
    else {
        process::exit(2)
    };
    let controller: &Controller<f32, POINTS> = &CONTROLLER;
    #[cfg(feature = "flipped")]
    let controller = &flipped::controller(controller);
    let mut state = ControllerState::default();

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
        let Some([command, velocity, force, spool]) = sample(&mut input) else { process::exit(0) };
        let out = controller.step(&mut state, command, velocity, force, spool);
        let mut bytes = [0; 12];
        for (to, from) in bytes.chunks_exact_mut(4).zip([
            out.valve_command.to_le_bytes(),
            out.compensation.to_le_bytes(),
            out.status.to_le_bytes(),
        ]) {
            to.copy_from_slice(&from);
        }
        if output.write_all(&bytes).is_err() {
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
