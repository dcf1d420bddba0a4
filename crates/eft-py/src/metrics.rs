//! Metrics of a test, and the frequency response and coherence of its force.

use eft_sim::metrics::{self as judge, Actuator, METRICS, Metrics};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::arrays;
use crate::errors::refuse;
use crate::interruption::interruptible;
use crate::rig::GivenRig;
use crate::values::{real_number, whole_number};

/// The metrics of a test's signals by name, one value per actuator, NaN if undefined. For a building each
/// signal has one row per actuator. Without `costly` only those that take no longer than the test.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "the signals of a test")]
pub(crate) fn judge_test<'py>(
    py: Python<'py>,
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    displacement: &Bound<'py, PyAny>,
    spool: &Bound<'py, PyAny>,
    supply_pressure: &Bound<'py, PyAny>,
    costly: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let read = |name: &str, given: &Bound<'py, PyAny>| {
        let array = arrays::real(name, given)?;
        if array.getattr("ndim")?.extract::<usize>()? == 1 {
            return PyResult::Ok(vec![arrays::flat(&array)?]);
        }
        arrays::rows(name, &array)
    };
    let (command, force) = (read("command", command)?, read("force", force)?);
    let (displacement, spool) = (read("displacement", displacement)?, read("spool", spool)?);
    let supply = read("supply_pressure", supply_pressure)?;
    for (name, signal) in
        [("force", &force), ("displacement", &displacement), ("spool", &spool), ("supply_pressure", &supply)]
    {
        if signal.len() != command.len() {
            let allowed = format!("must be {}, as of the command", command.len());
            return Err(refuse(name, format!("{} actuators", signal.len()), allowed));
        }
    }
    let least = |trace: &Vec<f64>| trace.iter().fold(f64::INFINITY, |least, value| least.min(*value));
    let actuators: Vec<_> = (0..command.len())
        .map(|i| Actuator {
            command: &command[i],
            force: &force[i],
            displacement: &displacement[i],
            spool: &spool[i],
            min_supply_pressure: least(&supply[i]),
        })
        .collect();
    let rows = interruptible(py, || judge::rows(&rig.config, sample_rate, &actuators, costly))?;
    let answer = PyDict::new(py);
    for metric in METRICS.iter().filter(|metric| costly || !metric.costly) {
        let values: Vec<_> = rows.iter().filter_map(|row| row.get(metric.name)).collect();
        answer.set_item(metric.name, values)?;
    }
    Ok(answer)
}

/// The value with the largest absolute value; NaN if none is known.
#[pyfunction]
pub(crate) fn worst(values: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(judge::worst(arrays::flat(&arrays::real("values", values)?)?))
}

/// The metrics of a force against its command, by name; NaN if undefined.
#[pyfunction]
pub(crate) fn metrics<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let judged = interruptible(py, || Metrics::of_force(&command, &force, sample_rate))?;
    judged.iter().into_py_dict(py)
}

/// Frequencies in Hz and |FFT(force)| / |FFT(command)| there.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
pub(crate) fn fft_ratio<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] f_low: f64,
    #[pyo3(from_py_with = real_number)] f_high: f64,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let ratio = interruptible(py, || judge::fft_ratio(&command, &force, sample_rate, f_low, f_high))?;
    Ok((PyArray1::from_vec(py, ratio.frequency), PyArray1::from_vec(py, ratio.ratio)))
}

/// Frequencies in Hz and the coherence of a force with its command there, from segments of a number of
/// samples.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
pub(crate) fn coherence<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = whole_number)] segment: usize,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let found = interruptible(py, || judge::coherence(&command, &force, sample_rate, segment))?;
    Ok((PyArray1::from_vec(py, found.frequency), PyArray1::from_vec(py, found.coherence)))
}
