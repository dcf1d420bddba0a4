//! Two copies of a configuration: the interrupt steps with one while the other is written.

use core::sync::atomic::{AtomicU32, Ordering};

/// Which copy is in use and which was last offered: 0 or 1 each.
#[repr(C)]
#[derive(Debug, Default)]
pub struct eft_turn {
    active: AtomicU32,
    offered: AtomicU32,
}

impl eft_turn {
    pub(crate) fn reset(&self) {
        self.active.store(0, Ordering::Relaxed);
        self.offered.store(0, Ordering::Relaxed);
    }
    /// The copy that may be written now; none while one still waits.
    pub(crate) fn free(&self) -> Option<usize> {
        let active = self.active.load(Ordering::Acquire);
        if self.offered.load(Ordering::Relaxed) == active {
            Some(if active == 0 { 1 } else { 0 })
        } else {
            None
        }
    }
    /// Hands the freshly written copy over.
    pub(crate) fn offer(&self, copy: usize) {
        self.offered.store(copy as u32, Ordering::Release);
    }
    /// In the interrupt: takes over what was offered, and gives the copy to step with.
    #[inline(always)]
    pub(crate) fn take(&self) -> usize {
        let offered = self.offered.load(Ordering::Acquire);
        self.active.store(offered, Ordering::Release);
        (offered & 1) as usize
    }
}
