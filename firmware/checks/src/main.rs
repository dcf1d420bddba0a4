//! Checks on the target: golden bits, sensor faults, and configurations that are swapped under a running interrupt. The
//! program prints the golden bits on lines of their own, and ends with 1 if a check fails.
#![no_std]
#![no_main]

mod faults;
mod swap;

use cortex_m::peripheral::Peripherals;
use cortex_m_rt::{entry, exception};
use eft_core::{Channel, Compensation, Learner, Parameters};
use eft_rigs::{adaptive, guarded, uneven, worn, zhao2005};
use semihosting::{eprintln, println, process};

fn controller<const N: usize>(rig: &str, parameters: &Parameters) {
    match Channel::<f32, N>::new(&eft_golden::fixed(*parameters)) {
        Ok(channel) => println!("{rig} controller {:016x}", eft_golden::controller(&channel)),
        Err(_) => fail("controller: refused"),
    }
}

fn golden<const N: usize>(rig: &str, parameters: &Parameters) {
    controller::<N>(rig, parameters);
    match Compensation::<f32, N>::new(parameters) {
        Ok(core) => println!("{rig} compensation {:016x}", eft_golden::compensation(&core)),
        Err(_) => fail("compensation: refused"),
    }
}

/// A run in which the rig's learner learns, inline.
fn learning<const N: usize>(rig: &str, channel: &Channel<f32, N>, learner: &Learner<f32, N>) {
    println!("{rig} learning {:016x}", eft_golden::learner(channel, learner));
}

#[entry]
fn main() -> ! {
    golden::<{ zhao2005::POINTS }>("zhao2005", &zhao2005::PARAMETERS);
    golden::<{ uneven::POINTS }>("uneven", &uneven::PARAMETERS);
    learning("adaptive", &adaptive::CHANNEL, &adaptive::LEARNER);
    learning("guarded", &guarded::CHANNEL, &guarded::LEARNER);
    controller::<{ worn::POINTS }>("worn", &worn::PARAMETERS);
    learning("worn", &worn::CHANNEL, &worn::LEARNER);
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
