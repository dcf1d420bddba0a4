//! The opaque structs of C: a marker, which is not zero, and a value of the core.
//!
//! Every pointer here is null or valid, as the interface requires.

use core::mem::MaybeUninit;

use crate::codes::{EFT_NOT_MADE, EFT_NULL_POINTER};

/// An opaque struct of the interface that can hold a [`Marked<Self::Value>`].
pub(crate) unsafe trait Opaque {
    /// The type of the value after the marker.
    type Value;
    /// The marker of a valid value.
    const MARKER: u32;
}

/// Whether an opaque struct is large enough and aligned.
pub(crate) const fn fits<O: Opaque>() -> bool {
    size_of::<O>() >= size_of::<Marked<O::Value>>() && align_of::<O>() >= align_of::<Marked<O::Value>>()
}

#[repr(C)]
pub(crate) struct Marked<V> {
    marker: u32,
    value: V,
}

/// The memory of a value in an opaque struct, which may be uninitialized. The value is invalid until [`mark`] is
/// called.
#[inline(always)]
pub(crate) unsafe fn room<'a, O: Opaque>(place: *mut O) -> Result<&'a mut MaybeUninit<O::Value>, u8> {
    let marked = place.cast::<Marked<MaybeUninit<O::Value>>>();
    if marked.is_null() {
        return Err(EFT_NULL_POINTER);
    }
    // Safety: not null, and large enough for both.
    unsafe {
        (&raw mut (*marked).marker).write(0);
        Ok(&mut (*marked).value)
    }
}

/// Marks the value of an opaque struct as valid. Call it after [`room`].
#[inline(always)]
pub(crate) unsafe fn mark<O: Opaque>(place: *mut O) {
    // Safety: `room` has refused a null pointer.
    unsafe { (&raw mut (*place.cast::<Marked<O::Value>>()).marker).write(O::MARKER) };
}

/// Writes a value into an opaque struct, which may be uninitialized.
#[inline(always)]
pub(crate) unsafe fn make<O: Opaque>(place: *mut O, value: O::Value) -> Result<(), u8> {
    // Safety: null or valid. Value and marker are written one by one, so that the stack holds no copy.
    unsafe {
        room(place)?.write(value);
        mark(place);
    }
    Ok(())
}

/// The value of an opaque struct.
#[inline(always)]
pub(crate) unsafe fn made<'a, O: Opaque>(place: *const O) -> Result<&'a O::Value, u8> {
    let marked = place.cast::<Marked<O::Value>>();
    // Safety: not null; the value is valid if the marker is there.
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

/// Like [`made`], but mutable.
pub(crate) unsafe fn made_mut<'a, O: Opaque>(place: *mut O) -> Result<&'a mut O::Value, u8> {
    // Safety: after the first line the pointer is not null, and the value is valid.
    unsafe {
        made(place)?;
        Ok(&mut (*place.cast::<Marked<O::Value>>()).value)
    }
}

/// The data behind a pointer.
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
