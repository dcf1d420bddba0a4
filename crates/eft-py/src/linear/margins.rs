//! The linear model of a rig, and its stability margins.

use eft_sim::linear::{self, FlowGain, MapAxis, MapQuantity, Reach, Time};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{refuse, to_python};
use crate::interruption::interruptible;
use crate::linear::LinearModel;
use crate::rig::{GivenRig, Rig};
use crate::values::{self, optional_number};

fn flow_gain(name: &str) -> PyResult<FlowGain> {
    match name {
        "nominal" => Ok(FlowGain::Nominal),
        "steeper" => Ok(FlowGain::Steeper),
        "shallower" => Ok(FlowGain::Shallower),
        "mean" => Ok(FlowGain::Mean),
        _ => {
            let allowed = "must be \"nominal\", \"steeper\", \"shallower\" or \"mean\"";
            Err(refuse("flow_gain", format!("{name:?}"), allowed))
        }
    }
}

fn time(rig: &Rig, sampled: bool, sample_rate: Option<f64>) -> Time {
    match (sampled, sample_rate) {
        (false, None) => Time::Continuous,
        (_, rate) => Time::Sampled(rate.unwrap_or(rig.config.controller.sample_rate)),
    }
}

/// Linearise a rig's closed loop about rest.
///
/// Leakage proportional to the load pressure, the supply's pressure at the start, the load cell and the
/// bandwidth of the velocity sensor are in the model. `left_out` names the keys with an effect on small
/// signals that a linear model cannot contain. A model in continuous time has neither hold nor delays of
/// samples.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// sampled : bool
///     Whether to sample exactly, with the hold, the computation delay and the realization of the force loop;
///     at the rate of the rig's controller unless `sample_rate` (Hz) is given. A given rate implies True.
/// flow_gain : {"nominal", "steeper", "shallower", "mean"}
///     The slope of the flow curve in the valve and in its inverse: the configured `K_v`, the table's slope
///     on either side of the origin, or their mean.
///
/// Returns
/// -------
/// LinearModel
///     With states, poles, modes and responses.
///
/// Raises
/// ------
/// ValueError
///     If an argument is not allowed; the message names it.
///
/// Examples
/// --------
/// >>> import eft
/// >>> eft.linearize(eft.Rig.zhao2005(), sampled=True).stable
/// True
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn linearize(
    rig: GivenRig,
    sampled: bool,
    #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<LinearModel> {
    let gain = self::flow_gain(flow_gain)?;
    let model = linear::linearize(&rig.config, gain, time(&rig, sampled, sample_rate));
    model.map(|inner| LinearModel { inner }).map_err(to_python)
}

/// Return the largest stable compensation level of the linear model from `linearize`.
///
/// It is infinite if no level up to 10 is unstable, as without compensation.
///
/// Parameters
/// ----------
/// rig, sampled, sample_rate, flow_gain
///     As of `linearize`.
///
/// Returns
/// -------
/// float
///     A compensation level.
///
/// Raises
/// ------
/// ValueError
///     If no level makes the loop stable, or an argument is not allowed.
///
/// Examples
/// --------
/// >>> import eft
/// >>> 1.0 < eft.stability_margin(eft.Rig.zhao2005(), sampled=True) < 1.1
/// True
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn stability_margin(
    py: Python<'_>,
    rig: GivenRig,
    sampled: bool,
    #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<f64> {
    let (gain, time) = (self::flow_gain(flow_gain)?, time(&rig, sampled, sample_rate));
    interruptible(py, || linear::stability_margin(&rig.config, gain, time))
}

/// Return every stability margin of the linear model, each setting changed alone.
///
/// The arguments are those of `linearize`.
///
/// Returns
/// -------
/// dict
///     ``growth_rate`` (1/s, of the unchanged rig), ``level`` (the largest stable compensation level), and,
///     if the unchanged rig is stable, ``response_delay`` (s, lowest and highest stable), ``dead_time`` (s,
///     the shortest unstable additional delay of the compensation or of the whole valve command, in whole
///     samples; infinite if up to 64 samples are stable, or as many as a building's model can hold),
///     ``loop_gain`` (the largest stable factor on the force loop) and
///     ``flow_gain`` (lowest and highest stable ratio of the true flow gain to the configured one).
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn stability_margins<'py>(
    py: Python<'py>,
    rig: GivenRig,
    sampled: bool,
    #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let (gain, time) = (self::flow_gain(flow_gain)?, time(&rig, sampled, sample_rate));
    let margins = interruptible(py, || linear::stability_margins(&rig.config, gain, time))?;
    let answer = PyDict::new(py);
    answer.set_item("growth_rate", margins.growth_rate)?;
    answer.set_item("level", margins.level)?;
    if let Some(around) = margins.around {
        answer.set_item("response_delay", around.response_delay)?;
        answer.set_item("dead_time", around.dead_time)?;
        answer.set_item("loop_gain", around.loop_gain)?;
        answer.set_item("flow_gain", around.flow_gain)?;
    }
    Ok(answer)
}

/// Return the growth rate (1/s) of the sampled loop and the margins within a reach, infinite beyond it.
///
/// The margins are the largest stable factor on the compensation level, the shortest unstable additional
/// delay (s) and the largest stable factor on the force loop's gain; `None` if the unchanged rig is unstable.
/// A level or loop gain of 1 and a negative dead time leave out the search for that margin.
#[pyfunction]
pub(crate) fn margins_within(
    py: Python<'_>,
    rig: GivenRig,
    sample_rate: f64,
    level: f64,
    dead_time: f64,
    loop_gain: f64,
    flow_gain: &str,
) -> PyResult<(f64, Option<[f64; 3]>)> {
    let reach = Reach { level, dead_time, loop_gain };
    let (gain, time) = (self::flow_gain(flow_gain)?, Time::Sampled(sample_rate));
    let found = || linear::margins_within(&rig.config, gain, time, reach);
    let (growth_rate, within) = interruptible(py, found)?;
    Ok((growth_rate, within.map(|found| [found.level, found.dead_time, found.loop_gain])))
}

/// Return a quantity of the sampled loop over two settings: one row for each value of `vertical`.
#[pyfunction]
pub(crate) fn stability_map<'py>(
    py: Python<'py>,
    rig: GivenRig,
    horizontal: (String, Vec<Bound<'py, PyAny>>),
    vertical: (String, Vec<Bound<'py, PyAny>>),
    quantity: &str,
    flow_gain: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let quantity = match quantity {
        "growth_rate" => MapQuantity::GrowthRate,
        "level" => MapQuantity::Level,
        _ => {
            let allowed = "must be \"growth_rate\" or \"level\"";
            return Err(refuse("quantity", format!("{quantity:?}"), allowed));
        }
    };
    let gain = self::flow_gain(flow_gain)?;
    let (horizontal, vertical) = (axis(horizontal)?, axis(vertical)?);
    let map = || linear::stability_map(&rig.config, &horizontal, &vertical, quantity, gain);
    Ok(PyArray2::from_vec2(py, &interruptible(py, map)?)?)
}

fn axis((key, values): (String, Vec<Bound<'_, PyAny>>)) -> PyResult<MapAxis> {
    let value = |given: &Bound<'_, PyAny>| {
        values::from_python(&key, given)?.ok_or_else(|| refuse(&key, "None", "must be a value"))
    };
    let values = values.iter().map(value).collect::<PyResult<_>>()?;
    Ok(MapAxis { key, values })
}
