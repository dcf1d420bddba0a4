//! Common parts of both C interfaces: pointers, log messages and errors.

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use eft_sim::{Error, Result};

use crate::instance::{Instance, Snapshot};
use crate::variables::Type;

/// The status of a call, with the same numbers in both versions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum Status {
    /// Done.
    Ok = 0,
    /// Refused; the log has the reason, and the instance is unchanged.
    Error = 3,
    /// The instance is unusable.
    Fatal = 4,
}

/// The receiver of messages.
pub(crate) type Log = Box<dyn Fn(Status, &CStr)>;

/// An instance and the receiver of its messages.
pub(crate) struct Component {
    instance: Instance,
    log: Log,
}

/// Category of every message.
pub(crate) const CATEGORY: &CStr = c"logStatusError";

/// A message as a C string.
fn message(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Makes an instance from a folder of resources; null with a message if that fails.
pub(crate) fn instantiate(
    resources: Result<std::path::PathBuf>,
    token: Result<&str>,
    log: Log,
) -> *mut c_void {
    let make = || {
        let path = resources?.join("rig.toml");
        let text = std::fs::read_to_string(&path).map_err(|source| Error::Io { path, source })?;
        Instance::new(&text, token?)
    };
    match catch_unwind(AssertUnwindSafe(make)) {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Component { instance, log })).cast(),
        Ok(Err(error)) => {
            log(Status::Error, &message(&error.to_string()));
            std::ptr::null_mut()
        }
        Err(_) => std::ptr::null_mut(),
    }
}

/// Frees an instance and the states it still holds.
///
/// # Safety
/// Null, or a pointer from [`instantiate`] that is not freed.
pub(crate) unsafe fn free(component: *mut c_void) {
    if !component.is_null() {
        // SAFETY: the caller's promise.
        drop(unsafe { Box::from_raw(component.cast::<Component>()) });
    }
}

/// Calls a function on an instance. Errors go to the log.
///
/// # Safety
/// Null, or an instance that is not freed.
pub(crate) unsafe fn with(component: *mut c_void, call: impl FnOnce(&mut Instance) -> Result<()>) -> Status {
    // SAFETY: the caller's promise.
    let Some(component) = (unsafe { component.cast::<Component>().as_mut() }) else { return Status::Error };
    let Component { instance, log } = component;
    let (status, text) = match catch_unwind(AssertUnwindSafe(|| call(instance))) {
        Ok(Ok(())) => return Status::Ok,
        Ok(Err(error)) => (Status::Error, error.to_string()),
        Err(_) => (Status::Fatal, "the FMU failed inside: free the instance".to_owned()),
    };
    log(status, &message(&text));
    status
}

/// The error of a function that this kind of FMU does not support.
pub(crate) fn without(function: &str) -> Error {
    Error::value("call", function, "must be one of a co-simulation with numbers and Booleans only")
}

/// Refuses numbers of values and references that differ.
pub(crate) fn same_count(references: usize, values: usize) -> Result<()> {
    if references == values {
        return Ok(());
    }
    Err(Error::value("nValues", values, format!("must be {references}, one per value reference")))
}

/// A text from the importer.
///
/// # Safety
/// Null, or a text that ends with a zero and outlives the returned one.
pub(crate) unsafe fn text<'a>(name: &str, text: *const c_char) -> Result<&'a str> {
    if text.is_null() {
        return Err(Error::value(name, "null", "must be a text"));
    }
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| Error::value(name, format!("{text:?}"), "must be UTF-8"))
}

fn present<T>(name: &str, pointer: *const T, count: usize) -> Result<()> {
    if count > 0 && pointer.is_null() {
        return Err(Error::value(name, "null", format!("must be an array of {count}")));
    }
    Ok(())
}

/// Writes values of variables to the importer's array.
///
/// # Safety
/// As [`with`]; both arrays are null or of `count`.
pub(crate) unsafe fn get<T>(
    component: *mut c_void,
    references: *const u32,
    values: *mut T,
    count: usize,
    kind: Type,
    convert: impl Fn(f64) -> T,
) -> Status {
    let call = |instance: &mut Instance| {
        present("value references", references, count)?;
        present("values", values, count)?;
        if count == 0 {
            return Ok(());
        }
        // SAFETY: neither is null, and the caller's promise.
        let references = unsafe { std::slice::from_raw_parts(references, count) };
        for (i, value) in instance.get(references, kind)?.into_iter().enumerate() {
            // SAFETY: there are `count` of them.
            unsafe { values.add(i).write(convert(value)) };
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// Sets variables from the importer's array.
///
/// # Safety
/// As [`get`].
pub(crate) unsafe fn set<T: Copy>(
    component: *mut c_void,
    references: *const u32,
    values: *const T,
    count: usize,
    kind: Type,
    convert: impl Fn(T) -> f64,
) -> Status {
    let call = |instance: &mut Instance| {
        present("value references", references, count)?;
        present("values", values, count)?;
        if count == 0 {
            return Ok(());
        }
        // SAFETY: neither is null, and the caller's promise.
        let (references, values) = unsafe {
            (std::slice::from_raw_parts(references, count), std::slice::from_raw_parts(values, count))
        };
        let values: Vec<f64> = values.iter().map(|value| convert(*value)).collect();
        instance.set(references, kind, &values)
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// The importer's pointer to one value.
///
/// # Safety
/// Null, or a writable pointer.
pub(crate) unsafe fn place<'a, T>(name: &str, place: *mut T) -> Result<&'a mut T> {
    // SAFETY: the caller's promise.
    unsafe { place.as_mut() }.ok_or_else(|| Error::value(name, "null", "must be a place for the answer"))
}

/// An address of a state.
pub(crate) type Address = *mut c_void;

/// Stores a state, and replaces an earlier one if given.
///
/// # Safety
/// As [`with`] and [`place`].
pub(crate) unsafe fn get_state(component: *mut c_void, state: *mut Address) -> Status {
    let call = |instance: &mut Instance| {
        // SAFETY: the caller's promise.
        let state = unsafe { place("state", state) }?;
        *state = instance.get_state(state.cast::<Snapshot>())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// Frees a state and forgets its address; a null pointer is ignored.
///
/// # Safety
/// As [`with`] and [`place`].
pub(crate) unsafe fn free_state(component: *mut c_void, state: *mut Address) -> Status {
    let call = |instance: &mut Instance| {
        // SAFETY: the caller's promise.
        let state = unsafe { place("state", state) }?;
        if !state.is_null() {
            instance.free_state(state.cast::<Snapshot>())?;
            *state = std::ptr::null_mut();
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// Number of bytes of a state.
///
/// # Safety
/// As [`with`] and [`place`].
pub(crate) unsafe fn state_size(component: *mut c_void, state: Address, size: *mut usize) -> Status {
    let call = |instance: &mut Instance| {
        // SAFETY: the caller's promise.
        *unsafe { place("size", size) }? = instance.serialize(state.cast())?.len();
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// A state as bytes.
///
/// # Safety
/// As [`with`]; the bytes are null or of `size`.
pub(crate) unsafe fn serialize(
    component: *mut c_void,
    state: Address,
    bytes: *mut u8,
    size: usize,
) -> Status {
    let call = |instance: &mut Instance| {
        present("serializedState", bytes, size)?;
        let written = instance.serialize(state.cast())?;
        if written.len() > size || bytes.is_null() {
            let allowed = format!("must be at least {}", written.len());
            return Err(Error::value("size", size, allowed));
        }
        // SAFETY: there is room for `size` of them.
        unsafe { std::ptr::copy_nonoverlapping(written.as_ptr(), bytes, written.len()) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}

/// A state from bytes.
///
/// # Safety
/// As [`serialize`] and [`place`].
pub(crate) unsafe fn deserialize(
    component: *mut c_void,
    bytes: *const u8,
    size: usize,
    state: *mut Address,
) -> Status {
    let call = |instance: &mut Instance| {
        present("serializedState", bytes, size.max(1))?;
        // SAFETY: the caller's promise.
        let (state, bytes) = unsafe { (place("state", state)?, std::slice::from_raw_parts(bytes, size)) };
        *state = instance.deserialize(bytes, state.cast())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(component, call) }
}
