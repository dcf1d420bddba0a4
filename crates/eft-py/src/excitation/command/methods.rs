//! The Python methods of a command.

use eft_sim::excitation;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyTuple};

use crate::arrays;
use crate::errors::refuse;
use crate::excitation::command::{Command, Origin};
use crate::excitation::record::Record;
use crate::values::{real_number, real_pair, whole_number};

#[pymethods]
impl Command {
    #[new]
    fn new(
        values: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
    ) -> PyResult<Self> {
        let array = arrays::real("values", values)?;
        if array.getattr("ndim")?.extract::<usize>()? == 1 {
            return Self::of_one(excitation::Command::new(arrays::flat(&array)?, sample_rate));
        }
        let rows = arrays::rows("values", &array)?;
        Self::of_several(rows.into_iter().map(|row| excitation::Command::new(row, sample_rate)))
    }

    /// Make a force of zero up to `start`, and of `amplitude` from there on.
    ///
    /// Parameters
    /// ----------
    /// amplitude : float
    ///     In N.
    /// duration, sample_rate : float
    ///     In s and Hz.
    /// start : float
    ///     In s.
    ///
    /// Returns
    /// -------
    /// Command
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Command.step(100.0, duration=1.0, sample_rate=4.0, start=0.5).values.tolist()
    /// [0.0, 0.0, 100.0, 100.0]
    #[staticmethod]
    #[pyo3(signature = (amplitude, duration, sample_rate, *, start=0.0))]
    fn step(
        #[pyo3(from_py_with = real_number)] amplitude: f64,
        #[pyo3(from_py_with = real_number)] duration: f64,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
        #[pyo3(from_py_with = real_number)] start: f64,
    ) -> PyResult<Self> {
        Self::of_one(excitation::step(amplitude, start, duration, sample_rate))
    }

    /// Make a sine of one frequency.
    ///
    /// Parameters
    /// ----------
    /// amplitude, frequency : float
    ///     In N and Hz.
    /// duration, sample_rate : float
    ///     In s and Hz.
    ///
    /// Returns
    /// -------
    /// Command
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Command.sine(100.0, 2.0, duration=1.0, sample_rate=64.0).values.max().item()
    /// 100.0
    #[staticmethod]
    fn sine(
        #[pyo3(from_py_with = real_number)] amplitude: f64,
        #[pyo3(from_py_with = real_number)] frequency: f64,
        #[pyo3(from_py_with = real_number)] duration: f64,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
    ) -> PyResult<Self> {
        Self::of_one(excitation::sine(amplitude, frequency, duration, sample_rate))
    }

    /// Make some cycles of a sine under a raised cosine, followed by zero.
    ///
    /// Parameters
    /// ----------
    /// amplitude, frequency : float
    ///     In N and Hz.
    /// cycles : float
    ///     How many.
    /// duration, sample_rate : float
    ///     Of the whole command, in s and Hz.
    ///
    /// Returns
    /// -------
    /// Command
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> burst = eft.Command.burst(100.0, 2.0, cycles=4, duration=4.0, sample_rate=64.0)
    /// >>> burst.values[128:].any().item()
    /// False
    #[staticmethod]
    fn burst(
        #[pyo3(from_py_with = real_number)] amplitude: f64,
        #[pyo3(from_py_with = real_number)] frequency: f64,
        #[pyo3(from_py_with = real_number)] cycles: f64,
        #[pyo3(from_py_with = real_number)] duration: f64,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
    ) -> PyResult<Self> {
        Self::of_one(excitation::burst(amplitude, frequency, cycles, duration, sample_rate))
    }

    /// Make sines of the same amplitude at every multiple of ``1/duration`` in a band, with a low peak.
    ///
    /// The phases are Schroeder's. The command can be repeated without a jump.
    ///
    /// Parameters
    /// ----------
    /// amplitude : float
    ///     Largest force in N.
    /// band : tuple of float
    ///     Lowest and highest frequency in Hz.
    /// duration, sample_rate : float
    ///     In s and Hz.
    ///
    /// Returns
    /// -------
    /// Command
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed, or the band holds no multiple of ``1/duration``.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> command = eft.Command.multisine(100.0, (1.0, 10.0), duration=4.0, sample_rate=256.0)
    /// >>> round(abs(command.values).max().item(), 6)
    /// 100.0
    #[staticmethod]
    fn multisine(
        #[pyo3(from_py_with = real_number)] amplitude: f64,
        #[pyo3(from_py_with = real_pair)] band: (f64, f64),
        #[pyo3(from_py_with = real_number)] duration: f64,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
    ) -> PyResult<Self> {
        Self::of_one(excitation::multisine(amplitude, band, duration, sample_rate))
    }

    /// Make Gaussian noise within a band; the same seed gives the same command.
    ///
    /// The command repeats itself without a jump.
    ///
    /// Parameters
    /// ----------
    /// rms : float
    ///     Root mean square in N.
    /// band : tuple of float
    ///     Lowest and highest frequency in Hz.
    /// duration, sample_rate : float
    ///     In s and Hz.
    /// seed : int
    ///     Of the random numbers.
    ///
    /// Returns
    /// -------
    /// Command
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed, or the band holds no multiple of ``1/duration``.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> command = eft.Command.noise(100.0, (1.0, 10.0), duration=4.0, sample_rate=256.0, seed=1)
    /// >>> round(command.values.std().item(), 6)
    /// 100.0
    #[staticmethod]
    #[pyo3(signature = (rms, band, duration, sample_rate, *, seed=0))]
    fn noise(
        #[pyo3(from_py_with = real_number)] rms: f64,
        #[pyo3(from_py_with = real_pair)] band: (f64, f64),
        #[pyo3(from_py_with = real_number)] duration: f64,
        #[pyo3(from_py_with = real_number)] sample_rate: f64,
        #[pyo3(from_py_with = whole_number)] seed: u64,
    ) -> PyResult<Self> {
        Self::of_one(excitation::noise(rms, band, duration, sample_rate, seed))
    }

    /// Commanded force in N, read-only; (actuators, samples) for several actuators.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let array = self.values.get_or_try_init(py, || {
            let channels = self.channels.iter().map(|channel| channel.values.clone()).collect();
            let array = arrays::stacked(py, channels, self.stacked)?;
            array.call_method1("setflags", (false,))?;
            PyResult::Ok(array.unbind())
        })?;
        Ok(array.bind(py).clone())
    }

    /// Samples per second, in Hz.
    #[getter]
    fn sample_rate(&self) -> f64 {
        self.first().sample_rate
    }

    /// Time of each sample in s, from zero.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.first().time())
    }

    /// Length in s, the number of samples over the sample rate.
    #[getter]
    fn duration(&self) -> f64 {
        self.first().duration()
    }

    fn __len__(&self) -> usize {
        self.first().values.len()
    }

    /// The ground motion of an effective force; `None` for other commands.
    #[getter]
    fn record(&self, py: Python<'_>) -> Option<Py<Record>> {
        self.origin.as_ref().map(|origin| origin.record.clone_ref(py))
    }

    /// Factor on the ground motion's acceleration; `None` for a command without a ground motion.
    #[getter]
    fn scale(&self) -> Option<f64> {
        self.origin.as_ref().map(|origin| origin.scale)
    }

    /// Mass in kg of the effective force, for several actuators an array; `None` for a command without a ground motion.
    #[getter]
    fn mass(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.origin.as_ref().map(|origin| origin.mass.clone_ref(py))
    }

    /// NumPy leaves the operators to the command, so that a number of NumPy is a factor and an array is refused.
    #[classattr]
    #[pyo3(name = "__array_ufunc__")]
    fn array_ufunc(py: Python<'_>) -> Py<PyAny> {
        py.None()
    }

    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.combined(other, |a, b| a + b)
    }

    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.combined(other, |a, b| a - b)
    }

    fn __mul__(&self, py: Python<'_>, #[pyo3(from_py_with = real_number)] factor: f64) -> PyResult<Self> {
        self.times(py, factor)
    }

    fn __rmul__(&self, py: Python<'_>, #[pyo3(from_py_with = real_number)] factor: f64) -> PyResult<Self> {
        self.times(py, factor)
    }

    fn __truediv__(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = real_number)] divisor: f64,
    ) -> PyResult<Self> {
        self.times(py, 1.0 / divisor)
    }

    fn __neg__(&self, py: Python<'_>) -> PyResult<Self> {
        self.times(py, -1.0)
    }

    /// Return some consecutive samples of every actuator, as ``command[:4096]`` does; the time begins at zero again.
    fn __getitem__(&self, py: Python<'_>, samples: &Bound<'_, PySlice>) -> PyResult<Self> {
        let at = samples.indices(self.first().values.len() as isize)?;
        if at.step != 1 || at.slicelength == 0 {
            return Err(refuse(
                "slice",
                samples.repr()?,
                "must be of at least one sample, one after the other",
            ));
        }
        let (start, stop) = (at.start as usize, at.start as usize + at.slicelength);
        let channels = self.channels.iter().map(|channel| {
            excitation::Command::new(channel.values[start..stop].to_vec(), channel.sample_rate)
        });
        let origin = self.origin.as_ref().map(|origin| origin.clone_ref(py));
        Ok(Self { origin, ..self.with(channels)? })
    }

    fn __eq__(&self, other: &Self) -> bool {
        (self.stacked, &self.channels) == (other.stacked, &other.channels)
    }

    fn __repr__(&self) -> String {
        let forces = self.channels.iter().flat_map(|channel| &channel.values);
        let peak = forces.fold(0.0, |peak: f64, force| peak.max(force.abs()));
        let actuators =
            if self.stacked { format!("{} actuators, ", self.channels.len()) } else { String::new() };
        let first = self.first();
        format!(
            "<eft.Command: {actuators}{} samples at {} Hz, {} s, peak {peak:.6} N>",
            first.values.len(),
            first.sample_rate,
            first.duration(),
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, command) = (slf.py(), slf.get());
        let origin = (command.record(py), command.scale(), command.mass(py));
        let made = slf.get_type().getattr("_made")?;
        let arguments = (command.values(py)?, command.sample_rate(), origin).into_pyobject(py)?;
        Ok((made, arguments))
    }

    #[staticmethod]
    fn _made(
        values: &Bound<'_, PyAny>,
        sample_rate: f64,
        origin: (Option<Py<Record>>, Option<f64>, Option<Py<PyAny>>),
    ) -> PyResult<Self> {
        let origin = match origin {
            (Some(record), Some(scale), Some(mass)) => Some(Origin { record, scale, mass }),
            _ => None,
        };
        Ok(Self { origin, ..Self::new(values, sample_rate)? })
    }
}
