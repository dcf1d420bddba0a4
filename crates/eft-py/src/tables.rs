//! The tables of the simulator and of the core: traces, metrics, flags and causes.

use eft_core::{Cause, status};
use eft_sim::closed_loop::{self, Fallback, TRACES, Traces};
use eft_sim::metrics::METRICS;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::rig::GivenRig;

/// The traces of a run: name, unit, description, and its value in a test that does not record it: "recorded",
/// "constant", "nominal" (of the learner), "absent", or the name of an equal trace.
#[pyfunction]
pub(crate) fn trace_table() -> Vec<(&'static str, &'static str, &'static str, &'static str)> {
    let otherwise = |trace: &closed_loop::Trace| match trace.fallback {
        Fallback::Recorded => "recorded",
        Fallback::Constant(_) => "constant",
        Fallback::Nominal(_) => "nominal",
        Fallback::Same(name) => name,
        Fallback::Absent => "absent",
    };
    TRACES.iter().map(|trace| (trace.name, trace.unit, trace.doc, otherwise(trace))).collect()
}

/// The number of traces that a test of a rig keeps, one value per sample each.
#[pyfunction]
pub(crate) fn recorded_traces(rig: GivenRig) -> usize {
    Traces::recorded(&rig.config)
}

/// The metrics of a run: name, unit, description and whether it takes longer than the test.
#[pyfunction]
pub(crate) fn metric_table() -> Vec<(&'static str, &'static str, &'static str, bool)> {
    METRICS.iter().map(|metric| (metric.name, metric.unit, metric.doc, metric.costly)).collect()
}

/// The causes of a trip by name, with the number of each.
#[pyfunction]
pub(crate) fn trip_causes(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    Cause::NAMES.map(|(cause, name)| (name, cause as u8)).into_py_dict(py)
}

/// The status flags by name, with the bit of each.
#[pyfunction]
pub(crate) fn status_flags(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    status::NAMES.map(|(bit, name)| (name, bit)).into_py_dict(py)
}
