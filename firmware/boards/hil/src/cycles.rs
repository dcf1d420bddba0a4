//! Cycles of one call, by the processor's own counter.

use core::hint::black_box;
use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;

/// The running counter, and the cycles of reading it.
#[derive(Clone, Copy)]
pub struct Counter {
    overhead: u32,
}

impl Counter {
    /// Starts the counter; `None` on a processor without one, as under emulation and on a Cortex-M0.
    pub fn start(peripherals: &mut Peripherals) -> Option<Self> {
        if !DWT::has_cycle_counter() {
            return None;
        }
        peripherals.DCB.enable_trace();
        DWT::unlock();
        peripherals.DWT.enable_cycle_counter();
        let mut counter = Self { overhead: 0 };
        let nothing = (0..100).map(|_| counter.measure(|| ()).1).min()?;
        counter.overhead = nothing;
        (nothing != 0).then_some(counter)
    }

    /// A function's result and its cycles.
    pub fn measure<T>(self, work: impl FnOnce() -> T) -> (T, u32) {
        let start = DWT::cycle_count();
        compiler_fence(Ordering::SeqCst);
        let result = black_box(work());
        compiler_fence(Ordering::SeqCst);
        (result, DWT::cycle_count().wrapping_sub(start).wrapping_sub(self.overhead))
    }
}

/// Least, sum and most of many calls.
#[derive(Clone, Copy)]
pub struct Cycles {
    pub calls: u32,
    pub least: u32,
    pub most: u32,
    sum: u64,
}

impl Cycles {
    pub const NONE: Self = Self { calls: 0, least: u32::MAX, most: 0, sum: 0 };

    /// Calls a function, and counts its cycles if there is a counter.
    pub fn of<T>(&mut self, counter: Option<Counter>, work: impl FnOnce() -> T) -> T {
        let Some(counter) = counter else { return work() };
        let (result, cycles) = counter.measure(work);
        self.calls += 1;
        self.least = self.least.min(cycles);
        self.most = self.most.max(cycles);
        self.sum += u64::from(cycles);
        result
    }

    pub fn mean(&self) -> u32 {
        (self.sum / u64::from(self.calls.max(1))) as u32
    }
}
