//! Running a test and judging it.

use std::time::{Duration, Instant};

use eft_core::status;
use eft_sim::closed_loop::{DEFAULT_STEP, Method};
use eft_sim::metrics::{self as judge, Metrics};
use eft_sim::{SimulateOptions, TestRun};
use numpy::{Element, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::excitation::Command;
use crate::rig::Rig;

/// Between two looks at Ctrl-C and two calls of `progress`: often enough for a person, seldom enough not to
/// take the interpreter from other threads.
const PATIENCE: Duration = Duration::from_millis(50);

/// The precision the controller runs in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dtype {
    F32,
    F64,
}

impl Dtype {
    pub(crate) fn parse(text: &str) -> PyResult<Self> {
        match text {
            "f32" => Ok(Self::F32),
            "f64" => Ok(Self::F64),
            _ => Err(refuse("dtype", format!("{text:?}"), "must be \"f32\" or \"f64\"")),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

/// The integration by its method's name and largest step in s; the default step where there is none.
pub(crate) fn options(method: &str, largest_step: Option<f64>) -> PyResult<SimulateOptions> {
    let method = match method {
        "exponential" => Method::Exponential,
        "runge-kutta" => Method::RungeKutta,
        _ => {
            let allowed = "must be \"exponential\" or \"runge-kutta\"";
            return Err(refuse("method", format!("{method:?}"), allowed));
        }
    };
    Ok(SimulateOptions { method, largest_step: largest_step.unwrap_or(DEFAULT_STEP) })
}

/// Run `command` on `rig`; the traces by name, each an array with one value per sample.
///
/// `progress`, if given, is called now and then with the samples done and their total.
#[pyfunction]
#[pyo3(signature = (rig, command, dtype, progress=None, *, method="exponential", largest_step=None))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    rig: &Rig,
    command: &Command,
    dtype: &str,
    progress: Option<Py<PyAny>>,
    method: &str,
    largest_step: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let dtype = Dtype::parse(dtype)?;
    let mut stopped = None;
    let mut last = None::<Instant>;
    let go_on = |done: usize, total: usize| {
        let now = Instant::now();
        if done < total && last.is_some_and(|last| now - last < PATIENCE) {
            return true;
        }
        last = Some(now);
        let asked = Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (done, total)).map(|_| ()))
        });
        match asked {
            Ok(()) => true,
            Err(error) => {
                stopped = Some(error);
                false
            }
        }
    };
    let options = options(method, largest_step)?;
    let run = py.detach(|| match dtype {
        Dtype::F32 => eft_sim::simulate::<f32>(&rig.config, &command.inner, &options, go_on),
        Dtype::F64 => eft_sim::simulate::<f64>(&rig.config, &command.inner, &options, go_on),
    });
    match (run, stopped) {
        (_, Some(error)) => Err(error),
        (Err(error), None) => Err(to_python(error)),
        (Ok(run), None) => traces(py, run),
    }
}

pub(crate) fn traces(py: Python<'_>, run: TestRun) -> PyResult<Bound<'_, PyDict>> {
    fn put<T: Element>(traces: &Bound<'_, PyDict>, name: &str, values: Vec<T>) -> PyResult<()> {
        traces.set_item(name, PyArray1::from_vec(traces.py(), values))
    }
    let traces = PyDict::new(py);
    put(&traces, "measured_force", run.measured_force().to_vec())?;
    put(&traces, "measured_velocity", run.measured_velocity().to_vec())?;
    put(&traces, "measured_displacement", run.measured_displacement().to_vec())?;
    put(&traces, "measured_spool", run.measured_spool().to_vec())?;
    put(&traces, "measured_supply_pressure", run.measured_supply_pressure().to_vec())?;
    put(&traces, "command", run.command)?;
    put(&traces, "force", run.force)?;
    put(&traces, "displacement", run.displacement)?;
    put(&traces, "velocity", run.velocity)?;
    put(&traces, "spool", run.spool)?;
    put(&traces, "load_pressure", run.load_pressure)?;
    put(&traces, "supply_pressure", run.supply_pressure)?;
    put(&traces, "valve_command", run.valve_command)?;
    put(&traces, "compensation", run.compensation)?;
    put(&traces, "flow_gain_estimate", run.flow_gain_estimate)?;
    put(&traces, "response_delay_estimate", run.response_delay_estimate)?;
    put(&traces, "level", run.level)?;
    put(&traces, "status", run.status)?;
    Ok(traces)
}

/// The metrics of a force against its command, by name; NaN where a metric has no answer.
#[pyfunction]
pub(crate) fn metrics<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    sample_rate: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let judged = py.detach(|| Metrics::new(&command, &force, sample_rate)).map_err(to_python)?;
    let answer = PyDict::new(py);
    // Every key every time, so that the rows of a study have the same columns.
    for (name, value, _) in judged.all() {
        answer.set_item(name, value.unwrap_or(f64::NAN))?;
    }
    Ok(answer)
}

/// Frequencies in Hz and |FFT(force)| / |FFT(command)| there.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
pub(crate) fn fft_ratio<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    sample_rate: f64,
    f_low: f64,
    f_high: f64,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let ratio =
        py.detach(|| judge::fft_ratio(&command, &force, sample_rate, f_low, f_high)).map_err(to_python)?;
    Ok((PyArray1::from_vec(py, ratio.frequency), PyArray1::from_vec(py, ratio.ratio)))
}

/// Displacement (m) and velocity (m/s) of the rig's structure under the command applied exactly.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
pub(crate) fn ideal_response<'py>(
    py: Python<'py>,
    rig: &Rig,
    command: &Command,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let response = py
        .detach(|| eft_sim::ideal_response(&rig.config, &command.inner, &SimulateOptions::default()))
        .map_err(to_python)?;
    Ok((PyArray1::from_vec(py, response.displacement), PyArray1::from_vec(py, response.velocity)))
}

/// The status flags by name, with the bit of each.
#[pyfunction]
pub(crate) fn status_flags(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let flags = PyDict::new(py);
    for (bit, name) in status::NAMES {
        flags.set_item(name, bit)?;
    }
    Ok(flags)
}
