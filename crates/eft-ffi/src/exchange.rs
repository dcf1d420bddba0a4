//! From one context to another without a lock: two copies of something, and whose turn it is.
//!
//! One context offers, another takes; either may preempt the other at any instruction, on one core or on two. Only
//! loads and stores are atomic, so that it runs on processors without more. Every pointer is null or valid, as the
//! interface asks of its callers.

use core::ptr::null;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::codes::{EFT_BUSY, EFT_NULL_POINTER};
use crate::place::{Opaque, made};

/// How often was offered, and up to which offer was taken.
#[repr(C)]
#[derive(Debug, Default)]
pub struct eft_turn {
    offered: AtomicU32,
    taken: AtomicU32,
}

/// Two copies, of which one may be with the taker.
#[repr(C)]
pub(crate) struct Exchange<O> {
    copies: [O; 2],
    turn: eft_turn,
}

impl<O: Opaque + Copy> Exchange<O> {
    /// Offers a copy of `item`; refused while the one before waits.
    pub(crate) unsafe fn offer(this: *mut Self, item: *const O) -> Result<(), u8> {
        // Safety: where the last offer was taken, the taker has its copy and nobody the other one.
        unsafe {
            made(item)?;
            if this.is_null() {
                return Err(EFT_NULL_POINTER);
            }
            let turn = &(*this).turn;
            let last = turn.offered.load(Ordering::Relaxed);
            if turn.taken.load(Ordering::Acquire) != last {
                return Err(EFT_BUSY);
            }
            let next = last.wrapping_add(1);
            Self::copy(this, next).write(*item);
            turn.offered.store(next, Ordering::Release);
        }
        Ok(())
    }

    /// What was offered last, for as long as nothing newer is taken; null where nothing new was offered.
    pub(crate) unsafe fn take(this: *mut Self) -> *const O {
        if this.is_null() {
            return null();
        }
        // Safety: not null, so valid.
        unsafe {
            let turn = &(*this).turn;
            let offered = turn.offered.load(Ordering::Acquire);
            if turn.taken.load(Ordering::Relaxed) == offered {
                return null();
            }
            turn.taken.store(offered, Ordering::Release);
            Self::copy(this, offered)
        }
    }

    /// The copy of a turn.
    unsafe fn copy(this: *mut Self, turn: u32) -> *mut O {
        // Safety: valid, and there are two.
        unsafe { (&raw mut (*this).copies).cast::<O>().add((turn & 1) as usize) }
    }
}

/// An exchange of one type in C, with its functions.
macro_rules! exchange {
    ($(#[$doc:meta])* $Exchange:ident, $Item:ident: $offer:ident $offer_doc:literal, $take:ident $take_doc:literal) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug)]
        pub struct $Exchange {
            copies: [$Item; 2],
            turn: crate::exchange::eft_turn,
        }
        functions! {
            #[doc = $offer_doc]
            fn $offer(to: *mut $Exchange, item: *const $Item) {
                crate::exchange::Exchange::offer(to.cast(), item)
            }
        }
        #[doc = $take_doc]
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $take(from: *mut $Exchange) -> *const $Item {
            // Safety: as the interface asks of its callers.
            unsafe { crate::exchange::Exchange::take(from.cast()) }
        }
    };
}
pub(crate) use exchange;
