//! A rig as an argument.

use std::ops::Deref;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::Rig;

/// A rig as an argument. The error for any other object says how to make a rig of it.
pub(crate) struct GivenRig(Py<Rig>);

impl<'py> FromPyObject<'_, 'py> for GivenRig {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(rig) = given.cast::<Rig>() {
            return Ok(Self(rig.to_owned().unbind()));
        }
        let kind = given.get_type().name()?;
        Err(PyTypeError::new_err(format!(
            "rig = an object of type {kind}: must be an eft.Rig; eft.Rig.from_dict makes one from a mapping"
        )))
    }
}

impl Deref for GivenRig {
    type Target = Rig;

    fn deref(&self) -> &Rig {
        self.0.get()
    }
}

/// Refuse any object but a rig, with the same error as every function that takes one.
#[pyfunction]
pub(crate) fn check_rig(rig: GivenRig) {
    drop(rig);
}
