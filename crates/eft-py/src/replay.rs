//! `eft.replay`.

use eft_core::Input;
use eft_sim::closed_loop::{Precision, Replay, replay as replayed};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::refuse;
use crate::interruption::interruptible;
use crate::rig::{GivenRig, Rig};
use crate::run::{Dtype, calibration};
use crate::values::real_number;

/// Run a rig's learner on a recorded test; the estimates by name, each an array with one value per window.
///
/// `signals` has arrays by the names of a channel's input.
#[pyfunction]
pub(crate) fn replay<'py>(
    py: Python<'py>,
    rig: GivenRig,
    signals: &Bound<'py, PyDict>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    dtype: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let mut inputs: Vec<Input<f64>> = Vec::new();
    for (name, values) in signals {
        let name: String = name.extract()?;
        let values = arrays::vector(&name, &values)?;
        if inputs.is_empty() {
            inputs.resize(values.len(), Input::default());
        } else if values.len() != inputs.len() {
            let allowed = format!("must have as many samples as the others, {}", inputs.len());
            return Err(refuse(&name, format!("{} samples", values.len()), allowed));
        }
        for (input, value) in inputs.iter_mut().zip(values) {
            let place = match name.as_str() {
                "command" => &mut input.command,
                "velocity" => &mut input.velocity,
                "force" => &mut input.force,
                "spool" => &mut input.spool,
                "displacement" => &mut input.displacement,
                "acceleration" => &mut input.acceleration,
                "supply_pressure" => &mut input.supply_pressure,
                "next_command" => &mut input.next_command,
                "valve_command" => &mut input.valve_command,
                _ => return Err(refuse("signals", &name, "must be inputs of a channel")),
            };
            *place = value;
        }
    }
    let run = |rig: &Rig| match Dtype::parse(dtype)? {
        Dtype::F32 => learned::<f32>(py, rig, sample_rate, &inputs),
        Dtype::F64 => learned::<f64>(py, rig, sample_rate, &inputs),
    };
    let found = run(&rig)?;
    let arrays = PyDict::new(py);
    for (name, values) in found.estimates() {
        arrays.set_item(name, PyArray1::from_vec(py, values))?;
    }
    arrays.set_item("time", PyArray1::from_vec(py, found.time))?;
    arrays.set_item("found_flows", PyArray1::from_vec(py, found.found_flows))?;
    arrays.set_item("calibration", calibration(py, found.calibration.as_ref())?)?;
    arrays.set_item("status", PyArray1::from_vec(py, found.status))?;
    Ok(arrays)
}

fn learned<P: Precision<Flags = u32>>(
    py: Python<'_>,
    rig: &Rig,
    sample_rate: f64,
    inputs: &[Input<f64>],
) -> PyResult<Replay> {
    interruptible(py, || replayed::<P>(&rig.config, sample_rate, inputs))
}
