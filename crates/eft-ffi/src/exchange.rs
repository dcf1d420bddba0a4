//! From one context to another without a lock: two copies of something, and a count of offers and of those taken.
//!
//! One context offers, another takes. Either may preempt the other at any instruction, on one core or on two. Only loads
//! and stores are atomic, so that it runs on processors without atomic exchange. Every pointer is null or valid, as the
//! interface asks of its callers.

use core::ptr::null;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::channel::{eft_calibration, eft_channel, eft_window};
use crate::codes::{EFT_BUSY, EFT_NULL_POINTER};
use crate::place::{Opaque, made};
use crate::tables::functions;

/// A configuration, window or calibration on its way from one context to another. With zero bytes it is empty.
// Two copies, of which one may be with the taker.
#[repr(C)]
#[derive(Debug)]
pub struct eft_exchange<O> {
    copies: [O; 2],
    // The number of offers, and the number of the offer that was taken last.
    offered: AtomicU32,
    taken: AtomicU32,
}

/// Offers a copy of `item`; refused while the one before waits.
unsafe fn offer<O: Opaque + Copy>(to: *mut eft_exchange<O>, item: *const O) -> Result<(), u8> {
    // Safety: where the last offer was taken, the taker has its copy and nobody the other one.
    unsafe {
        made(item)?;
        if to.is_null() {
            return Err(EFT_NULL_POINTER);
        }
        let last = (*to).offered.load(Ordering::Relaxed);
        if (*to).taken.load(Ordering::Acquire) != last {
            return Err(EFT_BUSY);
        }
        let next = last.wrapping_add(1);
        copy(to, next).write(*item);
        (*to).offered.store(next, Ordering::Release);
    }
    Ok(())
}

/// What was offered last, for as long as nothing newer is taken; null where nothing new was offered.
unsafe fn take<O>(from: *mut eft_exchange<O>) -> *const O {
    if from.is_null() {
        return null();
    }
    // Safety: not null, so valid.
    unsafe {
        let offered = (*from).offered.load(Ordering::Acquire);
        if (*from).taken.load(Ordering::Relaxed) == offered {
            return null();
        }
        (*from).taken.store(offered, Ordering::Release);
        copy(from, offered)
    }
}

/// The copy that an offer is in.
unsafe fn copy<O>(exchange: *mut eft_exchange<O>, offer: u32) -> *mut O {
    // Safety: valid, and there are two.
    unsafe { (&raw mut (*exchange).copies).cast::<O>().add((offer & 1) as usize) }
}

functions! {
    /// Offers a configuration to the interrupt. Returns EFT_BUSY while the one before waits.
    fn eft_offer_channel_f32 eft_offer_channel_f64(to: *mut eft_exchange<eft_channel<T>>, item: *const eft_channel<T>) {
        offer(to, item)
    }
    /// Offers output->window to the learner's task. Returns EFT_BUSY while the one before waits; the learner then counts
    /// the window's samples as lost.
    fn eft_offer_window_f32 eft_offer_window_f64(to: *mut eft_exchange<eft_window<T>>, item: *const eft_window<T>) {
        offer(to, item)
    }
    /// Offers a calibration to the interrupt. Returns EFT_BUSY while the one before waits.
    fn eft_offer_calibration_f32 eft_offer_calibration_f64(to: *mut eft_exchange<eft_calibration<T>>, item: *const eft_calibration<T>) {
        offer(to, item)
    }
}

macro_rules! take {
    ($($(#[$doc:meta])* $name:ident: $Item:ty;)*) => {$(
        $(#[$doc])*
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(from: *mut eft_exchange<$Item>) -> *const $Item {
            // Safety: as the interface asks of its callers.
            unsafe { take(from) }
        }
    )*};
}
take! {
    /// The configuration that was offered, or null where there is no new one. After eft_take_over the interrupt steps with
    /// it until it takes the next.
    eft_take_channel_f32: eft_channel<f32>;
    /// The window that was offered, valid until the next is taken; null where there is no new one.
    eft_take_window_f32: eft_window<f32>;
    /// The calibration that was offered, for eft_publish, valid until the next is taken; null where there is no new one.
    eft_take_calibration_f32: eft_calibration<f32>;
    /// As eft_take_channel_f32.
    eft_take_channel_f64: eft_channel<f64>;
    /// As eft_take_window_f32.
    eft_take_window_f64: eft_window<f64>;
    /// As eft_take_calibration_f32.
    eft_take_calibration_f64: eft_calibration<f64>;
}
