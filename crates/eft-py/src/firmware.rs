//! Export of a rig for firmware, and firmware in the loop.

use std::path::PathBuf;

use eft_sim::{SimulateOptions, processor_in_the_loop as in_the_loop};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::to_python;
use crate::excitation::Command;
use crate::interruption::Watch;
use crate::rig::GivenRig;
use crate::run::traces;
use crate::specimen::specimen;
use crate::values::whole_number;

/// Return the source text of a rig's controller, a constant in Rust or C, for firmware.
#[pyfunction]
#[pyo3(signature = (rig, target, name=None))]
pub(crate) fn export_source(rig: GivenRig, target: &str, name: Option<&str>) -> PyResult<String> {
    let target = target.parse().map_err(to_python)?;
    eft_sim::export::export(&rig.config, name, target).map_err(to_python)
}

/// Return an FMU's model description for a version of FMI, and its rig file.
#[pyfunction]
pub(crate) fn fmu_files(
    rig: GivenRig,
    part: &str,
    #[pyo3(from_py_with = whole_number)] fmi: u32,
) -> PyResult<(String, String)> {
    let files = || {
        let (part, version) = (eft_fmu::Part::named(part)?, eft_fmu::Version::numbered(fmi)?);
        Ok((eft_fmu::description(&rig.config, part, version)?, eft_fmu::resource(&rig.config, part)?))
    };
    files().map_err(to_python)
}

/// Run `command` with a firmware image on an emulated processor as the controller; the traces by name.
#[pyfunction]
#[pyo3(signature = (rig, command, image, machine, progress=None, structure=None))]
#[allow(clippy::too_many_arguments, reason = "one for each of Python's")]
pub(crate) fn processor_in_the_loop<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
    image: PathBuf,
    machine: &str,
    progress: Option<Py<PyAny>>,
    structure: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (rig, command, options) = (&rig.config, command.single()?, SimulateOptions::default());
    let mut watch = Watch::new(progress);
    let go_on = |done, total| watch.go_on(done, total);
    let (specimen, raised) = specimen(structure, false);
    let run =
        py.detach(|| in_the_loop::run_in_qemu(rig, command, &options, &image, machine, specimen, go_on));
    traces(py, vec![raised.or(watch.end(run))?], false)
}
