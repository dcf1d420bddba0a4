//! `eft.linearize` and what is asked of linear models.

use eft_sim::linear::{self, FlowGain, MapAxis, MapQuantity, StateSpace, Time};
use numpy::{Complex64, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::rig::Rig;
use crate::values;

/// A rig's closed loop, linear about rest: ``dx/dt = A x + B u``, ``y = C x + D u``, sampled or continuous.
///
/// The input is the force command in N. Of a shear building inputs, states and outputs carry the number of the actuator,
/// ``command_1`` and so on. Made by `linearize`.
#[pyclass(frozen, module = "eft")]
pub(crate) struct LinearModel {
    inner: StateSpace,
}

type Matrix<'py> = PyResult<Bound<'py, PyArray2<f64>>>;

/// A matrix in numpy's order.
fn matrix<'py>(
    py: Python<'py>,
    rows: usize,
    columns: usize,
    entry: impl Fn(usize, usize) -> f64,
) -> Matrix<'py> {
    let entries = (0..rows * columns).map(|i| entry(i / columns, i % columns));
    PyArray1::from_iter(py, entries).reshape([rows, columns])
}

macro_rules! matrix {
    ($py:expr, $m:expr) => {
        matrix($py, $m.nrows(), $m.ncols(), |i, j| $m[(i, j)])
    };
}

#[pymethods]
impl LinearModel {
    /// State matrix.
    #[getter]
    #[allow(non_snake_case, reason = "the name everyone knows")]
    fn A<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        matrix!(py, self.inner.a)
    }

    /// Input matrix, one column for each of `inputs`.
    #[getter]
    #[allow(non_snake_case, reason = "the name everyone knows")]
    fn B<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        matrix!(py, self.inner.b)
    }

    /// Output matrix, one row for each of `outputs`.
    #[getter]
    #[allow(non_snake_case, reason = "the name everyone knows")]
    fn C<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        matrix!(py, self.inner.c)
    }

    /// Feedthrough, one column for each of `inputs`.
    #[getter]
    #[allow(non_snake_case, reason = "the name everyone knows")]
    fn D<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        matrix!(py, self.inner.d)
    }

    /// Names of the states.
    #[getter]
    fn states(&self) -> Vec<String> {
        self.inner.states.clone()
    }

    /// Names of the inputs.
    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.inner.inputs.clone()
    }

    /// Keys of the rig whose effect on small signals the model does not have, such as an overlap or friction.
    #[getter]
    fn left_out(&self) -> Vec<&str> {
        self.inner.left_out.clone()
    }

    /// Names of the outputs: force (N), displacement (m), velocity (m/s), spool (1), load_pressure (Pa), and of a
    /// sampled model compensation (V).
    #[getter]
    fn outputs(&self) -> Vec<String> {
        self.inner.outputs.clone()
    }

    /// Time between samples in s, `None` in continuous time.
    #[getter]
    fn sample_time(&self) -> Option<f64> {
        self.inner.sample_time
    }

    /// Whether every mode decays.
    #[getter]
    fn stable(&self) -> PyResult<bool> {
        Ok(self.growth_rate()? < 0.0)
    }

    /// Growth rate of the least damped mode in 1/s; negative where the loop is stable.
    #[getter]
    fn growth_rate(&self) -> PyResult<f64> {
        self.inner.growth_rate().map_err(to_python)
    }

    /// Return the poles in 1/s, those of a sampled model in the z-plane, by magnitude.
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        Ok(PyArray1::from_vec(py, self.inner.poles().map_err(to_python)?))
    }

    /// Return the modes by natural frequency: frequencies in Hz, damping ratios, and poles in 1/s.
    ///
    /// The poles of a sampled model are taken back to continuous time.
    #[allow(clippy::type_complexity, reason = "three arrays are three arrays")]
    fn modes<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<Complex64>>)>
    {
        let modes = self.inner.modes().map_err(to_python)?;
        Ok((
            PyArray1::from_iter(py, modes.iter().map(|mode| mode.frequency)),
            PyArray1::from_iter(py, modes.iter().map(|mode| mode.damping)),
            PyArray1::from_iter(py, modes.iter().map(|mode| mode.pole)),
        ))
    }

    /// Return the complex response of an output to the force command, in the output's unit per N.
    ///
    /// Parameters
    /// ----------
    /// frequency : array_like
    ///     Frequencies in Hz, one dimension.
    /// output : str
    ///     One of `outputs`.
    /// input : str
    ///     One of `inputs`.
    #[pyo3(signature = (frequency, output="force", input="command"))]
    fn response<'py>(
        &self,
        py: Python<'py>,
        frequency: &Bound<'py, PyAny>,
        output: &str,
        input: &str,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        let frequencies = arrays::vector("frequency", frequency)?;
        let answer = |frequency: &f64| self.inner.response_to(input, output, *frequency);
        let values: Vec<_> = frequencies.iter().map(answer).collect::<Result<_, _>>().map_err(to_python)?;
        Ok(PyArray1::from_vec(py, values))
    }

    /// Return the model as a python-control ``StateSpace`` (needs the package control).
    fn to_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let named = PyDict::new(py);
        named.set_item("states", self.states())?;
        named.set_item("inputs", self.inputs())?;
        named.set_item("outputs", self.outputs())?;
        named.set_item("name", "eft")?;
        // Unstable and uncontrollable states are part of the answer.
        named.set_item("remove_useless_states", false)?;
        let step = self.inner.sample_time.unwrap_or(0.0);
        let matrices = (self.A(py)?, self.B(py)?, self.C(py)?, self.D(py)?, step);
        py.import("control")?.call_method("ss", matrices, Some(&named))
    }

    fn __repr__(&self) -> String {
        let time = match self.inner.sample_time {
            None => "continuous".to_owned(),
            Some(step) => format!("sampled at {} Hz", 1.0 / step),
        };
        let verdict = match self.inner.growth_rate() {
            Ok(rate) if rate < 0.0 => format!("stable, slowest decay {:.4} 1/s", -rate),
            Ok(rate) => format!("unstable, grows at {rate:.4} 1/s"),
            Err(error) => error.to_string(),
        };
        format!("<eft.LinearModel: {} states, {time}, {verdict}>", self.inner.a.nrows())
    }
}

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
/// Leakage proportional to the load pressure, the supply's pressure at the start, the load cell and the bandwidth of the
/// velocity sensor are in the model; what small signals feel but a linear model cannot have is named in its `left_out`.
/// In continuous time neither hold nor delays by samples exist.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// sampled : bool
///     Whether to sample exactly, with the hold, the computation delay and the realization of the force loop; at
///     the rate of the rig's controller unless `sample_rate` (Hz) is given. A rate alone asks for it too.
/// flow_gain : {"nominal", "steeper", "shallower", "mean"}
///     Which slope stands for the flow curve, on the valve and in the compensation that inverts it: the
///     configuration's `K_v`, or the table's slope on either side of the origin, or their mean.
///
/// Raises
/// ------
/// ValueError
///     If an argument is not allowed; the message names it.
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn linearize(
    rig: &Rig,
    sampled: bool,
    sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<LinearModel> {
    let gain = self::flow_gain(flow_gain)?;
    let model = linear::linearize(&rig.config, gain, time(rig, sampled, sample_rate));
    model.map(|inner| LinearModel { inner }).map_err(to_python)
}

/// Return the largest stable compensation level of the linear model that `linearize` gives.
///
/// It is infinite where no level up to 10 is unstable, as with compensation switched off. The arguments are those
/// of `linearize`.
///
/// Raises
/// ------
/// ValueError
///     If no level makes the loop stable, or an argument is not allowed.
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn stability_margin(
    py: Python<'_>,
    rig: &Rig,
    sampled: bool,
    sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<f64> {
    let (gain, time) = (self::flow_gain(flow_gain)?, time(rig, sampled, sample_rate));
    py.detach(|| linear::stability_margin(&rig.config, gain, time)).map_err(to_python)
}

/// Return every stability margin of the linear model, each setting changed alone.
///
/// The arguments are those of `linearize`.
///
/// Returns
/// -------
/// dict
///     ``growth_rate`` (1/s, of the rig as it is), ``level`` (the largest stable compensation level), and, unless the
///     rig as it is grows, ``response_delay`` (s, lowest and highest stable), ``dead_time`` (s, the shortest additional
///     delay of the compensation that is unstable, in whole samples), ``loop_gain`` (the largest stable factor on the
///     force loop) and ``flow_gain`` (lowest and highest stable ratio of the true flow gain to the configured one).
#[pyfunction]
#[pyo3(signature = (rig, *, sampled=false, sample_rate=None, flow_gain="nominal"))]
pub(crate) fn stability_margins<'py>(
    py: Python<'py>,
    rig: &Rig,
    sampled: bool,
    sample_rate: Option<f64>,
    flow_gain: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let (gain, time) = (self::flow_gain(flow_gain)?, time(rig, sampled, sample_rate));
    let margins = py.detach(|| linear::stability_margins(&rig.config, gain, time)).map_err(to_python)?;
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

/// Return a quantity of the sampled loop over two settings: one row for each value of `vertical`.
#[pyfunction]
pub(crate) fn stability_map<'py>(
    py: Python<'py>,
    rig: &Rig,
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
    let mut stopped = None;
    let rows = py.detach(|| {
        linear::stability_map(&rig.config, &horizontal, &vertical, quantity, gain, || {
            stopped = Python::attach(|py| py.check_signals()).err();
            stopped.is_none()
        })
    });
    match (rows, stopped) {
        (_, Some(error)) => Err(error),
        (Err(error), None) => Err(to_python(error)),
        (Ok(rows), None) => Ok(PyArray2::from_vec2(py, &rows)?),
    }
}

fn axis((key, values): (String, Vec<Bound<'_, PyAny>>)) -> PyResult<MapAxis> {
    let value = |given: &Bound<'_, PyAny>| {
        values::from_python(&key, given)?.ok_or_else(|| refuse(&key, "None", "must be a value"))
    };
    let values = values.iter().map(value).collect::<PyResult<_>>()?;
    Ok(MapAxis { key, values })
}

/// Return the parts of the delay that the lead network has to give back, in s.
///
/// It changes nothing: `compensation.response_delay` is used as it is given.
///
/// Parameters
/// ----------
/// rig : Rig
///     The rig.
/// sample_rate : float, optional
///     In Hz; that of the rig's controller if not given.
/// band : tuple of float
///     Band in Hz over which phases are taken as delays.
///
/// Returns
/// -------
/// dict
///     ``valve``, ``hold``, ``computation``, ``sensor``, ``derivative`` (negative: a lead), ``path`` (what the
///     compensation itself passes: all but the derivative, which acts on the force error only) and ``total`` (all of
///     them, as the paper counts).
#[pyfunction]
#[pyo3(signature = (rig, sample_rate=None, band=(0.25, 10.0)))]
pub(crate) fn delay_budget<'py>(
    py: Python<'py>,
    rig: &Rig,
    sample_rate: Option<f64>,
    band: (f64, f64),
) -> PyResult<Bound<'py, PyDict>> {
    let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
    let budget = linear::delay_budget(&rig.config, rate, band).map_err(to_python)?;
    let answer = PyDict::new(py);
    for (part, delay) in [
        ("valve", budget.valve),
        ("hold", budget.hold),
        ("computation", budget.computation),
        ("sensor", budget.sensor),
        ("derivative", budget.derivative),
        ("path", budget.path),
        ("total", budget.total),
    ] {
        answer.set_item(part, delay)?;
    }
    Ok(answer)
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
///     In Hz; ``controller.sample_rate`` where it is left out.
#[pyfunction]
#[pyo3(signature = (rig, sample_rate=None))]
pub(crate) fn observer_gains(rig: &Rig, sample_rate: Option<f64>) -> PyResult<(f64, f64, f64)> {
    let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
    let [displacement, velocity, drift] = linear::observer_gains(&rig.config, rate).map_err(to_python)?;
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
    rig: &Rig,
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
