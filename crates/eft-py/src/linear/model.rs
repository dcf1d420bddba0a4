//! `eft.linear.LinearModel`.

use eft_sim::linear::{DMatrix, StateSpace};
use numpy::{Complex64, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::values::optional_number;

/// A rig's closed loop, linear about rest: ``dx/dt = A x + B u``, ``y = C x + D u``, sampled or continuous.
///
/// The input is the force command in N. For a shear building the names of inputs, states and outputs end with
/// the number of the actuator, as in ``command_1``. Made by `linearize`.
#[pyclass(frozen, module = "eft.linear")]
pub(crate) struct LinearModel {
    pub(crate) inner: StateSpace,
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

/// A matrix from numpy's order.
fn read(given: &Bound<'_, PyAny>) -> PyResult<DMatrix<f64>> {
    let rows = arrays::rows("state", &arrays::real("state", given)?)?;
    let columns = rows.first().map_or(0, Vec::len);
    Ok(DMatrix::from_row_iterator(rows.len(), columns, rows.into_iter().flatten()))
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

    /// Keys of the rig whose effect on small signals the model does not contain, such as an overlap or
    /// friction.
    #[getter]
    fn left_out(&self) -> Vec<String> {
        self.inner.left_out.clone()
    }

    /// Names of the outputs.
    ///
    /// They are force (N), displacement (m), velocity (m/s), spool (1) and load_pressure (Pa). A sampled model has
    /// compensation (V) as well.
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

    /// Growth rate of the least damped mode in 1/s; negative if the loop is stable.
    #[getter]
    fn growth_rate(&self) -> PyResult<f64> {
        self.inner.growth_rate().map_err(to_python)
    }

    /// Return the poles in 1/s, those of a sampled model in the z-plane, by magnitude.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     Complex numbers.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the poles cannot be computed.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> len(eft.linearize(eft.Rig.zhao2005()).poles())
    /// 6
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        Ok(PyArray1::from_vec(py, self.inner.poles().map_err(to_python)?))
    }

    /// Frequencies (Hz), damping ratios and poles (1/s) of `modes`.
    #[allow(clippy::type_complexity, reason = "three arrays are three arrays")]
    fn _modes<'py>(
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
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     One complex number for each frequency.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If there is no such input or output, or a frequency is not allowed.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> [at_1_hz] = eft.linearize(eft.Rig.zhao2005()).response([1.0])
    /// >>> f"{abs(at_1_hz):.1f}"
    /// '1.0'
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
    ///
    /// Returns
    /// -------
    /// control.StateSpace
    ///     With the names of states, inputs and outputs.
    ///
    /// Raises
    /// ------
    /// ModuleNotFoundError
    ///     If python-control is not installed.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.linearize(eft.Rig.zhao2005()).to_control().nstates
    /// 6
    fn to_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let named = PyDict::new(py);
        named.set_item("states", self.states())?;
        named.set_item("inputs", self.inputs())?;
        named.set_item("outputs", self.outputs())?;
        named.set_item("name", "eft")?;
        // Unstable and uncontrollable states must remain in the model.
        named.set_item("remove_useless_states", false)?;
        let step = self.inner.sample_time.unwrap_or(0.0);
        let matrices = (self.A(py)?, self.B(py)?, self.C(py)?, self.D(py)?, step);
        py.import("control")?.call_method("ss", matrices, Some(&named))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, model) = (slf.py(), slf.get());
        let matrices = (model.A(py)?, model.B(py)?, model.C(py)?, model.D(py)?);
        let names = (model.states(), model.inputs(), model.outputs(), model.left_out());
        let made = slf.get_type().getattr("_made")?;
        Ok((made, (matrices, names, model.inner.sample_time).into_pyobject(py)?))
    }

    #[staticmethod]
    fn _made(
        matrices: [Bound<'_, PyAny>; 4],
        names: [Vec<String>; 4],
        #[pyo3(from_py_with = optional_number)] sample_time: Option<f64>,
    ) -> PyResult<Self> {
        let [a, b, c, d] = matrices.map(|given| read(&given));
        let (a, b, c, d) = (a?, b?, c?, d?);
        let [states, inputs, outputs, left_out] = names;
        let (n, m, p) = (states.len(), inputs.len(), outputs.len());
        if [a.shape(), b.shape(), c.shape(), d.shape()] != [(n, n), (n, m), (p, n), (p, m)] {
            return Err(refuse("state", "matrices that do not fit their names", "must be as it was pickled"));
        }
        Ok(Self { inner: StateSpace { a, b, c, d, states, inputs, outputs, left_out, sample_time } })
    }

    fn __repr__(&self) -> String {
        let time = match self.inner.sample_time {
            None => "continuous".to_owned(),
            Some(step) => format!("sampled at {} Hz", 1.0 / step),
        };
        let stability = self.inner.stability().unwrap_or_else(|error| error.to_string());
        format!("<eft.linear.LinearModel: {} states, {time}, {stability}>", self.inner.a.nrows())
    }
}
