//! Tests on the virtual rig and their metrics.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use eft_core::{Cause, SavedCalibration, status};
use eft_sim::closed_loop::{
    self, DEFAULT_STEP, EnergyTraces, Method, Otherwise, TRACES, Values, ideal_responses, simulate_actuators,
    simulate_specimen,
};
use eft_sim::config::calibration_section;
use eft_sim::metrics::{self as judge, Actuator, METRICS, Metrics};
use eft_sim::plant::EnergyBalance;
use eft_sim::{SimulateOptions, TestRun};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::excitation::Command;
use crate::rig::{Rig, is_building};
use crate::specimen::PythonSpecimen;
use crate::values::to_python as to_python_value;

/// Time between two checks of Ctrl-C and two calls of `progress`: short for a user, but long enough to leave
/// the interpreter to other threads.
const PATIENCE: Duration = Duration::from_millis(50);

/// The precision of the controller.
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

/// The integration by the name of its method and the largest step in s, with a default step.
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

/// Checks Ctrl-C and calls `progress` at intervals during a run.
#[derive(Default)]
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    last: Option<Instant>,
    stopped: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, last: None, stopped: None }
    }

    /// Whether to continue; the exception of an interruption is kept.
    pub(crate) fn go_on(&mut self, done: usize, total: usize) -> bool {
        if self.stopped.is_some() {
            return false;
        }
        let now = Instant::now();
        if done < total && self.last.is_some_and(|last| now - last < PATIENCE) {
            return true;
        }
        self.last = Some(now);
        let asked = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (done, total)).map(|_| ()))
        });
        self.stopped = asked.err();
        self.stopped.is_none()
    }

    /// The outcome, or the exception that ended it.
    pub(crate) fn end<T>(self, outcome: eft_sim::Result<T>) -> PyResult<T> {
        match self.stopped {
            Some(error) => Err(error),
            None => outcome.map_err(to_python),
        }
    }
}

/// Runs `work` without the interpreter. Ctrl-C ends its long loops.
pub(crate) fn interruptible<R: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> eft_sim::Result<R> + Send,
) -> PyResult<R> {
    py.detach(|| {
        let watch = Rc::new(RefCell::new(Watch::default()));
        let asked = Rc::clone(&watch);
        let result = eft_sim::interruptible(move || asked.borrow_mut().go_on(0, 1), work);
        watch.take().end(result)
    })
}

/// Run `command` on `rig`; the traces by name, each an array with one value per sample.
///
/// `progress`, if given, is called at intervals with the finished samples and their total. `structure`, if
/// given, replaces the rig's own.
#[pyfunction]
#[pyo3(signature = (rig, command, dtype, progress=None, *, method="exponential", largest_step=None, structure=None))]
#[allow(clippy::too_many_arguments, reason = "one for each of Python's")]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    rig: &Rig,
    command: &Command,
    dtype: &str,
    progress: Option<Py<PyAny>>,
    method: &str,
    largest_step: Option<f64>,
    structure: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let dtype = Dtype::parse(dtype)?;
    let mut watch = Watch::new(progress);
    let go_on = |done, total| watch.go_on(done, total);
    let options = options(method, largest_step)?;
    let rig = &rig.config;
    let commands = command.of(rig)?;
    let Some(structure) = structure else {
        let runs = py.detach(|| match dtype {
            Dtype::F32 => simulate_actuators::<f32>(rig, commands, &options, go_on),
            Dtype::F64 => simulate_actuators::<f64>(rig, commands, &options, go_on),
        });
        return traces(py, watch.end(runs)?, is_building(rig));
    };
    let (specimen, raised) = PythonSpecimen::new(structure, is_building(rig)).into_specimen();
    let runs = py.detach(|| match dtype {
        Dtype::F32 => simulate_specimen::<f32>(rig, commands, specimen, &options, go_on),
        Dtype::F64 => simulate_specimen::<f64>(rig, commands, specimen, &options, go_on),
    });
    traces(py, raised.or(watch.end(runs))?, is_building(rig))
}

/// The traces of one run per actuator by the names of the table, with a leading axis for a building, and
/// `status`, `found_flows`, `calibrations`, `energy` and `stopped`. A trace of the learner is a list with the
/// samples at which its values begin, and these values, of each actuator.
pub(crate) fn traces(py: Python<'_>, mut runs: Vec<TestRun>, stacked: bool) -> PyResult<Bound<'_, PyDict>> {
    let traces = PyDict::new(py);
    let (numpy, actuators) = (py.import("numpy")?, runs.len());
    for trace in TRACES {
        let (mut samples, mut held) = (Vec::with_capacity(actuators), Vec::new());
        for TestRun { rig, traces: of_one, .. } in &mut runs {
            let ticks = of_one.status.len();
            match of_one.values(trace, rig) {
                Values::Samples(one) => samples.push(std::mem::take(one)),
                Values::Held(one) => held.push((
                    PyArray1::from_iter(py, one.starts().into_iter().map(|tick| tick as i64)),
                    PyArray1::from_vec(py, one.values()),
                )),
                // One number in memory for the whole trace, so the array is read-only.
                Values::Constant(value) => {
                    let shape = if stacked { vec![actuators, ticks] } else { vec![ticks] };
                    traces.set_item(trace.name, numpy.call_method1("broadcast_to", (value, shape))?)?;
                }
                // One array with two names, because copies of the traces cost as much time as the test.
                Values::Same(name) => traces.set_item(trace.name, traces.get_item(name)?)?,
                Values::Absent => {}
            }
        }
        if !held.is_empty() {
            traces.set_item(trace.name, held)?;
        } else if !samples.is_empty() {
            traces.set_item(trace.name, arrays::stacked(py, samples, stacked)?)?;
        }
    }
    let energy = runs.first().and_then(|run| run.energy);
    traces.set_item("stopped", runs.first().and_then(|run| run.stopped.clone()).unwrap_or_default())?;
    traces.set_item("energy", energy.map(|balance| energies(py, &balance)).transpose()?)?;
    let found: Vec<_> = runs.iter_mut().map(|run| std::mem::take(&mut run.found_flows)).collect();
    let known = !found.iter().all(Vec::is_empty);
    let found = known.then(|| arrays::stacked(py, found, stacked)).transpose()?;
    traces.set_item("found_flows", found)?;
    let calibrations =
        runs.iter().map(|run| calibration(py, run.calibration.as_ref())).collect::<PyResult<Vec<_>>>()?;
    traces.set_item("calibrations", calibrations)?;
    let status = runs.into_iter().map(|run| run.traces.status).collect();
    traces.set_item("status", arrays::stacked(py, status, stacked)?)?;
    Ok(traces)
}

/// The learned calibration as the section of a rig, `None` if nothing was learned.
pub(crate) fn calibration<'py>(
    py: Python<'py>,
    saved: Option<&SavedCalibration>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let section = saved.and_then(calibration_section);
    section.map(|section| to_python_value(py, &section)).transpose()
}

/// The traces of a run: name, unit, description, and its value in a test that does not record it: "recorded",
/// "constant", "nominal" (of the learner), "absent", or the name of an equal trace.
#[pyfunction]
pub(crate) fn trace_table() -> Vec<(&'static str, &'static str, &'static str, &'static str)> {
    let otherwise = |trace: &closed_loop::Trace| match trace.otherwise {
        Otherwise::Recorded => "recorded",
        Otherwise::Constant(_) => "constant",
        Otherwise::Nominal(_) => "nominal",
        Otherwise::Same(name) => name,
        Otherwise::Absent => "absent",
    };
    TRACES.iter().map(|trace| (trace.name, trace.unit, trace.doc, otherwise(trace))).collect()
}

/// The metrics of a run: name, unit, description and whether it takes longer than the test.
#[pyfunction]
pub(crate) fn metric_table() -> Vec<(&'static str, &'static str, &'static str, bool)> {
    METRICS.iter().map(|metric| (metric.name, metric.unit, metric.doc, metric.costly)).collect()
}

/// The metrics of a test's signals by name, one value per actuator, NaN if undefined. For a building each
/// signal has one row per actuator. Without `costly` only those that take no longer than the test.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "the signals of a test")]
pub(crate) fn judge_test<'py>(
    py: Python<'py>,
    rig: &Rig,
    sample_rate: f64,
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

/// The metrics of a force against its command, by name; NaN if undefined. Without `fft` only those that need
/// no Fourier transform.
#[pyfunction]
#[pyo3(signature = (command, force, sample_rate, fft=true))]
pub(crate) fn metrics<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    sample_rate: f64,
    fft: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let judged = interruptible(py, || match fft {
        true => Metrics::new(&command, &force, sample_rate),
        false => Metrics::quick(&command, &force),
    })?;
    let is_quick = |name: &str| METRICS.iter().any(|metric| metric.name == name && !metric.costly);
    let answer = PyDict::new(py);
    // All keys always exist, so that the rows of a study have the same columns.
    for (name, value) in judged.all().into_iter().filter(|(name, _)| fft || is_quick(name)) {
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
    sample_rate: f64,
    segment: usize,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (command, force) = (arrays::vector("command", command)?, arrays::vector("force", force)?);
    let found = interruptible(py, || judge::coherence(&command, &force, sample_rate, segment))?;
    Ok((PyArray1::from_vec(py, found.frequency), PyArray1::from_vec(py, found.coherence)))
}

/// Displacement (m) and velocity (m/s) of the rig's structure under exactly the command.
#[pyfunction]
pub(crate) fn ideal_response<'py>(
    py: Python<'py>,
    rig: &Rig,
    command: &Command,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let (rig, options) = (&rig.config, SimulateOptions::default());
    let (commands, building) = (command.of(rig)?, is_building(rig));
    let responses = interruptible(py, || ideal_responses(rig, commands, &options))?;
    let (displacements, velocities) = responses.into_iter().map(|r| (r.displacement, r.velocity)).unzip();
    Ok((arrays::stacked(py, displacements, building)?, arrays::stacked(py, velocities, building)?))
}

/// The energy balance of a test in J by name, with the total dissipation and the relative gap.
#[pyfunction]
pub(crate) fn energy_balance<'py>(
    py: Python<'py>,
    rig: &Rig,
    command: &Command,
    largest_step: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let (rig, options) = (&rig.config, options("runge-kutta", largest_step)?);
    let commands = command.of(rig)?;
    let balance = interruptible(py, || closed_loop::energy_balance(rig, commands, &options))?;
    energies(py, &balance)
}

/// The energy balance of the traces of a test in J by name; `None` if they do not determine it.
#[pyfunction]
pub(crate) fn energy_of_traces<'py>(
    py: Python<'py>,
    rig: &Rig,
    sample_rate: f64,
    displacement: &Bound<'py, PyAny>,
    velocity: &Bound<'py, PyAny>,
    spool: &Bound<'py, PyAny>,
    load_pressure: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let displacement = arrays::vector("displacement", displacement)?;
    let velocity = arrays::vector("velocity", velocity)?;
    let spool = arrays::vector("spool", spool)?;
    let load_pressure = arrays::vector("load_pressure", load_pressure)?;
    let traces = EnergyTraces {
        displacement: &displacement,
        velocity: &velocity,
        spool: &spool,
        load_pressure: &load_pressure,
    };
    let balance = interruptible(py, || closed_loop::energy_of_traces(&rig.config, sample_rate, &traces))?;
    balance.map(|balance| energies(py, &balance)).transpose()
}

fn energies<'py>(py: Python<'py>, balance: &EnergyBalance) -> PyResult<Bound<'py, PyDict>> {
    let answer = PyDict::new(py);
    for (name, value) in [
        ("supplied", balance.supplied),
        ("swept", balance.swept),
        ("droop", balance.droop),
        ("valve", balance.valve),
        ("leakage", balance.leakage),
        ("friction", balance.friction),
        ("stops", balance.stops),
        ("damping", balance.damping),
        ("hysteresis", balance.hysteresis),
        ("stored", balance.stored),
        ("dissipated", balance.dissipated()),
        ("gap", balance.gap()),
    ] {
        answer.set_item(name, value)?;
    }
    Ok(answer)
}

/// The causes of a trip by name, with the number of each.
#[pyfunction]
pub(crate) fn trip_causes(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let causes = PyDict::new(py);
    for (cause, name) in Cause::NAMES {
        causes.set_item(name, cause as u8)?;
    }
    Ok(causes)
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
