//! A lock-free exchange between two contexts: two copies of an item, the number of offers, and the last offer taken.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

/// One context offers, another takes; either may preempt the other at any instruction.
pub struct Exchange<T> {
    copies: [UnsafeCell<Option<T>>; 2],
    offered: AtomicU32,
    taken: AtomicU32,
}

// Safety: a copy is written only while the other side does not use it, see `offer` and `take`.
unsafe impl<T: Copy + Send> Sync for Exchange<T> {}

impl<T: Copy> Exchange<T> {
    /// Nothing offered yet.
    pub const fn new() -> Self {
        Self {
            copies: [const { UnsafeCell::new(None) }; 2],
            offered: AtomicU32::new(0),
            taken: AtomicU32::new(0),
        }
    }

    /// Offers an item, from one context only; false until the last one is taken.
    pub fn offer(&self, item: T) -> bool {
        let last = self.offered.load(Ordering::Relaxed);
        if self.taken.load(Ordering::Acquire) != last {
            return false;
        }
        let next = last.wrapping_add(1);
        // Safety: the taker reads a copy only between `offered` naming it and `taken` naming it.
        unsafe { *self.copy(next) = Some(item) };
        self.offered.store(next, Ordering::Release);
        true
    }

    /// The offered copy, in the other context only; `None` if there is no new one.
    pub fn take(&self) -> Option<T> {
        let offered = self.offered.load(Ordering::Acquire);
        if self.taken.load(Ordering::Relaxed) == offered {
            return None;
        }
        // Safety: until `taken` follows, the other side writes nothing.
        let item = unsafe { *self.copy(offered) };
        self.taken.store(offered, Ordering::Release);
        item
    }

    fn copy(&self, turn: u32) -> *mut Option<T> {
        let [first, second] = &self.copies;
        if turn & 1 == 0 { first.get() } else { second.get() }
    }
}
