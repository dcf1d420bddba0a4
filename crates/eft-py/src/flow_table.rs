//! `eft.FlowTable`: the core's own table.

use eft_sim::identification::FlowCurveEstimate;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use toml::{Table, Value};

use crate::arrays;
use crate::errors::refuse;

/// Largest number of points, as in a configuration.
const POINTS: usize = 64;

/// A servovalve's flow curve, piecewise linear and strictly increasing, and its inverse.
///
/// Parameters
/// ----------
/// openings : array_like
///     Spool openings of the points, normalised by the spool's stroke.
/// flows : array_like
///     No-load flows at the points, in m³/s.
/// uncertainty : array_like, optional
///     Standard uncertainty of each flow, in m³/s, if it was measured.
/// measured : sequence of bool, optional
///     Whether each point was measured, and not extrapolated.
///
/// Raises
/// ------
/// ValueError
///     If openings or flows do not increase strictly, or their numbers differ.
///
/// Examples
/// --------
/// >>> import eft
/// >>> table = eft.FlowTable([-1.0, 0.0, 1.0], [-2e-3, 0.0, 2e-3])
/// >>> table.flow(0.5), table.opening(1e-3)
/// (0.001, 0.5)
#[pyclass(frozen, module = "eft")]
pub(crate) struct FlowTable {
    openings: Vec<f64>,
    flows: Vec<f64>,
    uncertainty: Option<Vec<f64>>,
    measured: Option<Vec<bool>>,
    core: eft_core::FlowTable<f64, POINTS>,
}

impl FlowTable {
    fn of(
        openings: Vec<f64>,
        flows: Vec<f64>,
        uncertainty: Option<Vec<f64>>,
        measured: Option<Vec<bool>>,
    ) -> PyResult<Self> {
        let core = eft_core::FlowTable::<f64, POINTS>::new(&openings, &flows)
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        for (name, length) in [
            ("uncertainty", uncertainty.as_ref().map(Vec::len)),
            ("measured", measured.as_ref().map(Vec::len)),
        ] {
            if length.is_some_and(|length| length != openings.len()) {
                let allowed = format!("must be one for each of {} points", openings.len());
                return Err(refuse(name, format!("{} values", length.unwrap_or(0)), allowed));
            }
        }
        Ok(Self { openings, flows, uncertainty, measured, core })
    }

    /// The table from an identification.
    pub(crate) fn found(curve: FlowCurveEstimate) -> PyResult<Self> {
        Self::of(curve.openings, curve.flows, Some(curve.uncertainty), Some(curve.measured))
    }

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
    #[pyo3(signature = (openings, flows, uncertainty=None, measured=None))]
    fn new(
        openings: &Bound<'_, PyAny>,
        flows: &Bound<'_, PyAny>,
        uncertainty: Option<&Bound<'_, PyAny>>,
        measured: Option<Vec<bool>>,
    ) -> PyResult<Self> {
        let (openings, flows) = (arrays::vector("openings", openings)?, arrays::vector("flows", flows)?);
        let uncertainty = uncertainty.map(|given| arrays::vector("uncertainty", given)).transpose()?;
        Self::of(openings, flows, uncertainty, measured)
    }

    /// Return the no-load flow in m³/s at spool openings `x`; constant beyond the table.
    ///
    /// Parameters
    /// ----------
    /// x : float or array_like
    ///     Spool openings, as shares of the stroke.
    ///
    /// Returns
    /// -------
    /// float or numpy.ndarray
    ///     Flows in m³/s, with the shape of `x`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an opening is not finite.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.FlowTable([-1.0, 0.0, 1.0], [-2e-3, 0.0, 2e-3]).flow([0.5, 3.0]).tolist()
    /// [0.001, 0.002]
    fn flow<'py>(&self, x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        arrays::map("x", x, |x| self.core.flow(x))
    }

    /// Return the spool opening for flows `q` (m³/s) at no load; constant beyond the table.
    ///
    /// Parameters
    /// ----------
    /// q : float or array_like
    ///     Flows in m³/s.
    ///
    /// Returns
    /// -------
    /// float or numpy.ndarray
    ///     Spool openings, as shares of the stroke, with the shape of `q`.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a flow is not finite.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.FlowTable([-1.0, 0.0, 1.0], [-2e-3, 0.0, 2e-3]).opening(1e-3)
    /// 0.5
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

    /// Standard uncertainty of the flows in m³/s; extrapolated points have that of the line. `None` if not
    /// given.
    #[getter]
    fn uncertainty<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.uncertainty.as_ref().map(|values| PyArray1::from_slice(py, values))
    }

    /// Whether each point was measured, and not extrapolated; `None` if not given.
    #[getter]
    fn measured<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<bool>>> {
        self.measured.as_ref().map(|values| PyArray1::from_slice(py, values))
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

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        (self.openings(py), self.flows(py), self.uncertainty(py), self.measured.clone()).into_pyobject(py)
    }
}
