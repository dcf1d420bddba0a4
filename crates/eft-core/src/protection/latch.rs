//! A latch that no flipped bit resets: it is stored twice, the second time inverted.

use crate::integrity::integrity;

/// Once set, it stays set. Bits that are neither those of a set nor of an unset latch count as set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Latch {
    set: u32,
    unset: u32,
}
integrity!(Latch: set, unset);

impl Default for Latch {
    fn default() -> Self {
        Self { set: 0, unset: u32::MAX }
    }
}

impl Latch {
    #[inline(always)]
    pub(crate) fn is_set(self) -> bool {
        self.set != 0 || self.unset != u32::MAX
    }

    #[inline(always)]
    pub(crate) fn set(&mut self) {
        *self = Self { set: u32::MAX, unset: 0 };
    }

    #[inline(always)]
    pub(crate) fn set_if(&mut self, condition: bool) {
        if condition {
            self.set();
        }
    }

    /// Whether its bits are neither those of a set nor of an unset latch.
    #[inline(always)]
    pub(crate) fn is_corrupt(self) -> bool {
        self.set != !self.unset || (self.set != 0 && self.unset != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Latch {
        /// Flips a bit.
        pub(crate) fn flip(&mut self) {
            self.set ^= 4;
        }
    }

    // SR-09
    #[test]
    fn no_flipped_bit_resets_it_and_each_is_noticed() {
        for bit in 0..32 {
            let mut set = Latch::default();
            set.set();
            assert!(set.is_set() && !set.is_corrupt());
            for flipped in [
                Latch { set: set.set ^ (1 << bit), ..set },
                Latch { unset: set.unset ^ (1 << bit), ..set },
                Latch { set: 1 << bit, ..Latch::default() },
                Latch { unset: !(1 << bit), ..Latch::default() },
            ] {
                assert!(flipped.is_set() && flipped.is_corrupt());
            }
        }
        assert!(!Latch::default().is_set() && !Latch::default().is_corrupt());
        assert!(Latch { set: 0, unset: 0 }.is_set(), "a state of zero bytes");
    }
}
