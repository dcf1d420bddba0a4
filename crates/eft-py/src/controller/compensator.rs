//! `eft.Compensator`.

use eft_core::Realization;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::controller::channel::{Channel, Further};
use crate::controller::shared::python_methods;
use crate::one_caller::OneCaller;
use crate::rig::GivenRig;
use crate::values::{optional_number, real_number};

/// The velocity feedback compensation, one sample at a time: the same code as in firmware.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its compensation, limits and flow table are used, but nothing of the true valve. With ``compensation.adaptive``,
///     ``compensation.guard``, ``compensation.supply_correction`` or ``protection.enabled`` that part runs as well.
///     ``compensation.computation_delay`` is not applied to its output.
/// dtype : {"f64", "f32"}
///     The precision of the arithmetic.
/// sample_rate : float, optional
///     In Hz; ``controller.sample_rate`` of the rig if left out.
///
/// Notes
/// -----
/// It can be pickled and copied at rest only, because a copy would not have what it has learned. A call while another
/// one is under way raises ``RuntimeError``: make one object for each thread.
#[pyclass(frozen, module = "eft")]
pub(crate) struct Compensator {
    channel: OneCaller<Channel>,
    /// Rig, scheme, precision and sample rate.
    shown: String,
}

python_methods!(Compensator {
    #[new]
    #[pyo3(signature = (rig, dtype="f64", *, sample_rate=None))]
    fn new(rig: GivenRig, dtype: &str, #[pyo3(from_py_with = optional_number)] sample_rate: Option<f64>) -> PyResult<Self> {
        let channel = Channel::new(&rig, dtype, sample_rate, Realization::Analog)?;
        let shown = channel.shown();
        Ok(Self { channel: OneCaller::new("eft.Compensator", channel), shown })
    }

    /// Take one sample and return the compensation signal in V.
    ///
    /// An invalid measurement leaves the state, repeats the last output and raises a flag in `status`.
    ///
    /// Parameters
    /// ----------
    /// velocity : float
    ///     Measured piston velocity, m/s.
    /// force : float
    ///     Measured force, N.
    /// spool : float
    ///     Measured spool opening.
    /// command : float
    ///     Force command, N; needed by feedforward, estimators, guard and protection, and ignored without them.
    /// supply_pressure : float, optional
    ///     Measured supply pressure, Pa; needed if ``compensation.supply_correction`` is on, otherwise ignored.
    /// valve_command : float, optional
    ///     Valve command at the time of the other measurements, V; needed if ``compensation.adaptive`` is on. The
    ///     protection of an analog force loop compares the spool with it, if it is given.
    /// displacement : float, optional
    ///     Measured displacement, m; needed if the protection limits it or the velocity is estimated.
    /// acceleration : float, optional
    ///     Measured acceleration, m/s²; needed if ``controller.velocity_source`` is ``"accelerometer"``.
    /// next_command : float, optional
    ///     Force command of the next sample, N; needed if ``compensation.look_ahead`` is on. In `process` the
    ///     default is the command's own next sample; the last one is held.
    /// alive : float, optional
    ///     Alive counter: one more than in the last sample, or 0 after its largest value, which is below
    ///     16777216. The protection watches it from the first given one on.
    /// period : float, optional
    ///     Measured time since the last sample, s. The protection watches it from the first given one on.
    /// load_pressure : float, optional
    ///     Measured load pressure, the difference of the chamber pressures, Pa, with the sign of the force; for
    ///     ``protection.load_pressure_tolerance``.
    ///
    /// Returns
    /// -------
    /// float
    ///     The compensation signal, V.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a signal is missing that the rig needs; the message names the key.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> compensator = eft.Compensator(eft.Rig.zhao2005())
    /// >>> compensator.step(velocity=0.1, force=0.0, spool=0.0) > 0.0
    /// True
    // The signature shows the effective default, while the code distinguishes a missing command from zero.
    #[pyo3(
        signature = (velocity, force, spool, command=None, supply_pressure=None, *, valve_command=None, displacement=None, acceleration=None, next_command=None, alive=None, period=None, load_pressure=None),
        text_signature = "($self, velocity, force, spool, command=0.0, supply_pressure=None, *, valve_command=None, displacement=None, acceleration=None, next_command=None, alive=None, period=None, load_pressure=None)"
    )]
    #[allow(clippy::too_many_arguments)] // Python's, most of them optional
    fn step(
        &self,
        #[pyo3(from_py_with = real_number)] velocity: f64,
        #[pyo3(from_py_with = real_number)] force: f64,
        #[pyo3(from_py_with = real_number)] spool: f64,
        #[pyo3(from_py_with = optional_number)] command: Option<f64>,
        #[pyo3(from_py_with = optional_number)] supply_pressure: Option<f64>,
        #[pyo3(from_py_with = optional_number)] valve_command: Option<f64>,
        #[pyo3(from_py_with = optional_number)] displacement: Option<f64>,
        #[pyo3(from_py_with = optional_number)] acceleration: Option<f64>,
        #[pyo3(from_py_with = optional_number)] next_command: Option<f64>,
        #[pyo3(from_py_with = optional_number)] alive: Option<f64>,
        #[pyo3(from_py_with = optional_number)] period: Option<f64>,
        #[pyo3(from_py_with = optional_number)] load_pressure: Option<f64>,
    ) -> PyResult<f64> {
        let mut channel = self.channel.lock()?;
        channel.needs_command(command.is_some())?;
        let further = Further {
            supply_pressure,
            valve_command,
            displacement,
            acceleration,
            next_command,
            alive,
            period,
            load_pressure,
        };
        channel.step([command.unwrap_or(0.0), velocity, force, spool], further)
    }

    /// Take a whole array of samples and return the compensation signal in V; `status` collects their flags.
    ///
    /// Parameters
    /// ----------
    /// velocity, force, spool : array_like
    ///     Samples of the signals of `step`, of equal length.
    /// command, supply_pressure : array_like, optional
    ///     As in `step`.
    /// valve_command, displacement, acceleration, next_command, alive, period, load_pressure : array_like, optional
    ///     As in `step`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     The compensation signals, V.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the lengths differ, or a signal is missing that the rig needs; the message names it.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> compensator = eft.Compensator(eft.Rig.zhao2005())
    /// >>> compensator.process(velocity=[0.0, 0.1], force=[0.0, 0.0], spool=[0.0, 0.0]).argmax().item()
    /// 1
    #[pyo3(signature = (velocity, force, spool, command=None, supply_pressure=None, *, valve_command=None, displacement=None, acceleration=None, next_command=None, alive=None, period=None, load_pressure=None))]
    #[allow(clippy::too_many_arguments)] // Python's, most of them optional
    fn process<'py>(
        &self,
        py: Python<'py>,
        velocity: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
        spool: &Bound<'py, PyAny>,
        command: Option<&Bound<'py, PyAny>>,
        supply_pressure: Option<&Bound<'py, PyAny>>,
        valve_command: Option<&Bound<'py, PyAny>>,
        displacement: Option<&Bound<'py, PyAny>>,
        acceleration: Option<&Bound<'py, PyAny>>,
        next_command: Option<&Bound<'py, PyAny>>,
        alive: Option<&Bound<'py, PyAny>>,
        period: Option<&Bound<'py, PyAny>>,
        load_pressure: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut channel = self.channel.lock()?;
        channel.needs_command(command.is_some())?;
        let signals = [command, Some(velocity), Some(force), Some(spool)];
        let further =
            [supply_pressure, valve_command, displacement, acceleration, next_command, alive, period, load_pressure];
        channel.process(py, signals, further)
    }

    /// Go to the steady state of this operating point, so that the next step has no bump.
    ///
    /// The calibration, the force loop's integral and the state of the protection are kept.
    ///
    /// Parameters
    /// ----------
    /// velocity, force, spool, command : float
    ///     The signals of `step` at this point, in m/s, N, 1 and N. The velocity must be 0 unless
    ///     ``controller.velocity_source`` is ``"sensor"``.
    /// supply_pressure : float, optional
    ///     In Pa; by default the configured one.
    /// displacement : float, optional
    ///     In m; needed unless ``controller.velocity_source`` is ``"sensor"``.
    /// acceleration : float, optional
    ///     In m/s²; needed if ``controller.velocity_source`` is ``"accelerometer"``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a signal is missing from which the velocity is estimated, or a velocity is given that is estimated.
    ///
    /// Examples
    /// --------
    /// >>> import eft
    /// >>> compensator = eft.Compensator(eft.Rig.zhao2005())
    /// >>> compensator.prime(force=500.0)
    /// >>> compensator.hold()
    /// 0.0
    #[pyo3(signature = (velocity=0.0, force=0.0, spool=0.0, command=0.0, supply_pressure=None, *, displacement=None, acceleration=None))]
    #[allow(clippy::too_many_arguments)] // Python's, all of them optional
    fn prime(
        &self,
        #[pyo3(from_py_with = real_number)] velocity: f64,
        #[pyo3(from_py_with = real_number)] force: f64,
        #[pyo3(from_py_with = real_number)] spool: f64,
        #[pyo3(from_py_with = real_number)] command: f64,
        #[pyo3(from_py_with = optional_number)] supply_pressure: Option<f64>,
        #[pyo3(from_py_with = optional_number)] displacement: Option<f64>,
        #[pyo3(from_py_with = optional_number)] acceleration: Option<f64>,
    ) -> PyResult<()> {
        let values = [command, velocity, force, spool];
        self.channel.lock()?.prime(values, supply_pressure, [displacement, acceleration])
    }

    /// Factor on the valve command in a shutdown, 1 to 0; the analog controller must apply it.
    #[getter]
    fn authority(&self) -> PyResult<f64> {
        Ok(self.channel.lock()?.last().authority)
    }
});
