//! Identification from measured arrays, and virtual experiments for such arrays.

use eft_sim::identification::{
    self, Estimate, ForceLoopEstimate, MotionSignals, Recording, SpecimenSignals, TestSignals,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::Value;

use crate::arrays;
use crate::errors::refuse;
use crate::flow_table::FlowTable;
use crate::interruption::interruptible;
use crate::rig::GivenRig;
use crate::values::{self, real_number, real_pair, whole_number};

/// Return delay, uncertainty, intercept, coherence, frequencies and phase lags.
#[pyfunction]
pub(crate) fn identify_delay<'py>(
    py: Python<'py>,
    command: &Bound<'py, PyAny>,
    response: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_pair)] band: (f64, f64),
) -> PyResult<Bound<'py, PyDict>> {
    let (command, response) = (arrays::vector("command", command)?, arrays::vector("response", response)?);
    let found = interruptible(py, || identification::identify_delay(&command, &response, sample_rate, band))?;
    let answer = PyDict::new(py);
    answer.set_item("value", found.delay)?;
    answer.set_item("uncertainty", found.uncertainty)?;
    answer.set_item("intercept", found.intercept)?;
    answer.set_item("coherence", found.coherence)?;
    answer.set_item("frequency", PyArray1::from_vec(py, found.frequency))?;
    answer.set_item("lag", PyArray1::from_vec(py, found.lag))?;
    Ok(answer)
}

/// An estimate's value and uncertainty.
fn pair(estimate: Estimate) -> (f64, f64) {
    (estimate.value, estimate.uncertainty)
}

fn vectors(parameter: &str, given: &[Bound<'_, PyAny>]) -> PyResult<Vec<Vec<f64>>> {
    given.iter().map(|run| arrays::vector(parameter, run)).collect()
}

/// Pairs of spool and displacement. With unequal numbers of runs the partner is empty and is refused for its
/// length.
fn recordings<'a>(spool: &'a [Vec<f64>], displacement: &'a [Vec<f64>]) -> Vec<Recording<'a>> {
    let of = |runs: &'a [Vec<f64>], i: usize| runs.get(i).map_or(&[][..], Vec::as_slice);
    let runs = spool.len().max(displacement.len());
    (0..runs).map(|i| Recording { spool: of(spool, i), displacement: of(displacement, i) }).collect()
}

/// Return the flow curve with its uncertainties, and whether each point was measured.
#[pyfunction]
pub(crate) fn identify_flow_curve(
    py: Python<'_>,
    spool: Vec<Bound<'_, PyAny>>,
    displacement: Vec<Bound<'_, PyAny>>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] piston_area: f64,
    #[pyo3(from_py_with = whole_number)] knots: usize,
    method: &str,
) -> PyResult<FlowTable> {
    let identify = match method {
        "integral" => identification::identify_flow_curve,
        "difference" => identification::flow_curve_by_differences,
        _ => {
            let allowed = "must be \"integral\" or \"difference\"";
            return Err(refuse("method", format!("{method:?}"), allowed));
        }
    };
    let (spool, displacement) = (vectors("spool", &spool)?, vectors("displacement", &displacement)?);
    let found = interruptible(py, || {
        let runs = recordings(&spool, &displacement);
        identify(&runs, sample_rate, piston_area, knots)
    })?;
    FlowTable::found(found)
}

/// Return the flow gain at the origin in m³/s and its uncertainty.
#[pyfunction]
pub(crate) fn identify_flow_gain<'py>(
    py: Python<'py>,
    spool: Vec<Bound<'py, PyAny>>,
    displacement: Vec<Bound<'py, PyAny>>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] piston_area: f64,
    #[pyo3(from_py_with = real_number)] limit: f64,
) -> PyResult<(f64, f64)> {
    let (spool, displacement) = (vectors("spool", &spool)?, vectors("displacement", &displacement)?);
    let found = interruptible(py, || {
        let runs = recordings(&spool, &displacement);
        identification::identify_flow_gain(&runs, sample_rate, piston_area, limit)
    })?;
    Ok(pair(found))
}

/// Return overlap, null bias and the flow gains on either side, each with its uncertainty.
#[pyfunction]
pub(crate) fn identify_overlap(
    py: Python<'_>,
    spool: Vec<Bound<'_, PyAny>>,
    displacement: Vec<Bound<'_, PyAny>>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] piston_area: f64,
) -> PyResult<[(f64, f64); 4]> {
    let (spool, displacement) = (vectors("spool", &spool)?, vectors("displacement", &displacement)?);
    let found = interruptible(py, || {
        identification::identify_overlap(&recordings(&spool, &displacement), sample_rate, piston_area)
    })?;
    let [back, forth] = found.flow_gains;
    Ok([found.overlap, found.null_bias, back, forth].map(pair))
}

/// Return friction (N), compressibility (m³/Pa), flow factors of both directions and the velocity's delay (s), each
/// with its uncertainty.
#[pyfunction]
pub(crate) fn identify_friction(
    py: Python<'_>,
    rig: GivenRig,
    spool: &Bound<'_, PyAny>,
    velocity: &Bound<'_, PyAny>,
    force: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<[(f64, f64); 5]> {
    let (spool, velocity) = (arrays::vector("spool", spool)?, arrays::vector("velocity", velocity)?);
    let force = arrays::vector("force", force)?;
    let found = interruptible(py, || {
        let signals = MotionSignals { spool: &spool, velocity: &velocity, force: &force };
        identification::identify_friction(&rig.config, signals, sample_rate)
    })?;
    let [back, forth] = found.flow_factors;
    let all = [found.friction, found.compressibility, back, forth, found.velocity_delay];
    Ok(all.map(pair))
}

/// Return the latencies (s) of load cell and spool sensor, the valve's delay and pilot time constant (s) and the
/// compressibility (m³/Pa), each with its uncertainty.
#[pyfunction]
pub(crate) fn identify_force_loop(
    py: Python<'_>,
    rig: GivenRig,
    valve_command: &Bound<'_, PyAny>,
    spool: &Bound<'_, PyAny>,
    velocity: &Bound<'_, PyAny>,
    force: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<[(f64, f64); 5]> {
    let (valve_command, spool) =
        (arrays::vector("valve_command", valve_command)?, arrays::vector("spool", spool)?);
    let (velocity, force) = (arrays::vector("velocity", velocity)?, arrays::vector("force", force)?);
    let found = interruptible(py, || {
        let signals = MotionSignals { spool: &spool, velocity: &velocity, force: &force };
        identification::identify_force_loop(&rig.config, &valve_command, signals, sample_rate)
    })?;
    let valve = [found.response_delay, found.pilot_time_constant];
    let all = [found.force_delay, found.spool_delay, valve[0], valve[1], found.compressibility];
    Ok(all.map(pair))
}

/// Return the keys of a rig that take the values of `identify_force_loop`.
#[pyfunction]
pub(crate) fn force_loop_keys<'py>(
    py: Python<'py>,
    rig: GivenRig,
    found: [(f64, f64); 5],
) -> PyResult<Bound<'py, PyAny>> {
    let [force_delay, spool_delay, response_delay, pilot_time_constant, compressibility] =
        found.map(|(value, uncertainty)| Estimate { value, uncertainty });
    let found =
        ForceLoopEstimate { force_delay, spool_delay, response_delay, pilot_time_constant, compressibility };
    let keys = found.keys(&rig.config).map(|(key, value)| (key.to_owned(), value));
    values::to_python(py, &Value::Table(keys.into_iter().collect()))
}

/// Return the gain of the load cell and the ratios of the gains of force, velocity and displacement, each with its
/// uncertainty.
#[pyfunction]
pub(crate) fn identify_load_cell(
    py: Python<'_>,
    rig: GivenRig,
    signals: [Bound<'_, PyAny>; 3],
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] gain_uncertainty: f64,
    #[pyo3(from_py_with = real_number)] mass_uncertainty: f64,
) -> PyResult<[(f64, f64); 3]> {
    let [displacement, velocity, force] = signals;
    let (displacement, velocity) =
        (arrays::vector("displacement", &displacement)?, arrays::vector("velocity", &velocity)?);
    let force = arrays::vector("force", &force)?;
    let found = interruptible(py, || {
        let signals = SpecimenSignals { displacement: &displacement, velocity: &velocity, force: &force };
        identification::identify_load_cell(
            &rig.config,
            signals,
            sample_rate,
            gain_uncertainty,
            mass_uncertainty,
        )
    })?;
    Ok([found.gain, found.force_over_velocity, found.velocity_over_displacement].map(pair))
}

/// Return damping ratio and uncertainty, natural frequency (Hz) and uncertainty, and the logarithmic decrement.
#[pyfunction]
pub(crate) fn identify_damping(
    py: Python<'_>,
    displacement: &Bound<'_, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<(f64, f64, f64, f64, f64)> {
    let displacement = arrays::vector("displacement", displacement)?;
    let found = interruptible(py, || identification::identify_damping(&displacement, sample_rate))?;
    let (ratio, frequency) = (found.ratio, found.frequency);
    Ok((ratio.value, ratio.uncertainty, frequency.value, frequency.uncertainty, found.decrement))
}

/// Return level and response delay with their uncertainties, and the extremes near the natural frequency.
#[pyfunction]
pub(crate) fn fine_tune<'py>(
    py: Python<'py>,
    rig: GivenRig,
    command: &Bound<'py, PyAny>,
    force: &Bound<'py, PyAny>,
    velocity: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_pair)] band: (f64, f64),
) -> PyResult<Bound<'py, PyDict>> {
    let command = arrays::vector("command", command)?;
    let (force, velocity) = (arrays::vector("force", force)?, arrays::vector("velocity", velocity)?);
    let found = interruptible(py, || {
        let signals = TestSignals { command: &command, force: &force, velocity: &velocity };
        identification::fine_tune(&rig.config, signals, sample_rate, band)
    })?;
    let answer = PyDict::new(py);
    answer.set_item("level", pair(found.level))?;
    answer.set_item("response_delay", pair(found.response_delay))?;
    answer.set_item("natural_frequency", found.natural_frequency)?;
    answer.set_item("force_ratio", found.force_ratio)?;
    answer.set_item("peak", found.peak)?;
    answer.set_item("valley", found.valley)?;
    Ok(answer)
}

type Array<'py> = Bound<'py, PyArray1<f64>>;

/// Run the response delay test of Fig. 4a on the virtual rig: the main stage shut off, a 0–10 Hz sweep in 32 s.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// amplitude : float
///     Of the displacement command in m; displacement control gives 10 V per full stroke.
/// sample_rate : float
///     In Hz.
///
/// Returns
/// -------
/// valve_command : numpy.ndarray
///     In V.
/// spool : numpy.ndarray
///     Spool opening.
#[pyfunction]
#[pyo3(signature = (rig, amplitude=0.0254, sample_rate=2048.0))]
pub(crate) fn valve_test<'py>(
    py: Python<'py>,
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] amplitude: f64,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<(Array<'py>, Array<'py>)> {
    let test = interruptible(py, || identification::valve_test(&rig.config, amplitude, sample_rate))?;
    Ok((PyArray1::from_vec(py, test.valve_command), PyArray1::from_vec(py, test.spool)))
}

/// Run one flow test of Fig. 4b on the virtual rig: no structure, displacement control, a sine.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// amplitude : float
///     Of the displacement command in m.
/// frequency, duration : float
///     Of the sine, in Hz and s.
/// piston_mass : float
///     In kg.
/// sample_rate : float
///     In Hz.
///
/// Returns
/// -------
/// command, displacement : numpy.ndarray
///     In m.
/// spool : numpy.ndarray
///     Spool opening.
#[pyfunction]
#[pyo3(signature = (rig, amplitude, frequency=3.0, duration=4.0, piston_mass=20.0, sample_rate=2048.0))]
#[allow(clippy::type_complexity, reason = "three arrays are three arrays")]
pub(crate) fn flow_test<'py>(
    py: Python<'py>,
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] amplitude: f64,
    #[pyo3(from_py_with = real_number)] frequency: f64,
    #[pyo3(from_py_with = real_number)] duration: f64,
    #[pyo3(from_py_with = real_number)] piston_mass: f64,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<(Array<'py>, Array<'py>, Array<'py>)> {
    let run =
        || identification::flow_test(&rig.config, amplitude, frequency, duration, piston_mass, sample_rate);
    let test = interruptible(py, run)?;
    Ok((
        PyArray1::from_vec(py, test.command),
        PyArray1::from_vec(py, test.displacement),
        PyArray1::from_vec(py, test.spool),
    ))
}

/// Release the rig's structure, disconnected from the actuator, and return its displacement in m.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// displacement : float
///     From which it is released, in m.
/// duration : float
///     In s.
/// sample_rate : float
///     In Hz.
#[pyfunction]
#[pyo3(signature = (rig, displacement, duration=10.0, sample_rate=512.0))]
pub(crate) fn free_vibration<'py>(
    py: Python<'py>,
    rig: GivenRig,
    #[pyo3(from_py_with = real_number)] displacement: f64,
    #[pyo3(from_py_with = real_number)] duration: f64,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
) -> PyResult<Array<'py>> {
    let run = || identification::free_vibration(&rig.config, displacement, duration, sample_rate);
    Ok(PyArray1::from_vec(py, interruptible(py, run)?))
}
