//! Measures instructions and stack of the core on the target.
#![no_std]
#![no_main]

mod blocks;
mod c_subjects;
mod inputs;
mod probe;
mod rigs;
mod subjects;

use cortex_m::peripheral::{Peripherals, syst::SystClkSource};
use cortex_m_rt::{entry, exception};
use semihosting::{println, process};

#[entry]
fn main() -> ! {
    if let Some(p) = Peripherals::take() {
        let mut timer = p.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        subjects::run();
        c_subjects::run();
    }
    process::exit(0)
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
