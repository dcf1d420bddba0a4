//! `eft.Record`, and the function that reads one.

use std::path::PathBuf;

use eft_sim::{preparation, records};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::values::{optional_number, optional_whole, real_number, whole_number};

/// One component of a ground motion.
///
/// Parameters
/// ----------
/// acceleration : array_like
///     Ground acceleration in m/s², one dimension, finite.
/// dt : float
///     Time between two points, in s.
/// name : str
///     Name of the record.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Record {
    pub(crate) inner: records::Record,
    acceleration: PyOnceLock<Py<PyArray1<f64>>>,
}

fn record(result: eft_sim::Result<records::Record>) -> PyResult<Record> {
    result.map(|inner| Record { inner, acceleration: PyOnceLock::new() }).map_err(to_python)
}

#[pymethods]
impl Record {
    #[new]
    #[pyo3(signature = (acceleration, dt, name=""))]
    fn new(
        acceleration: &Bound<'_, PyAny>,
        #[pyo3(from_py_with = real_number)] dt: f64,
        name: &str,
    ) -> PyResult<Self> {
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

    /// Name of the record in the file, or name of the file.
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

    /// Return the record without the polynomial of a degree (0 to 5) that fits its acceleration best.
    ///
    /// Parameters
    /// ----------
    /// degree : int
    ///     Degree of the polynomial in time.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Record([2.0, 0.0, 2.0, 0.0], 0.01).baseline_corrected(0).acceleration.tolist()
    /// [1.0, -1.0, 1.0, -1.0]
    #[pyo3(signature = (degree=1))]
    fn baseline_corrected(&self, #[pyo3(from_py_with = whole_number)] degree: usize) -> PyResult<Self> {
        record(preparation::baseline_corrected(&self.inner, degree))
    }

    /// Return the record filtered to `low` to `high` (Hz) by a zero-phase Butterworth filter.
    ///
    /// Parameters
    /// ----------
    /// low, high : float
    ///     Corner frequencies, Hz, above 0 and below half the sample rate.
    /// order : int
    ///     Order of the filter, 1 to 10.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft, numpy
    /// >>> motion = eft.Record(numpy.sin(numpy.arange(1000) / 10.0), 0.01)
    /// >>> motion.band_passed(5.0, 20.0).pga < 0.5 * motion.pga
    /// True
    #[pyo3(signature = (low, high, order=4))]
    fn band_passed(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = real_number)] low: f64,
        #[pyo3(from_py_with = real_number)] high: f64,
        order: i32,
    ) -> PyResult<Self> {
        record(py.detach(|| preparation::band_passed(&self.inner, low, high, order)))
    }

    /// Return the record at another sample rate (Hz), after removing frequencies above half of it.
    ///
    /// Parameters
    /// ----------
    /// rate : float
    ///     In Hz.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft, numpy
    /// >>> motion = eft.Record(numpy.sin(numpy.arange(1000) / 10.0), 0.01)
    /// >>> motion.resampled(200.0).dt
    /// 0.005
    fn resampled(&self, py: Python<'_>, #[pyo3(from_py_with = real_number)] rate: f64) -> PyResult<Self> {
        record(py.detach(|| preparation::resampled(&self.inner, rate)))
    }

    /// Return the record with its acceleration and its time multiplied by factors.
    ///
    /// A model at the length scale `S` with unchanged accelerations has the time factor ``sqrt(S)``.
    ///
    /// Parameters
    /// ----------
    /// acceleration, time : float
    ///     Factors on the acceleration and on the step; the second is positive.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> half = eft.Record([0.0, 2.0, 0.0], 0.01).scaled(acceleration=0.5, time=2.0)
    /// >>> half.pga, half.dt
    /// (1.0, 0.02)
    #[pyo3(signature = (acceleration=1.0, time=1.0))]
    fn scaled(
        &self,
        #[pyo3(from_py_with = real_number)] acceleration: f64,
        #[pyo3(from_py_with = real_number)] time: f64,
    ) -> PyResult<Self> {
        record(preparation::scaled(&self.inner, acceleration, time))
    }

    /// Return the record faded in over `start` and out over `end` seconds by raised cosines.
    ///
    /// Parameters
    /// ----------
    /// start, end : float
    ///     Lengths of both ramps, in s.
    ///
    /// Returns
    /// -------
    /// Record
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not allowed; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> eft.Record([1.0] * 5, 0.01).tapered(0.01, 0.01).acceleration.tolist()
    /// [0.0, 1.0, 1.0, 1.0, 0.0]
    fn tapered(
        &self,
        #[pyo3(from_py_with = real_number)] start: f64,
        #[pyo3(from_py_with = real_number)] end: f64,
    ) -> PyResult<Self> {
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

/// Read a ground motion: PEER AT2, CSMIP and COSMOS V2, K-NET, or columns. The format is recognised by the
/// content.
///
/// A unit is never guessed: columns without a unit in the header need `unit`. The mean of a K-NET file is
/// removed, because it is an offset of the instrument.
///
/// Parameters
/// ----------
/// path : str or path-like
///     The file.
/// dt : float, optional
///     Step in s, for a file without a step.
/// unit : str, optional
///     Unit of the values, required for a column file without a unit: ``"g"``, ``"m/s2"``, ``"cm/s2"``,
///     ``"mm/s2"``, ``"in/s2"`` or ``"ft/s2"``.
/// channel : int, optional
///     Channel of a V2 file, counted from 1; needed if there are several.
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
///     If the file names no unit and none is given, if it is not valid in its format, or if it is larger than
///     24 MiB. The message names the line if there is one.
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
    #[pyo3(from_py_with = optional_number)] dt: Option<f64>,
    unit: Option<&str>,
    #[pyo3(from_py_with = optional_whole)] channel: Option<usize>,
) -> PyResult<Record> {
    let unit = match unit {
        None => None,
        Some(name) => Some(records::Unit::from_name(name).ok_or_else(|| {
            refuse(
                "unit",
                format!("{name:?}"),
                format!("must be a unit of acceleration: {}", eft_sim::units::units_of("m/s2")),
            )
        })?),
    };
    let options = records::ReadOptions { dt, unit, channel };
    record(py.detach(|| records::read_record_with(&path, &options)))
}
