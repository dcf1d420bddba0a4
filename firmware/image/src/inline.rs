//! Everything in one context: the timer's interrupt counts, and the main loop runs the tick and then the learner.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::Peripherals;
use cortex_m_rt::{entry, exception};
use semihosting::process;

use crate::converters::Converters;
#[cfg(not(feature = "flipped"))]
use crate::rig;

/// Ticks since the start; only the interrupt writes it.
static TICKS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    TICKS.store(TICKS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
}

#[entry]
fn main() -> ! {
    let Some(mut peripherals) = Peripherals::take() else { process::exit(2) };
    let mut converters = Converters::open();
    #[cfg(feature = "flipped")]
    let channel = &crate::flipped::channel();
    #[cfg(not(feature = "flipped"))]
    let channel = &rig::CHANNEL;
    let mut state = channel.at_rest();
    #[cfg(feature = "guarded")]
    let mut learned = rig::LEARNER.at_rest();
    crate::start(&mut peripherals.SYST);
    let mut done = TICKS.load(Ordering::Acquire);
    loop {
        while TICKS.load(Ordering::Acquire) == done {
            cortex_m::asm::wfi();
        }
        done = done.wrapping_add(1);
        let output = channel.step(&mut state, &converters.sample());
        converters.put(&output, state.calibration());
        #[cfg(feature = "guarded")]
        if let Some(window) = output.window {
            channel.publish(&mut state, rig::LEARNER.update(&mut learned, &window));
        }
        // The watchdog: the work must be done before the next tick.
        if TICKS.load(Ordering::Acquire) != done {
            crate::overrun(done)
        }
    }
}
