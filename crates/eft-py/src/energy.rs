//! Energy balances of tests.

use eft_sim::closed_loop::{self, EnergyTraces};
use eft_sim::plant::EnergyBalance;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::arrays;
use crate::excitation::Command;
use crate::integration::options;
use crate::interruption::interruptible;
use crate::rig::GivenRig;
use crate::values::{optional_number, real_number};

/// The energy balance of a test in J by name, with the total dissipation and the relative gap.
#[pyfunction]
pub(crate) fn energy_balance<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
    #[pyo3(from_py_with = optional_number)] largest_step: Option<f64>,
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
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
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

/// A balance by name, with the total dissipation and the relative gap.
pub(crate) fn energies<'py>(py: Python<'py>, balance: &EnergyBalance) -> PyResult<Bound<'py, PyDict>> {
    let energies = [
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
    ];
    energies.into_py_dict(py)
}
