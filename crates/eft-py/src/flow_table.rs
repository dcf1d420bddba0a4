//! `eft.FlowTable`: the core's own table.

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use toml::{Table, Value};

use crate::arrays;

/// As many points as a configuration may have.
const POINTS: usize = 64;

/// A servovalve's flow curve, piecewise linear and strictly increasing, and its inverse.
///
/// Parameters
/// ----------
/// openings : array_like
///     Spool openings of the points, normalised by the spool's stroke.
/// flows : array_like
///     No-load flows at the points, in m³/s.
#[pyclass(frozen, module = "eft")]
pub(crate) struct FlowTable {
    openings: Vec<f64>,
    flows: Vec<f64>,
    core: eft_core::FlowTable<f64, POINTS>,
}

impl FlowTable {
    /// The section of the configuration that describes this table.
    pub(crate) fn tree(&self) -> Table {
        let list = |values: &[f64]| Value::Array(values.iter().copied().map(Value::Float).collect());
        let entries = [("openings", list(&self.openings)), ("flows", list(&self.flows))];
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

#[pymethods]
impl FlowTable {
    #[new]
    fn new(openings: &Bound<'_, PyAny>, flows: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (openings, flows) = (arrays::vector("openings", openings)?, arrays::vector("flows", flows)?);
        let core = eft_core::FlowTable::<f64, POINTS>::new(&openings, &flows)
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self { openings, flows, core })
    }

    /// Return the no-load flow in m³/s at spool openings `x`; constant beyond the table.
    fn flow<'py>(&self, x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        arrays::map("x", x, |x| self.core.flow(x))
    }

    /// Return the spool opening that passes the flows `q` (m³/s) at no load; constant beyond the table.
    fn opening<'py>(&self, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        arrays::map("q", q, |q| self.core.opening(q))
    }

    /// Spool openings of the points.
    #[getter]
    fn openings<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.openings)
    }

    /// Flows of the points in m³/s.
    #[getter]
    fn flows<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.flows)
    }

    fn __len__(&self) -> usize {
        self.openings.len()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.openings == other.openings && self.flows == other.flows
    }

    fn __repr__(&self) -> String {
        let ends = |values: &[f64]| match (values.first(), values.last()) {
            (Some(first), Some(last)) => format!("{first:.4} to {last:.4}"),
            _ => String::new(),
        };
        format!(
            "<eft.FlowTable: {} points, openings {}, flows {} m³/s>",
            self.openings.len(),
            ends(&self.openings),
            ends(&self.flows)
        )
    }

    #[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        (self.openings(py), self.flows(py))
    }
}
