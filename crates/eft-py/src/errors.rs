//! Rust's errors as Python's exceptions, with the same message.

use std::io;

use eft_sim::Error;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

/// `OSError` or its subclasses for errors of the operating system, `ValueError` for others.
pub(crate) fn to_python(error: Error) -> PyErr {
    match &error {
        // PyO3 picks the exception from the kind; the message names the file.
        Error::Io { source, .. } => io::Error::new(source.kind(), error.to_string()).into(),
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// A `ValueError` with the message of [`Error::Value`].
pub(crate) fn refuse(parameter: &str, value: impl ToString, allowed: impl Into<String>) -> PyErr {
    to_python(Error::value(parameter, value, allowed))
}
