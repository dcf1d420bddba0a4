//! A control loop in Rust as it would run on a board: timer, sample, step, command, watchdog on overrun.
//!
//! The learner runs inline after the tick, or in a task of lower priority (`--features task`). Both give the
//! simulator's bits. Samples come from the file `to-firmware` and commands go to `from-firmware`, by semihosting. A
//! board has converters instead.
#![no_std]
#![no_main]

mod converters;
#[cfg(feature = "task")]
mod exchange;
#[cfg(feature = "flipped")]
mod flipped;
#[cfg(not(feature = "task"))]
mod inline;
#[cfg(feature = "task")]
mod task;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::exception;
#[cfg(feature = "guarded")]
use eft_rigs::guarded as rig;
#[cfg(not(feature = "guarded"))]
use eft_rigs::zhao2005 as rig;
use semihosting::{println, process};

/// The clock of both QEMU machines' timers (Hz).
const CLOCK: u32 = 25_000_000;

/// Starts the interrupt at the rig's sample rate.
fn start(timer: &mut SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload((CLOCK as f64 / rig::PARAMETERS.sample_rate) as u32 - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// The work was not done before the next tick.
fn overrun(tick: u32) -> ! {
    println!("overrun at tick {tick}");
    process::exit(4)
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
