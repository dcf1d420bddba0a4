//! What must hold on the target itself: the same bits as everywhere, faults survived, configurations swapped under a
//! running interrupt. Prints the golden bits on lines of their own, and ends with 1 where a check fails.
#![no_std]
#![no_main]

mod faults;
mod swap;

use cortex_m::peripheral::Peripherals;
use cortex_m_rt::{entry, exception};
use eft_core::Controller;
use eft_rigs::{uneven, zhao2005};
use semihosting::{eprintln, println, process};

fn golden<const N: usize>(rig: &str, core: &Controller<f32, N>) {
    println!("{rig} controller {:016x}", eft_golden::controller(core));
    println!("{rig} compensation {:016x}", eft_golden::compensation(core));
    println!("{rig} further_flow {:016x}", eft_golden::further_flow(core));
}

#[entry]
fn main() -> ! {
    golden("zhao2005", &zhao2005::CONTROLLER);
    golden("uneven", &uneven::CONTROLLER);
    match faults::run() {
        Ok(survived) => eprintln!("faults: {survived} put in, all survived"),
        Err(failure) => fail(failure),
    }
    let Some(peripherals) = Peripherals::take() else { fail("no peripherals") };
    match swap::run(peripherals.SYST) {
        Ok(swaps) => eprintln!("swap: {swaps} configurations taken over by the running interrupt, none torn"),
        Err(failure) => fail(failure),
    }
    process::exit(0)
}

fn fail(failure: &str) -> ! {
    eprintln!("{failure}");
    process::exit(1)
}

#[exception]
fn SysTick() {
    swap::tick();
}

#[exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    eprintln!("hard fault");
    process::exit(3)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    eprintln!("{info}");
    process::exit(2)
}
