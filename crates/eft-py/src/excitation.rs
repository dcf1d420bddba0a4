//! `eft.Command`, `eft.Record` and the functions that make them.

use std::path::PathBuf;

use eft_sim::{RigConfig, excitation, records};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::rig::is_building;

/// A force command: samples in N at a constant rate; sample `i` belongs to the time `i / sample_rate`.
///
/// Parameters
/// ----------
/// values : array_like
///     Commanded force in N, finite: one dimension, or (actuators, samples) for several actuators.
/// sample_rate : float
///     Samples per second, in Hz.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Command {
    /// One an actuator; at least one.
    pub(crate) channels: Vec<excitation::Command>,
    /// Whether the values have a leading axis.
    pub(crate) stacked: bool,
    values: PyOnceLock<Py<PyAny>>,
}

impl Command {
    fn of_one(result: eft_sim::Result<excitation::Command>) -> PyResult<Self> {
        Ok(Self { channels: vec![result.map_err(to_python)?], stacked: false, values: PyOnceLock::new() })
    }

    fn of_several(results: impl Iterator<Item = eft_sim::Result<excitation::Command>>) -> PyResult<Self> {
        let channels = results.collect::<eft_sim::Result<Vec<_>>>().map_err(to_python)?;
        if channels.is_empty() {
            return Err(refuse("values", "no actuators", "must have at least one"));
        }
        Ok(Self { channels, stacked: true, values: PyOnceLock::new() })
    }

    /// The command of the only actuator.
    pub(crate) fn single(&self) -> PyResult<&excitation::Command> {
        match (self.channels.as_slice(), self.stacked) {
            ([one], false) => Ok(one),
            _ => {
                let allowed =
                    "must be of one actuator, in one dimension, for a rig that is no shear building";
                Err(refuse("command", format!("{} actuators", self.channels.len()), allowed))
            }
        }
    }

    /// The commands of a rig's actuators.
    pub(crate) fn of(&self, rig: &RigConfig) -> PyResult<&[excitation::Command]> {
        if !is_building(rig) {
            return self.single().map(std::slice::from_ref);
        }
        if self.stacked {
            return Ok(&self.channels);
        }
        let stories = rig.structure.floors();
        let allowed = format!("must have one row for each of {stories} stories: (actuators, samples)");
        Err(refuse("command", "one actuator", allowed))
    }

    fn first(&self) -> &excitation::Command {
        &self.channels[0]
    }
}

#[pymethods]
impl Command {
    #[new]
    fn new(values: &Bound<'_, PyAny>, sample_rate: f64) -> PyResult<Self> {
        let array = arrays::real("values", values)?;
        if array.getattr("ndim")?.extract::<usize>()? == 1 {
            return Self::of_one(excitation::Command::new(arrays::flat(&array)?, sample_rate));
        }
        let rows = arrays::rows("values", &array)?;
        Self::of_several(rows.into_iter().map(|row| excitation::Command::new(row, sample_rate)))
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

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, f64)> {
        Ok((self.values(py)?, self.first().sample_rate))
    }
}

/// One component of a ground motion.
///
/// Parameters
/// ----------
/// acceleration : array_like
///     Ground acceleration in m/s², one dimension, finite.
/// dt : float
///     Time between two points, in s.
/// name : str
///     What the record is called.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Record {
    pub(crate) inner: records::Record,
    acceleration: PyOnceLock<Py<PyArray1<f64>>>,
}

pub(crate) fn record(result: eft_sim::Result<records::Record>) -> PyResult<Record> {
    result.map(|inner| Record { inner, acceleration: PyOnceLock::new() }).map_err(to_python)
}

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (acceleration, dt, name=""))]
    fn new(acceleration: &Bound<'_, PyAny>, dt: f64, name: &str) -> PyResult<Self> {
        record(records::Record::new(name, arrays::vector("acceleration", acceleration)?, dt))
    }

    /// Ground acceleration in m/s², read-only.
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let array = self.acceleration.get_or_try_init(py, || arrays::frozen(py, &self.inner.acceleration))?;
        Ok(array.bind(py).clone())
    }

    /// Time between two points, in s.
    #[getter]
    fn dt(&self) -> f64 {
        self.inner.dt
    }

    /// What the file calls the record, or the file's own name.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Peak ground acceleration in m/s².
    #[getter]
    fn pga(&self) -> f64 {
        self.inner.pga()
    }

    /// Time of each point in s, from zero.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, (0..self.inner.acceleration.len()).map(|i| i as f64 * self.inner.dt))
    }

    fn __len__(&self) -> usize {
        self.inner.acceleration.len()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.inner == other.inner
    }

    fn __repr__(&self) -> String {
        format!(
            "<eft.Record {:?}: {} points, dt {} s, peak {:.4} m/s²>",
            self.inner.name,
            self.inner.acceleration.len(),
            self.inner.dt,
            self.inner.pga(),
        )
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray1<f64>>, f64, &str)> {
        Ok((self.acceleration(py)?, self.inner.dt, &self.inner.name))
    }
}

/// Make a sine whose frequency runs linearly from `f_start` to `f_end`.
///
/// Parameters
/// ----------
/// amplitude : float
///     Force amplitude in N.
/// f_start, f_end : float
///     Frequencies in Hz, from 0 to half the sample rate.
/// duration : float
///     Length in s.
/// sample_rate : float
///     Samples per second, in Hz.
///
/// Returns
/// -------
/// Command
///     ``amplitude·sin(2π(f_start·t + (f_end − f_start)·t²/(2·duration)))``.
#[pyfunction]
pub(crate) fn sine_sweep(
    amplitude: f64,
    f_start: f64,
    f_end: f64,
    duration: f64,
    sample_rate: f64,
) -> PyResult<Command> {
    Command::of_one(excitation::sine_sweep(amplitude, f_start, f_end, duration, sample_rate))
}

/// Make the effective force ``−mass·scale·a_g`` of a ground motion, resampled linearly.
///
/// Parameters
/// ----------
/// record : Record
///     The ground motion.
/// mass : float or array_like
///     Mass in kg; the masses of a building's floors, from the ground up, give a command of as many actuators.
/// sample_rate : float
///     Samples per second of the command, in Hz.
/// scale : float
///     Factor on the acceleration.
#[pyfunction]
#[pyo3(signature = (record, mass, sample_rate, scale=1.0))]
pub(crate) fn effective_force(
    record: &Record,
    mass: &Bound<'_, PyAny>,
    sample_rate: f64,
    scale: f64,
) -> PyResult<Command> {
    let force = |mass| excitation::effective_force(&record.inner, mass, sample_rate, scale);
    match mass.extract::<f64>() {
        Ok(mass) => Command::of_one(force(mass)),
        Err(_) => Command::of_several(arrays::vector("mass", mass)?.into_iter().map(force)),
    }
}

/// Read a ground motion: PEER AT2, CSMIP and COSMOS V2, or columns; the format is recognised by content.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file.
/// dt : float, optional
///     Step in s, for a file that states none.
/// unit : str, optional
///     Unit of the values (``"g"``, ``"m/s2"``, ``"cm/s2"``, ``"in/s2"``), for a column file that states none.
/// channel : int, optional
///     Which channel of a V2 file, counted from 1; needed where there are several.
///
/// Raises
/// ------
/// FileNotFoundError
///     If there is no such file.
/// ValueError
///     If the file is not what its format promises, with the line where there is one.
#[pyfunction]
#[pyo3(signature = (path, *, dt=None, unit=None, channel=None))]
pub(crate) fn read_record(
    py: Python<'_>,
    path: PathBuf,
    dt: Option<f64>,
    unit: Option<&str>,
    channel: Option<usize>,
) -> PyResult<Record> {
    let unit = match unit {
        None => None,
        Some(name) => Some(records::Unit::from_name(name).ok_or_else(|| {
            refuse(
                "unit",
                format!("{name:?}"),
                "must be a unit of acceleration, such as \"g\", \"m/s2\" or \"cm/s2\"",
            )
        })?),
    };
    let options = records::ReadOptions { dt, unit, channel };
    record(py.detach(|| records::read_record_with(&path, &options)))
}
