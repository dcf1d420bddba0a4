//! What must hold on the target itself: the same bits as everywhere, faults survived, configurations swapped under a
//! running interrupt. Prints the golden bits on lines of their own, and ends with 1 where a check fails.
#![no_std]
#![no_main]

mod faults;
mod swap;

use cortex_m::peripheral::Peripherals;
use cortex_m_rt::{entry, exception};
use eft_core::{Controller, Measurements};
use eft_rigs::{adaptive, guarded_tick, uneven, zhao2005};
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
    let mut state = adaptive::CONTROLLER.at_rest();
    let bits = eft_golden::learning(|s| {
        let measured = Measurements {
            velocity: s.velocity,
            force: s.force,
            spool: s.spool,
            valve_command: 0.0,
            supply_pressure: adaptive::PARAMETERS.supply_pressure as f32,
        };
        let out = adaptive::CONTROLLER.step(&mut state, s.command, &measured);
        (out.valve_command, out.status)
    });
    println!("adaptive learning {bits:016x}");
    let mut state = guarded_tick::State::at_rest();
    let bits = eft_golden::learning(|s| {
        let (_, out) = state.step(&guarded_tick::Sample {
            command: s.command,
            displacement: s.displacement,
            force: s.force,
            spool: s.spool,
            supply_pressure: s.supply_pressure,
        });
        (out.valve_command, out.status)
    });
    println!("guarded learning {bits:016x}");
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
