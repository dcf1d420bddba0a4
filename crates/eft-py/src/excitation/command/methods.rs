//! `eft.Command`, `eft.Record` and the functions that make them.

use std::path::PathBuf;

use eft_sim::{RigConfig, excitation, preparation, records};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PySlice, PyTuple};

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
///
/// Raises
/// ------
/// ValueError
///     If a value is not finite or no measurement has the rate.
///
/// Examples
/// --------
/// Commands of the same length add, and take a factor and a slice:
///
/// >>> import eft
/// >>> sweep = eft.sine_sweep(8000.0, 0.0, 10.0, duration=4.0, sample_rate=1024.0)
/// >>> both = 0.5 * sweep + eft.Command.sine(500.0, 2.0, duration=4.0, sample_rate=1024.0)
/// >>> both[:1024].duration
/// 1.0
#[pyclass(frozen, module = "eft")]
pub(crate) struct Command {
    /// One an actuator; at least one.
    pub(crate) channels: Vec<excitation::Command>,
    /// Whether the values have a leading axis.
    pub(crate) stacked: bool,
    values: PyOnceLock<Py<PyAny>>,
    origin: Option<Origin>,
}

/// Where an effective force comes from.
struct Origin {
    record: Py<Record>,
    /// Factor on the acceleration.
    scale: f64,
    /// Mass (kg), or one an actuator.
    mass: Py<PyAny>,
}

impl Origin {
    fn clone_ref(&self, py: Python<'_>) -> Self {
        Self { record: self.record.clone_ref(py), scale: self.scale, mass: self.mass.clone_ref(py) }
    }
}

impl Command {
    fn of_one(result: eft_sim::Result<excitation::Command>) -> PyResult<Self> {
        let channels = vec![result.map_err(to_python)?];
        Ok(Self { channels, stacked: false, values: PyOnceLock::new(), origin: None })
    }

    fn of_several(results: impl Iterator<Item = eft_sim::Result<excitation::Command>>) -> PyResult<Self> {
        let channels = results.collect::<eft_sim::Result<Vec<_>>>().map_err(to_python)?;
        if channels.is_empty() {
            return Err(refuse("values", "no actuators", "must have at least one"));
        }
        Ok(Self { channels, stacked: true, values: PyOnceLock::new(), origin: None })
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

    /// Of other channels, in as many dimensions; as each must be valid, errors name what is not.
    fn with(&self, channels: impl Iterator<Item = eft_sim::Result<excitation::Command>>) -> PyResult<Self> {
        let made = Self::of_several(channels)?;
        Ok(Self { stacked: self.stacked, ..made })
    }

    /// This command and a number, or a command of the same shape, sample by sample.
    fn combined(&self, other: &Bound<'_, PyAny>, f: impl Fn(f64, f64) -> f64) -> PyResult<Self> {
        let other = other.cast::<Self>()?.get();
        let shape = |command: &Self| (command.stacked, command.channels.len(), command.first().values.len());
        if shape(self) != shape(other) || self.sample_rate() != other.sample_rate() {
            let (_, actuators, samples) = shape(other);
            let found = format!("{actuators} actuators, {samples} samples at {} Hz", other.sample_rate());
            let (_, actuators, samples) = shape(self);
            let allowed =
                format!("must have {actuators} actuators, {samples} samples at {} Hz", self.sample_rate());
            return Err(refuse("command", found, allowed));
        }
        self.with(self.channels.iter().zip(&other.channels).map(|(a, b)| {
            let values = a.values.iter().zip(&b.values).map(|(a, b)| f(*a, *b)).collect();
            excitation::Command::new(values, a.sample_rate)
        }))
    }

    /// This command times a factor; where it comes from a record, it still does.
    fn times(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        let channels = self.channels.iter().map(|channel| {
            let values = channel.values.iter().map(|force| factor * force).collect();
            excitation::Command::new(values, channel.sample_rate)
        });
        let origin = self
            .origin
            .as_ref()
            .map(|origin| Origin { scale: origin.scale * factor, ..origin.clone_ref(py) });
        Ok(Self { origin, ..self.with(channels)? })
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

    /// Make a force of nothing up to `start`, and of `amplitude` from there on.
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
    fn step(amplitude: f64, duration: f64, sample_rate: f64, start: f64) -> PyResult<Self> {
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
    fn sine(amplitude: f64, frequency: f64, duration: f64, sample_rate: f64) -> PyResult<Self> {
        Self::of_one(excitation::sine(amplitude, frequency, duration, sample_rate))
    }

    /// Make some cycles of a sine under a raised cosine, and nothing behind them.
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
    fn burst(amplitude: f64, frequency: f64, cycles: f64, duration: f64, sample_rate: f64) -> PyResult<Self> {
        Self::of_one(excitation::burst(amplitude, frequency, cycles, duration, sample_rate))
    }

    /// Make sines of the same amplitude at every multiple of ``1/duration`` in a band, with a low peak.
    ///
    /// The phases are Schroeder's. The command repeats itself without a jump.
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
    fn multisine(amplitude: f64, band: (f64, f64), duration: f64, sample_rate: f64) -> PyResult<Self> {
        Self::of_one(excitation::multisine(amplitude, band, duration, sample_rate))
    }

    /// Make Gaussian noise within a band; the same for the same seed.
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
    fn noise(rms: f64, band: (f64, f64), duration: f64, sample_rate: f64, seed: u64) -> PyResult<Self> {
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

    /// The ground motion that the command is the effective force of; `None` of any other.
    #[getter]
    fn record(&self, py: Python<'_>) -> Option<Py<Record>> {
        self.origin.as_ref().map(|origin| origin.record.clone_ref(py))
    }

    /// Factor on the ground motion's acceleration; `None` of a command that is of no ground motion.
    #[getter]
    fn scale(&self) -> Option<f64> {
        self.origin.as_ref().map(|origin| origin.scale)
    }

    /// Mass in kg by which the ground motion became a force, of several actuators an array; `None` of a command that
    /// is of no ground motion.
    #[getter]
    fn mass(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.origin.as_ref().map(|origin| origin.mass.clone_ref(py))
    }

    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.combined(other, |a, b| a + b)
    }

    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.combined(other, |a, b| a - b)
    }

    fn __mul__(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        self.times(py, factor)
    }

    fn __rmul__(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        self.times(py, factor)
    }

    fn __truediv__(&self, py: Python<'_>, divisor: f64) -> PyResult<Self> {
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

    /// Return the record less the polynomial of a degree (0 to 5) that fits its acceleration best.
    #[pyo3(signature = (degree=1))]
    fn baseline_corrected(&self, degree: usize) -> PyResult<Self> {
        record(preparation::baseline_corrected(&self.inner, degree))
    }

    /// Return the record within `low` to `high` (Hz): a Butterworth filter run both ways, without phase.
    #[pyo3(signature = (low, high, order=4))]
    fn band_passed(&self, py: Python<'_>, low: f64, high: f64, order: i32) -> PyResult<Self> {
        record(py.detach(|| preparation::band_passed(&self.inner, low, high, order)))
    }

    /// Return the record at another sample rate (Hz), frequencies beyond half of it taken out first.
    fn resampled(&self, py: Python<'_>, rate: f64) -> PyResult<Self> {
        record(py.detach(|| preparation::resampled(&self.inner, rate)))
    }

    /// Return the record with its acceleration and its time multiplied by factors.
    ///
    /// A model at the length scale `S` with unchanged accelerations has the time factor ``sqrt(S)``.
    #[pyo3(signature = (acceleration=1.0, time=1.0))]
    fn scaled(&self, acceleration: f64, time: f64) -> PyResult<Self> {
        record(preparation::scaled(&self.inner, acceleration, time))
    }

    /// Return the record faded in over `start` and out over `end` seconds by raised cosines.
    fn tapered(&self, start: f64, end: f64) -> PyResult<Self> {
        record(preparation::tapered(&self.inner, start, end))
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
///
/// Raises
/// ------
/// ValueError
///     If an argument is not allowed; the message names it.
///
/// Examples
/// --------
/// >>> import eft
/// >>> len(eft.sine_sweep(8900.0, 0.0, 10.0, duration=32.0, sample_rate=4096.0))
/// 131072
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
///
/// Returns
/// -------
/// Command
///     It remembers ``record``, ``scale`` and ``mass``.
///
/// Raises
/// ------
/// ValueError
///     If an argument is not allowed; the message names it.
///
/// Examples
/// --------
/// >>> import eft
/// >>> motion = eft.Record([0.0, 1.0, -1.0, 0.0], dt=0.1, name="made up")
/// >>> command = eft.effective_force(motion, mass=7000.0, sample_rate=10.0, scale=0.5)
/// >>> command.values.tolist(), command.record.name
/// ([-0.0, -3500.0, 3500.0, -0.0], 'made up')
#[pyfunction]
#[pyo3(signature = (record, mass, sample_rate, scale=1.0))]
pub(crate) fn effective_force(
    record: &Bound<'_, Record>,
    mass: &Bound<'_, PyAny>,
    sample_rate: f64,
    scale: f64,
) -> PyResult<Command> {
    let force = |mass| excitation::effective_force(&record.get().inner, mass, sample_rate, scale);
    let (command, mass) = match mass.extract::<f64>() {
        Ok(one) => (Command::of_one(force(one))?, one.into_pyobject(mass.py())?.into_any()),
        Err(_) => {
            let masses = arrays::vector("mass", mass)?;
            let kept = arrays::frozen(mass.py(), &masses)?.into_bound(mass.py()).into_any();
            (Command::of_several(masses.into_iter().map(force))?, kept)
        }
    };
    let origin = Origin { record: record.clone().unbind(), scale, mass: mass.unbind() };
    Ok(Command { origin: Some(origin), ..command })
}

/// Read a ground motion: PEER AT2, CSMIP and COSMOS V2, K-NET, or columns; the content tells the format.
///
/// A unit is never guessed: columns whose header names none need `unit`. The counts of a K-NET file lose their
/// mean, which is an offset of the instrument.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file.
/// dt : float, optional
///     Step in s, for a file that states none.
/// unit : str, optional
///     Unit of the values, which a column file must have that states none: ``"g"``, ``"m/s2"``, ``"cm/s2"``,
///     ``"mm/s2"``, ``"in/s2"`` or ``"ft/s2"``.
/// channel : int, optional
///     Which channel of a V2 file, counted from 1; needed where there are several.
///
/// Returns
/// -------
/// Record
///     Its methods prepare it: ``eft.read_record(path).baseline_corrected().band_passed(0.1, 25.0)``.
///
/// Raises
/// ------
/// FileNotFoundError
///     If there is no such file.
/// ValueError
///     If the file names no unit and none is given, or is not what its format promises, with the line where
///     there is one; if it is larger than 24 MiB.
///
/// Examples
/// --------
/// >>> import eft, pathlib, tempfile
/// >>> path = pathlib.Path(tempfile.mkdtemp()) / "quake.csv"
/// >>> _ = path.write_text("time (s),acceleration (g)\n0.00,0.0\n0.01,0.1\n0.02,0.0\n")
/// >>> round(eft.read_record(path).pga, 4)
/// 0.9807
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
                format!("must be a unit of acceleration: {}", records::Unit::NAMES.join(", ")),
            )
        })?),
    };
    let options = records::ReadOptions { dt, unit, channel };
    record(py.detach(|| records::read_record_with(&path, &options)))
}
