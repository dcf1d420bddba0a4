//! Tests on the virtual rig.

use eft_core::SavedCalibration;
use eft_sim::closed_loop::{self, TRACES, Values, ideal_responses, simulate_specimen};
use eft_sim::config::calibration_section;
use eft_sim::{SimulateOptions, TestRun};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays;
use crate::energy::energies;
use crate::errors::{refuse, to_python};
use crate::excitation::Command;
use crate::integration::options;
use crate::interruption::{Watch, interruptible};
use crate::rig::{GivenRig, Rig, is_building};
use crate::specimen::specimen;
use crate::values::{optional_number, to_python as to_python_value};

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

/// Run `command` on `rig`; the traces by name, each an array with one value per sample.
///
/// `progress`, if given, is called at intervals with the finished samples and their total. `structure`, if
/// given, replaces the rig's own.
#[pyfunction]
#[pyo3(signature = (rig, command, dtype, progress=None, *, method="exponential", largest_step=None, structure=None))]
#[allow(clippy::too_many_arguments, reason = "one for each of Python's")]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
    dtype: &str,
    progress: Option<Py<PyAny>>,
    method: &str,
    #[pyo3(from_py_with = optional_number)] largest_step: Option<f64>,
    structure: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let dtype = Dtype::parse(dtype)?;
    let mut watch = Watch::new(progress);
    let go_on = |done, total| watch.go_on(done, total);
    let options = options(method, largest_step)?;
    let rig = &rig.config;
    let commands = command.of(rig)?;
    let (specimen, raised) = specimen(structure, is_building(rig));
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
                    let (number, strides) = (PyBytes::new(py, &value.to_ne_bytes()), vec![0; shape.len()]);
                    let all = numpy.call_method1("ndarray", (shape, "d", number, 0, strides))?;
                    traces.set_item(trace.name, all)?;
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

/// The tested rig with the flow curve (m³/s) that its test found.
#[pyfunction]
pub(crate) fn corrected_rig(rig: GivenRig, found_flows: &Bound<'_, PyAny>) -> PyResult<Rig> {
    let flows = arrays::vector("found_flows", found_flows)?;
    let config = closed_loop::corrected_rig(&rig.config, &flows).map_err(to_python)?;
    Ok(Rig { config })
}

/// Displacement (m) and velocity (m/s) of the rig's structure under exactly the command.
#[pyfunction]
pub(crate) fn ideal_response<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let (rig, options) = (&rig.config, SimulateOptions::default());
    let (commands, building) = (command.of(rig)?, is_building(rig));
    let responses = interruptible(py, || ideal_responses(rig, commands, &options))?;
    let (displacements, velocities) = responses.into_iter().map(|r| (r.displacement, r.velocity)).unzip();
    Ok((arrays::stacked(py, displacements, building)?, arrays::stacked(py, velocities, building)?))
}
