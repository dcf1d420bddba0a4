//! Spectra, and the check before a test.

use eft_sim::config::Mode;
use eft_sim::feasibility::{self, Demand};
use eft_sim::prediction::{self, PredictedError};
use eft_sim::{Unreached, spectra};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyList};

use crate::arrays;
use crate::errors::to_python;
use crate::excitation::{Command, Record};
use crate::interruption::interruptible;
use crate::rig::{GivenRig, Rig};
use crate::values::real_number;

/// Return the largest relative displacement in m of oscillators on the ground motion.
///
/// The displacement times ``(2π/period)²`` is the pseudo-acceleration.
///
/// Parameters
/// ----------
/// record : Record
///     The ground motion.
/// periods : array_like
///     Natural periods in s, one dimension.
/// damping : float
///     Damping ratio.
///
/// Returns
/// -------
/// numpy.ndarray
///     In m, one for each period.
///
/// Raises
/// ------
/// ValueError
///     If a period or the damping is not allowed.
///
/// Examples
/// --------
/// >>> import eft
/// >>> motion = eft.Record([0.0, 1.0, -1.0, 0.0], dt=0.1)
/// >>> eft.records.displacement_spectrum(motion, [0.5, 1.0]).shape
/// (2,)
#[pyfunction]
#[pyo3(signature = (record, periods, damping=0.05))]
pub(crate) fn displacement_spectrum<'py>(
    py: Python<'py>,
    record: &Record,
    periods: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] damping: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let periods = arrays::vector("periods", periods)?;
    let spectrum = || spectra::displacement_spectrum(&record.inner, &periods, damping);
    Ok(PyArray1::from_vec(py, interruptible(py, spectrum)?))
}

/// Return the demands of force commands on a rig, one dictionary each: ``name``, ``unit``, ``required``,
/// ``available``,
/// ``advised``.
///
/// In a shear building the demands are those of the actuator with the largest, and the pump's mean flow is that of all.
#[pyfunction]
pub(crate) fn demands<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
) -> PyResult<Bound<'py, PyList>> {
    let rig = &rig.config;
    let commands = command.of(rig)?;
    listed(py, &interruptible(py, || feasibility::demands(rig, commands))?)
}

/// Return the least advised peak of a force command, N.
#[pyfunction]
pub(crate) fn smallest_force(rig: GivenRig) -> f64 {
    feasibility::smallest_force(&rig.config)
}

fn listed<'py>(py: Python<'py>, demands: &[Demand]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for demand in demands {
        let entry = PyDict::new(py);
        entry.set_item("name", demand.name)?;
        entry.set_item("unit", demand.unit)?;
        entry.set_item("required", demand.required)?;
        entry.set_item("available", demand.available)?;
        entry.set_item("advised", demand.advised)?;
        list.append(entry)?;
    }
    Ok(list)
}

/// Compare the demands of a force command with the rig's capacity before a test.
///
/// With self-calibration or the guard, margin and sample rate are those of the loop before any calibration.
///
/// Returns
/// -------
/// dict
///     ``demands`` as of `demands`, ``scheme`` (the simplest that suffices), ``margin`` (the largest stable
///     compensation level, or `None` if no level is stable), ``smallest_sample_rate`` (Hz, or `None` if the
///     loop is unstable at 12,800 Hz) and ``lowest_supply_pressure`` (Pa, while the valves draw the demanded flow).
#[pyfunction]
pub(crate) fn check_feasibility<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
) -> PyResult<Bound<'py, PyDict>> {
    let rig = &rig.config;
    let commands = command.of(rig)?;
    let found = interruptible(py, || feasibility::check_feasibility(rig, commands))?;
    let answer = PyDict::new(py);
    answer.set_item("demands", listed(py, &found.demands)?)?;
    answer.set_item(
        "scheme",
        match found.scheme {
            Mode::Off => "off",
            Mode::Linear => "linear",
            Mode::Nonlinear => "nonlinear",
        },
    )?;
    answer.set_item("margin", found.margin)?;
    answer.set_item("smallest_sample_rate", found.smallest_sample_rate)?;
    answer.set_item("lowest_supply_pressure", found.lowest_supply_pressure)?;
    Ok(answer)
}

/// Return the rig as self-calibration at a sample rate (Hz) will have tuned it.
#[pyfunction]
pub(crate) fn learned(rig: GivenRig, #[pyo3(from_py_with = real_number)] sample_rate: f64) -> PyResult<Rig> {
    Ok(Rig { config: eft_sim::learned(&rig.config, sample_rate).map_err(to_python)? })
}

/// Return the exponent by which a deviation grows until self-calibration at a sample rate (Hz) has found its estimates.
#[pyfunction]
pub(crate) fn growth_until_learned(
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<f64> {
    eft_sim::growth_until_learned(&rig.config, sample_rate).map_err(to_python)
}

/// Return the rig with the level to which a guard alone will have reduced it at a sample rate (Hz), or None if it does
/// not act.
#[pyfunction]
pub(crate) fn guarded(
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<Option<Rig>> {
    Ok(eft_sim::guarded(&rig.config, sample_rate).map_err(to_python)?.map(|config| Rig { config }))
}

/// Return the errors of a test at small motion as the linear model predicts them, or `None` if it cannot.
///
/// Returns
/// -------
/// dict or None
///     ``force``, ``displacement`` and ``oscillation``: the ``whole`` error, and its parts by ``noise`` and by ``constant`` causes, rms
///     over rms. ``constants``: keys with the rms of the force in N that each causes. ``unreached``: what self-calibration
///     needs, and the nearest that it reaches, or flow and valve gain that it rejects or that noise may make it reject.
///     ``left_out``: what is not contained, keys of the rig and the command above 20 or 100 Hz.
#[pyfunction]
pub(crate) fn predicted_errors<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Command,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let rig = &rig.config;
    let commands = command.of(rig)?;
    let Some(found) = interruptible(py, || prediction::predict(rig, commands))? else { return Ok(None) };
    let parts = |error: PredictedError| {
        let parts = [("whole", error.whole), ("noise", error.noise), ("constant", error.constant)];
        parts.into_py_dict(py)
    };
    let answer = PyDict::new(py);
    answer.set_item("force", parts(found.force)?)?;
    answer.set_item("displacement", parts(found.displacement)?)?;
    answer.set_item("constants", found.constants)?;
    answer.set_item("overlap", found.overlap)?;
    answer.set_item("null_learned", found.null_learned)?;
    let unreached = found.unreached.iter().map(|one| match *one {
        Unreached::Rejected(flow, valve) => ("rejected", flow, valve),
        Unreached::Doubtful(flow, valve, _) => ("doubtful", flow, valve),
        Unreached::FlowGain(needed, nearest) => ("flow gain", needed, nearest),
        Unreached::ValveGain(needed, nearest) => ("valve gain", needed, nearest),
        Unreached::Delay(needed, nearest) => ("delay", needed, nearest),
    });
    answer.set_item("unreached", unreached.collect::<Vec<_>>())?;
    answer.set_item("oscillation", parts(found.oscillation)?)?;
    answer.set_item("play", (found.play.error, found.play.oscillation))?;
    answer.set_item("left_out", found.left_out)?;
    Ok(Some(answer))
}
