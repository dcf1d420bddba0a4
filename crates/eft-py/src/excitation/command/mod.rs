//! `eft.Command`: a force for one actuator or several.

mod methods;

use eft_sim::{RigConfig, excitation};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::errors::{refuse, to_python};
use crate::excitation::Record;
use crate::rig::is_building;

/// A force command: samples in N at a constant rate. The time of sample `i` is `i / sample_rate`.
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
///     If a value is not finite or the rate is outside its range.
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
    /// One per actuator; at least one.
    pub(crate) channels: Vec<excitation::Command>,
    /// Whether the values have a leading axis.
    pub(crate) stacked: bool,
    values: PyOnceLock<Py<PyAny>>,
    origin: Option<Origin>,
}

/// The origin of an effective force.
pub(super) struct Origin {
    pub(super) record: Py<Record>,
    /// Factor on the acceleration.
    pub(super) scale: f64,
    /// Mass (kg), or one per actuator.
    pub(super) mass: Py<PyAny>,
}

impl Origin {
    fn clone_ref(&self, py: Python<'_>) -> Self {
        Self { record: self.record.clone_ref(py), scale: self.scale, mass: self.mass.clone_ref(py) }
    }
}

impl Command {
    pub(super) fn of_one(result: eft_sim::Result<excitation::Command>) -> PyResult<Self> {
        let channels = vec![result.map_err(to_python)?];
        Ok(Self { channels, stacked: false, values: PyOnceLock::new(), origin: None })
    }

    pub(super) fn of_several(
        results: impl Iterator<Item = eft_sim::Result<excitation::Command>>,
    ) -> PyResult<Self> {
        let channels = results.collect::<eft_sim::Result<Vec<_>>>().map_err(to_python)?;
        if channels.is_empty() {
            return Err(refuse("values", "no actuators", "must have at least one"));
        }
        Ok(Self { channels, stacked: true, values: PyOnceLock::new(), origin: None })
    }

    /// The same command with an origin.
    pub(super) fn from(self, origin: Origin) -> Self {
        Self { origin: Some(origin), ..self }
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

    /// A command with other channels and the same dimensions, or the error of an invalid channel.
    fn with(&self, channels: impl Iterator<Item = eft_sim::Result<excitation::Command>>) -> PyResult<Self> {
        let made = Self::of_several(channels)?;
        Ok(Self { stacked: self.stacked, ..made })
    }

    /// This command and a number, or a command of the same shape, sample by sample.
    fn combined(&self, other: &Bound<'_, PyAny>, f: impl Fn(f64, f64) -> f64) -> PyResult<Self> {
        let other = other.cast::<Self>()?.get();
        let shape = |command: &Self| (command.stacked, command.channels.len(), command.first().values.len());
        if shape(self) != shape(other) || self.first().sample_rate != other.first().sample_rate {
            let (_, actuators, samples) = shape(other);
            let found =
                format!("{actuators} actuators, {samples} samples at {} Hz", other.first().sample_rate);
            let (_, actuators, samples) = shape(self);
            let allowed = format!(
                "must have {actuators} actuators, {samples} samples at {} Hz",
                self.first().sample_rate
            );
            return Err(refuse("command", found, allowed));
        }
        self.with(self.channels.iter().zip(&other.channels).map(|(a, b)| {
            let values = a.values.iter().zip(&b.values).map(|(a, b)| f(*a, *b)).collect();
            excitation::Command::new(values, a.sample_rate)
        }))
    }

    /// This command times a factor, with the same origin.
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
