//! The tick runs in the timer's interrupt, and the learner in PendSV with a lower priority. One exchange takes windows
//! to the learner, another takes calibrations to the tick.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::{Peripherals, SCB};
use cortex_m_rt::{entry, exception};
use eft_core::{Calibration, ChannelState, LearnerState, Window};
use semihosting::process;

use crate::converters::Converters;
use crate::exchange::Exchange;
use crate::rig::{CHANNEL, LEARNER};

static WINDOWS: Exchange<Window<f32>> = Exchange::new();
static CALIBRATIONS: Exchange<Calibration<f32>> = Exchange::new();
static TICKS: AtomicU32 = AtomicU32::new(0);

/// Data that one context owns.
struct Own<T>(UnsafeCell<Option<T>>);
// Safety: the main program fills it before that context runs. Afterwards only that context uses it.
unsafe impl<T> Sync for Own<T> {}

impl<T> Own<T> {
    const fn new() -> Self {
        Self(UnsafeCell::new(None))
    }
    fn fill(&self, value: T) {
        // Safety: the interrupts are not enabled yet.
        unsafe { *self.0.get() = Some(value) }
    }
    #[allow(clippy::mut_from_ref)]
    fn get(&self) -> &mut T {
        // Safety: its context does not preempt itself.
        match unsafe { &mut *self.0.get() } {
            Some(value) => value,
            None => process::exit(2),
        }
    }
}

static TICK: Own<(Converters, ChannelState<f32>)> = Own::new();
static LEARNED: Own<LearnerState<f32>> = Own::new();

#[exception]
fn SysTick() {
    let (converters, state) = TICK.get();
    if let Some(calibration) = CALIBRATIONS.take() {
        CHANNEL.publish(state, calibration);
    }
    let output = CHANNEL.step(state, &converters.sample());
    converters.put(&output, state.calibration());
    if let Some(window) = output.window {
        // A window that the learner has no time for counts as lost samples.
        WINDOWS.offer(window);
        SCB::set_pendsv();
    }
    TICKS.store(TICKS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
}

#[exception]
fn PendSV() {
    if let Some(window) = WINDOWS.take() {
        let begun = TICKS.load(Ordering::Acquire);
        let calibration = LEARNER.update(LEARNED.get(), &window);
        // A delay, so that the learner is preempted as on a slower processor.
        while TICKS.load(Ordering::Acquire).wrapping_sub(begun) < window.number % 8 {
            cortex_m::asm::nop();
        }
        CALIBRATIONS.offer(calibration);
        let took = TICKS.load(Ordering::Acquire).wrapping_sub(begun);
        if took >= CHANNEL.window_ticks() {
            crate::overrun(begun)
        }
    }
}

#[entry]
fn main() -> ! {
    let Some(mut peripherals) = Peripherals::take() else { process::exit(2) };
    TICK.fill((Converters::open(), CHANNEL.at_rest()));
    LEARNED.fill(LEARNER.at_rest());
    // Safety: priorities of handlers that do not run yet.
    unsafe {
        peripherals.SCB.set_priority(SystemHandler::SysTick, 0x00);
        peripherals.SCB.set_priority(SystemHandler::PendSV, 0xff);
    }
    crate::start(&mut peripherals.SYST);
    loop {
        cortex_m::asm::wfi();
    }
}
