//! A lock-free exchange between two contexts: two copies of an item, the number of offers, and the last offer taken.
//!
//! One context offers, another takes. Either may preempt the other at any instruction, on one core or on two. Only
//! loads and stores are atomic, so that it runs on processors without atomic exchange. Every pointer is null or valid,
//! as the interface requires.

use core::ptr::null;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::channel::{eft_calibration, eft_channel, eft_window};
use crate::codes::{EFT_BUSY, EFT_NULL_POINTER};
use crate::macros::functions;
use crate::opaque::{Opaque, made};

/// Passes a configuration, window or calibration from one context to another. It is empty if all its bytes are zero.
// The taker may be reading one of the two copies.
#[repr(C)]
#[derive(Debug)]
pub struct eft_exchange<O> {
    copies: [O; 2],
    // The number of the last offer, and that of the last one that was taken.
    offered: AtomicU32,
    taken: AtomicU32,
}

/// Offers a copy of `item`; refused until the last offer is taken.
unsafe fn offer<O: Opaque + Copy>(to: *mut eft_exchange<O>, item: *const O) -> Result<(), u8> {
    // Safety: once the last offer was taken, the taker uses its copy and nobody uses the other one.
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

/// The last offer, valid until the next one is taken; null if there is no new one.
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

/// The copy that holds an offer.
unsafe fn copy<O>(exchange: *mut eft_exchange<O>, offer: u32) -> *mut O {
    // Safety: `exchange` is valid and has two copies.
    unsafe { (&raw mut (*exchange).copies).cast::<O>().add((offer & 1) as usize) }
}

functions! {
    /// Offers a configuration to the interrupt. Returns EFT_BUSY until the last one is taken.
    fn eft_offer_channel_f32 eft_offer_channel_f64(to: *mut eft_exchange<eft_channel<T>>, item: *const eft_channel<T>) {
        offer(to, item)
    }
    /// Offers output->window to the learner's task. Returns EFT_BUSY until the last one is taken. The learner counts
    /// the samples of a window that was not offered as lost.
    fn eft_offer_window_f32 eft_offer_window_f64(to: *mut eft_exchange<eft_window<T>>, item: *const eft_window<T>) {
        offer(to, item)
    }
    /// Offers a calibration to the interrupt. Returns EFT_BUSY until the last one is taken.
    fn eft_offer_calibration_f32 eft_offer_calibration_f64(to: *mut eft_exchange<eft_calibration<T>>, item: *const eft_calibration<T>) {
        offer(to, item)
    }
}

macro_rules! take {
    ($($(#[$doc:meta])* $single:ident $double:ident: $Item:ident;)*) => {$(
        take! { @ $(#[$doc])* $single: $Item<f32> }
        take! { @ $(#[$doc])* $double: $Item<f64> }
    )*};
    (@ $(#[$doc:meta])* $name:ident: $Item:ty) => {
        $(#[$doc])*
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(from: *mut eft_exchange<$Item>) -> *const $Item {
            // Safety: as the interface requires of its callers.
            unsafe { take(from) }
        }
    };
}
take! {
    /// The offered configuration, or null if there is no new one. After eft_take_over the interrupt steps with it until
    /// it takes the next one.
    eft_take_channel_f32 eft_take_channel_f64: eft_channel;
    /// The offered window, valid until the next one is taken; null if there is no new one.
    eft_take_window_f32 eft_take_window_f64: eft_window;
    /// The offered calibration for eft_publish, valid until the next one is taken; null if there is no new one.
    eft_take_calibration_f32 eft_take_calibration_f64: eft_calibration;
}
