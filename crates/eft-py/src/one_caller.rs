//! Objects with a state that one call at a time may use.

use std::sync::{Mutex, MutexGuard, TryLockError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// The state of a Python object. A call while another one is under way is refused, because the order of the two would
/// decide the result.
pub(crate) struct OneCaller<T> {
    /// The class, for the error.
    class: &'static str,
    state: Mutex<T>,
}

impl<T> OneCaller<T> {
    pub(crate) fn new(class: &'static str, state: T) -> Self {
        Self { class, state: Mutex::new(state) }
    }

    /// The state for one call.
    ///
    /// # Errors
    /// Another call is under way, in another thread or in a structure that the object calls.
    pub(crate) fn lock(&self) -> PyResult<MutexGuard<'_, T>> {
        match self.state.try_lock() {
            Ok(state) => Ok(state),
            Err(TryLockError::Poisoned(state)) => Ok(state.into_inner()),
            Err(TryLockError::WouldBlock) => {
                let class = self.class;
                let reason = format!(
                    "{class} is in the middle of another call: make one for each thread, and in a structure use what \
                     its own step was given"
                );
                Err(PyRuntimeError::new_err(reason))
            }
        }
    }
}
