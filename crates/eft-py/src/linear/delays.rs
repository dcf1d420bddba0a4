//! The parts of a rig's delay, and the lead network that compensates for it.

use eft_sim::linear;
use numpy::{Complex64, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::rig::GivenRig;
use crate::values::{optional_number, real_pair};

/// Return the parts of the delay that the lead network must compensate for, in s.
///
/// The function does not change `compensation.response_delay`.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// sample_rate : float, optional
///     In Hz; that of the rig's controller if not given.
/// band : tuple of float
///     Band in Hz over which phases are converted to delays.
///
/// Returns
/// -------
/// dict
///     ``valve``, ``hold`` (half a sample, and ``dac.delay``), ``computation``, ``sensor`` (negative for an
///     estimated velocity that leads), ``derivative`` (negative, because it leads), ``path`` (of the
///     compensation: all except the derivative, which acts on the force error only) and ``total`` (the sum,
///     as in the paper).
#[pyfunction]
#[pyo3(signature = (rig, sample_rate=None, band=(0.25, 10.0)), text_signature = "(rig, sample_rate=None, band=(0.25, 10.0))")]
pub(crate) fn delay_budget<'py>(
    py: Python<'py>,
    rig: GivenRig,
    #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
    #[pyo3(from_py_with = real_pair)] band: (f64, f64),
) -> PyResult<Bound<'py, PyDict>> {
    let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
    let budget = linear::delay_budget(&rig.config, rate, band).map_err(to_python)?;
    let parts = [
        ("valve", budget.valve),
        ("hold", budget.hold),
        ("computation", budget.computation),
        ("sensor", budget.sensor),
        ("derivative", budget.derivative),
        ("path", budget.path),
        ("total", budget.total),
    ];
    parts.into_py_dict(py)
}

/// Return the steady-state gains of a rig's velocity observer, on displacement (1), velocity (1/s) and drift (1/s²).
///
/// They solve the discrete Riccati equation for the noises in ``controller.observer_...``.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// sample_rate : float, optional
///     In Hz; that of the rig's controller if not given.
#[pyfunction]
#[pyo3(signature = (rig, sample_rate=None))]
pub(crate) fn observer_gains(
    rig: GivenRig,
    #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
) -> PyResult<(f64, f64, f64)> {
    let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
    let [displacement, velocity, drift] = rig.config.observer_gains(rate).map_err(to_python)?;
    Ok((displacement, velocity, drift))
}

/// Return the frequency responses of Fig. 6: the servovalve, Eq. (4), and the lead network that inverts it, Eq. (8).
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// frequency : array_like
///     Frequencies in Hz, one dimension.
///
/// Returns
/// -------
/// valve : numpy.ndarray
///     Spool opening per valve command, complex, 1/V.
/// lead : numpy.ndarray
///     Valve command per required opening, complex, V; without the ``1/G_p`` of the servovalve controller.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "two arrays are two arrays")]
pub(crate) fn inverse_dynamics<'py>(
    py: Python<'py>,
    rig: GivenRig,
    frequency: &Bound<'py, PyAny>,
) -> PyResult<(Bound<'py, PyArray1<Complex64>>, Bound<'py, PyArray1<Complex64>>)> {
    let frequencies = arrays::vector("frequency", frequency)?;
    if let Some(bad) = frequencies.iter().find(|f| !(f.is_finite() && **f >= 0.0)) {
        return Err(refuse("frequency", bad, "must be finite and not negative, in Hz"));
    }
    let of = |response: fn(&eft_sim::RigConfig, f64) -> Complex64| {
        PyArray1::from_iter(py, frequencies.iter().map(|frequency| response(&rig.config, *frequency)))
    };
    Ok((of(linear::valve_response), of(linear::lead_response)))
}
