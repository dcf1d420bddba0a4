//! A test with a controller in Python instead of the rig's own.

use eft_sim::processor_in_the_loop::{ExternalOutput, run_with};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::refuse;
use crate::excitation::Command;
use crate::integration::options;
use crate::interruption::Watch;
use crate::rig::GivenRig;
use crate::run::traces;
use crate::specimen::{Raised, specimen};
use crate::values::{optional_number, real_number};

/// A controller in Python, called once per tick with the arguments of `eft.Controller.step`.
struct PythonController {
    step: Py<PyAny>,
    named: Py<PyDict>,
}

impl PythonController {
    fn ask(&self, py: Python<'_>, signals: [f32; 8]) -> PyResult<f32> {
        let [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command] =
            signals.map(f64::from);
        let named = self.named.bind(py);
        named.set_item(intern!(py, "supply_pressure"), supply_pressure)?;
        named.set_item(intern!(py, "displacement"), displacement)?;
        named.set_item(intern!(py, "acceleration"), acceleration)?;
        named.set_item(intern!(py, "next_command"), next_command)?;
        let answer = self.step.bind(py).call((command, velocity, force, spool), Some(named))?;
        let Ok(volts) = real_number(&answer) else {
            let found = answer.get_type().name()?;
            let allowed = "must return one number, in V";
            return Err(refuse("controller.step", format!("an object of type {found}"), allowed));
        };
        match volts as f32 {
            single if single.is_finite() => Ok(single),
            // As a number with an exponent.
            _ => Err(refuse(
                "controller.step",
                format!("{volts:?}"),
                "must return a finite number of single precision, in V",
            )),
        }
    }
}

/// Run `command` on `rig` with the bound method `step` as the controller; the traces by name.
#[pyfunction]
#[pyo3(signature = (rig, command, step, progress=None, *, method="exponential", largest_step=None, structure=None))]
#[allow(clippy::too_many_arguments, reason = "one for each of Python's")]
pub(crate) fn simulate_controlled<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
    step: Py<PyAny>,
    progress: Option<Py<PyAny>>,
    method: &str,
    #[pyo3(from_py_with = optional_number)] largest_step: Option<f64>,
    structure: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut watch = Watch::new(progress);
    let go_on = |done, total| watch.go_on(done, total);
    let (rig, command, options) = (&rig.config, command.single()?, options(method, largest_step)?);
    let controller = PythonController { step, named: PyDict::new(py).unbind() };
    let raised = Raised::default();
    let kept = raised.clone();
    let tick = move |signals| {
        Python::attach(|py| controller.ask(py, signals)).map_or_else(
            |error| {
                kept.keep(error);
                Err(eft_sim::Error::Interrupted)
            },
            |valve_command| Ok(ExternalOutput { valve_command, ..ExternalOutput::default() }),
        )
    };
    let (specimen, failed) = specimen(structure, false);
    let run = py.detach(|| run_with(rig, command, &options, tick, specimen, go_on));
    traces(py, vec![failed.or(raised.or(watch.end(run)))?], false)
}
