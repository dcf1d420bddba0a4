//! A structure in Python that replaces the rig's own.

use std::sync::{Arc, Mutex, PoisonError};

use eft_sim::closed_loop::{Motions, Specimen};
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::refuse;
use crate::values::real_number;

/// A structure in Python, called as ``structure(force, dt)`` once per sample; it returns ``(displacement,
/// velocity)``.
struct PythonSpecimen {
    structure: Py<PyAny>,
    /// Whether numbers are arrays with one value per actuator.
    stacked: bool,
}

/// An exception of a structure or a controller other than `StructureError`, or Ctrl-C.
#[derive(Clone, Default)]
pub(crate) struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    /// Keeps an exception for the end of the run.
    pub(crate) fn keep(&self, error: PyErr) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
    }

    /// The outcome, or the exception that was raised instead.
    pub(crate) fn or<T>(self, outcome: PyResult<T>) -> PyResult<T> {
        match self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => outcome,
        }
    }
}

/// A structure for the simulator, if there is one. A `StructureError` ends the test with its message; any other
/// exception ends the call.
pub(crate) fn specimen(structure: Option<Py<PyAny>>, stacked: bool) -> (Option<Specimen>, Raised) {
    let raised = Raised::default();
    let specimen = structure.map(|structure| -> Specimen {
        let (structure, kept) = (PythonSpecimen { structure, stacked }, raised.clone());
        Box::new(move |forces, dt| {
            Python::attach(|py| {
                structure.ask(py, forces, dt).map_err(|error| {
                    let message = error.value(py).to_string();
                    if !is_failure(py, &error) {
                        kept.keep(error);
                    }
                    message
                })
            })
        })
    });
    (specimen, raised)
}

impl PythonSpecimen {
    fn ask(&self, py: Python<'_>, forces: &[f64], dt: f64) -> PyResult<Motions> {
        let forces = arrays::each(py, forces, self.stacked)?;
        let answer = self.structure.call1(py, (forces, dt))?;
        motions(answer.bind(py), self.stacked)
    }
}

/// Displacements (m) and velocities (m/s) from a structure's answer.
pub(crate) fn motions(answer: &Bound<'_, PyAny>, stacked: bool) -> PyResult<Motions> {
    let each = if stacked { "two arrays, one value for each actuator" } else { "two numbers" };
    let refused = |found: &Bound<'_, PyAny>| {
        let allowed = format!("must return (displacement, velocity), {each}, in m and m/s");
        match found.get_type().name() {
            Ok(name) => refuse("structure", format!("an object of type {name}"), allowed),
            Err(error) => error,
        }
    };
    let Ok((displacement, velocity)) = answer.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
        return Err(refused(answer));
    };
    let vector = |name: &str, value: &Bound<'_, PyAny>| match real_number(value) {
        _ if stacked => arrays::vector(name, value),
        Ok(number) => Ok(vec![number]),
        Err(_) => Err(refused(value)),
    };
    Ok((vector("displacement", &displacement)?, vector("velocity", &velocity)?))
}

fn is_failure(py: Python<'_>, error: &PyErr) -> bool {
    let class = py.import("eft._structure").and_then(|module| module.getattr("StructureError"));
    class.is_ok_and(|class| error.is_instance(py, &class))
}
