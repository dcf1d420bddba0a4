//! `eft.Command`, `eft.Record` and the functions that make them.

mod command;
mod record;

use eft_sim::excitation;
use pyo3::prelude::*;

use crate::arrays;
use crate::values::real_number;

pub(crate) use command::Command;
use command::Origin;
pub(crate) use record::{Record, read_record};

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
    #[pyo3(from_py_with = real_number)] amplitude: f64,
    #[pyo3(from_py_with = real_number)] f_start: f64,
    #[pyo3(from_py_with = real_number)] f_end: f64,
    #[pyo3(from_py_with = real_number)] duration: f64,
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
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
    #[pyo3(from_py_with = real_number)] sample_rate: f64,
    #[pyo3(from_py_with = real_number)] scale: f64,
) -> PyResult<Command> {
    let force = |mass| excitation::effective_force(&record.get().inner, mass, sample_rate, scale);
    let (command, mass) = match real_number(mass) {
        Ok(one) => (Command::of_one(force(one))?, one.into_pyobject(mass.py())?.into_any()),
        Err(_) => {
            let masses = arrays::vector("mass", mass)?;
            let kept = arrays::frozen(mass.py(), &masses)?.into_bound(mass.py()).into_any();
            (Command::of_several(masses.into_iter().map(force))?, kept)
        }
    };
    let origin = Origin { record: record.clone().unbind(), scale, mass: mass.unbind() };
    Ok(command.from(origin))
}
