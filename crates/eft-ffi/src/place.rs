//! What C holds as an opaque struct: a marker that memory of zeros does not have, and a value of the core.
//!
//! Every pointer here is null or valid, as the interface asks of its callers.

use core::mem::MaybeUninit;

use crate::codes::{EFT_NOT_MADE, EFT_NULL_POINTER};

/// An opaque struct of the interface, with room for [`Marked<Self::Value>`].
pub(crate) unsafe trait Opaque {
    /// What follows the marker.
    type Value;
    /// The marker of a value that has been made.
    const MARKER: u32;
}

/// Whether an opaque struct has the room that it must have.
pub(crate) const fn fits<O: Opaque>() -> bool {
    size_of::<O>() >= size_of::<Marked<O::Value>>() && align_of::<O>() >= align_of::<Marked<O::Value>>()
}

#[repr(C)]
pub(crate) struct Marked<V> {
    marker: u32,
    value: V,
}

/// The room for a value, in a place that may hold anything. Nothing counts as made there until [`mark`] is called.
#[inline(always)]
pub(crate) unsafe fn room<'a, O: Opaque>(place: *mut O) -> Result<&'a mut MaybeUninit<O::Value>, u8> {
    let marked = place.cast::<Marked<MaybeUninit<O::Value>>>();
    if marked.is_null() {
        return Err(EFT_NULL_POINTER);
    }
    // Safety: not null, and with room for both.
    unsafe {
        (&raw mut (*marked).marker).write(0);
        Ok(&mut (*marked).value)
    }
}

/// Marks a place as one where a value has been made.
#[inline(always)]
pub(crate) unsafe fn mark<O: Opaque>(place: *mut O) {
    // Safety: as in `room`, which was called before.
    unsafe { (&raw mut (*place.cast::<Marked<O::Value>>()).marker).write(O::MARKER) };
}

/// Makes a value at a place that may hold anything.
#[inline(always)]
pub(crate) unsafe fn make<O: Opaque>(place: *mut O, value: O::Value) -> Result<(), u8> {
    // Safety: null or valid. The two are written one by one, so that the stack holds no copy.
    unsafe {
        room(place)?.write(value);
        mark(place);
    }
    Ok(())
}

/// The value that was made at a place.
#[inline(always)]
pub(crate) unsafe fn made<'a, O: Opaque>(place: *const O) -> Result<&'a O::Value, u8> {
    let marked = place.cast::<Marked<O::Value>>();
    // Safety: not null; the value is there where its marker is.
    unsafe {
        if marked.is_null() {
            Err(EFT_NULL_POINTER)
        } else if (*marked).marker != O::MARKER {
            Err(EFT_NOT_MADE)
        } else {
            Ok(&(*marked).value)
        }
    }
}

/// As [`made`], to change it.
pub(crate) unsafe fn made_mut<'a, O: Opaque>(place: *mut O) -> Result<&'a mut O::Value, u8> {
    // Safety: after the first line the pointer is not null, and a value is there.
    unsafe {
        made(place)?;
        Ok(&mut (*place.cast::<Marked<O::Value>>()).value)
    }
}

/// What a pointer to plain data points to.
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Result<&'a T, u8> {
    // Safety: null or valid.
    unsafe { pointer.as_ref() }.ok_or(EFT_NULL_POINTER)
}

/// Writes plain data.
pub(crate) unsafe fn give<T>(pointer: *mut T, value: T) -> Result<(), u8> {
    if pointer.is_null() {
        return Err(EFT_NULL_POINTER);
    }
    // Safety: not null, so valid.
    unsafe { pointer.write(value) };
    Ok(())
}
