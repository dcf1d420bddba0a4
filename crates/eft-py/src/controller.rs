//! `eft.Compensator` and `eft.Controller`: the core's own steps.

use eft_core::{Compensation, CompensationState, ControllerState, Feedforward, FeedforwardState};
use eft_sim::closed_loop::{Precision, RigController, only_plain};
use eft_sim::rig::TABLE_CAPACITY;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::rig::Rig;
use crate::run::Dtype;

/// What one sample brings, in the units of the Python interface.
#[derive(Clone, Copy)]
struct Sample {
    command: f64,
    velocity: f64,
    force: f64,
    spool: f64,
}

impl Sample {
    /// In the precision of the controller: command, velocity, force, spool.
    fn rounded<P: Precision>(&self) -> [P; 4] {
        [self.command, self.velocity, self.force, self.spool].map(P::from_f64)
    }
}

/// A step of the core in either precision: value in V and flags.
trait Tick: Send + Sync {
    fn step(&mut self, sample: Sample) -> (f64, u32);
    fn hold(&self) -> (f64, u32);
    fn prime(&mut self, sample: Sample);
    fn reset(&mut self);
}

/// The flow that the command itself needs (none where the rig has the feedforward off).
struct Forward<P> {
    core: Feedforward<P>,
    state: FeedforwardState<P>,
}

impl<P: Precision> Forward<P> {
    fn new(rig: &Rig, rate: f64) -> PyResult<Self> {
        let core = P::feedforward(&rig.config, rate).map_err(to_python)?;
        Ok(Self { core, state: FeedforwardState::default() })
    }

    fn flow(&mut self, command: P) -> P {
        self.core.step(&mut self.state, command)
    }

    /// At rest at this command; the flow it needs there.
    fn rest(&mut self, command: P) -> P {
        self.state = self.core.at_rest(command);
        self.flow(command)
    }
}

struct Compensating<P: Precision> {
    core: Compensation<P, TABLE_CAPACITY>,
    state: CompensationState<P>,
    forward: Forward<P>,
}

impl<P: Precision<Flags = u32> + Send + Sync> Tick for Compensating<P> {
    fn step(&mut self, s: Sample) -> (f64, u32) {
        let [command, velocity, force, spool] = s.rounded();
        let flow = self.forward.flow(command);
        let output = self.core.step(&mut self.state, velocity, force, spool, flow);
        (output.value.to_f64(), output.status)
    }

    fn hold(&self) -> (f64, u32) {
        let output = self.core.hold(&self.state);
        (output.value.to_f64(), output.status)
    }

    fn prime(&mut self, s: Sample) {
        let [command, velocity, force, spool] = s.rounded();
        let flow = self.forward.rest(command);
        self.state = self.core.prime(velocity, force, spool, flow);
    }

    fn reset(&mut self) {
        self.state = CompensationState::default();
        self.forward.state = FeedforwardState::default();
    }
}

struct Controlling<P: Precision> {
    core: RigController<P>,
    state: ControllerState<P>,
    forward: Forward<P>,
}

impl<P: Precision<Flags = u32> + Send + Sync> Tick for Controlling<P> {
    fn step(&mut self, s: Sample) -> (f64, u32) {
        let [command, velocity, force, spool] = s.rounded();
        let flow = self.forward.flow(command);
        let output = self.core.step_via(&mut self.state, command, velocity, force, spool, flow, |v_c| v_c);
        (output.valve_command.to_f64(), output.status)
    }

    fn hold(&self) -> (f64, u32) {
        let output = self.core.hold(&self.state);
        (output.valve_command.to_f64(), output.status)
    }

    fn prime(&mut self, s: Sample) {
        let [command, velocity, force, spool] = s.rounded();
        self.forward.rest(command);
        self.state = self.core.prime(command, velocity, force, spool);
    }

    fn reset(&mut self) {
        self.state = ControllerState::default();
        self.forward.state = FeedforwardState::default();
    }
}

/// The step with the flags it raised last.
struct Channel {
    tick: Box<dyn Tick>,
    status: u32,
}

impl Channel {
    fn compensating<P: Precision<Flags = u32> + Send + Sync + 'static>(
        rig: &Rig,
        rate: f64,
    ) -> PyResult<Self> {
        let core = P::controller(&rig.config, rate).map_err(to_python)?.compensation;
        let forward = Forward::<P>::new(rig, rate)?;
        let tick = Compensating { core, state: CompensationState::default(), forward };
        Ok(Self { tick: Box::new(tick), status: 0 })
    }

    fn controlling<P: Precision<Flags = u32> + Send + Sync + 'static>(
        rig: &Rig,
        rate: f64,
    ) -> PyResult<Self> {
        let core = P::controller(&rig.config, rate).map_err(to_python)?;
        let forward = Forward::<P>::new(rig, rate)?;
        let tick = Controlling { core, state: ControllerState::default(), forward };
        Ok(Self { tick: Box::new(tick), status: 0 })
    }

    fn keep(&mut self, (value, status): (f64, u32)) -> f64 {
        self.status = status;
        value
    }

    /// One sample after the other; the flags of all of them stay.
    fn process<'py>(
        &mut self,
        py: Python<'py>,
        signals: [(&str, Option<&Bound<'py, PyAny>>); 4],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut samples: Option<(&str, Vec<Sample>)> = None;
        let none = Sample { command: 0.0, velocity: 0.0, force: 0.0, spool: 0.0 };
        for (index, (name, given)) in signals.into_iter().enumerate() {
            let Some(given) = given else { continue };
            let values = arrays::vector(name, given)?;
            let (first, samples) = samples.get_or_insert_with(|| (name, vec![none; values.len()]));
            if values.len() != samples.len() {
                let allowed = format!("must have as many samples as {first}, {}", samples.len());
                return Err(refuse(name, format!("{} samples", values.len()), allowed));
            }
            for (sample, value) in samples.iter_mut().zip(values) {
                match index {
                    0 => sample.command = value,
                    1 => sample.velocity = value,
                    2 => sample.force = value,
                    _ => sample.spool = value,
                }
            }
        }
        let samples = samples.map(|(_, samples)| samples).unwrap_or_default();
        let tick = &mut self.tick;
        let (values, status) = py.detach(|| {
            let mut all = 0;
            let step = |sample| {
                let (value, status) = tick.step(sample);
                all |= status;
                value
            };
            (samples.into_iter().map(step).collect::<Vec<_>>(), all)
        });
        self.status = status;
        Ok(PyArray1::from_vec(py, values))
    }
}

fn nothing_measured(supply_pressure: Option<f64>) -> PyResult<()> {
    match supply_pressure {
        None => Ok(()),
        Some(value) => Err(refuse(
            "supply_pressure",
            value,
            "must be None: no correction for a measured supply is built in",
        )),
    }
}

/// The velocity feedback compensation, one sample at a time: the same code as in firmware.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its compensation, limits and flow table are used; nothing of the true valve.
/// dtype : {"f64", "f32"}
///     The precision of the arithmetic.
/// sample_rate : float, optional
///     In Hz; ``controller.sample_rate`` of the rig if left out.
#[pyclass(module = "eft")]
pub(crate) struct Compensator {
    channel: Channel,
    feedforward: bool,
}

#[pymethods]
impl Compensator {
    #[new]
    #[pyo3(signature = (rig, dtype="f64", *, sample_rate=None))]
    fn new(rig: &Rig, dtype: &str, sample_rate: Option<f64>) -> PyResult<Self> {
        only_plain(&rig.config).map_err(to_python)?;
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        let channel = match Dtype::parse(dtype)? {
            Dtype::F32 => Channel::compensating::<f32>(rig, rate)?,
            Dtype::F64 => Channel::compensating::<f64>(rig, rate)?,
        };
        Ok(Self { channel, feedforward: rig.config.compensation.feedforward })
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
    ///     Force command, N; only the flow feedforward looks at it.
    /// supply_pressure : float, optional
    ///     Measured supply pressure, Pa.
    #[pyo3(signature = (velocity, force, spool, command=0.0, supply_pressure=None))]
    fn step(
        &mut self,
        velocity: f64,
        force: f64,
        spool: f64,
        command: f64,
        supply_pressure: Option<f64>,
    ) -> PyResult<f64> {
        nothing_measured(supply_pressure)?;
        let output = self.channel.tick.step(Sample { command, velocity, force, spool });
        Ok(self.channel.keep(output))
    }

    /// Take a whole array of samples and return the compensation signal in V; `status` collects their flags.
    #[pyo3(signature = (velocity, force, spool, command=None))]
    fn process<'py>(
        &mut self,
        py: Python<'py>,
        velocity: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
        spool: &Bound<'py, PyAny>,
        command: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        if self.feedforward && command.is_none() {
            return Err(refuse("command", "None", "must be given: `compensation.feedforward` is on"));
        }
        let given = [("velocity", Some(velocity)), ("force", Some(force)), ("spool", Some(spool))];
        self.channel.process(py, [("command", command), given[0], given[1], given[2]])
    }

    /// Return the last output once more, in V; the state stays.
    fn hold(&mut self) -> f64 {
        let output = self.channel.tick.hold();
        self.channel.keep(output)
    }

    /// Go to the state of a rig that has long been at this operating point, so that the next step has no bump.
    #[pyo3(signature = (velocity=0.0, force=0.0, spool=0.0, command=0.0))]
    fn prime(&mut self, velocity: f64, force: f64, spool: f64, command: f64) {
        self.channel.tick.prime(Sample { command, velocity, force, spool });
    }

    /// Go back to the state of a new object: a rig at rest.
    fn reset(&mut self) {
        self.channel.tick.reset();
        self.channel.status = 0;
    }

    /// Flags of the last call, bits of `eft.Status`.
    #[getter]
    fn status(&self) -> u32 {
        self.channel.status
    }
}

/// The whole digital controller, one tick at a time: compensation, Eq. (1) and limits, the same code as in firmware.
///
/// Parameters
/// ----------
/// rig : Rig
///     Its controller, compensation, limits and flow table are used; nothing of the true valve.
/// dtype : {"f64", "f32"}
///     The precision of the arithmetic.
/// sample_rate : float, optional
///     In Hz; ``controller.sample_rate`` of the rig if left out.
#[pyclass(module = "eft")]
pub(crate) struct Controller {
    channel: Channel,
}

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (rig, dtype="f64", *, sample_rate=None))]
    fn new(rig: &Rig, dtype: &str, sample_rate: Option<f64>) -> PyResult<Self> {
        only_plain(&rig.config).map_err(to_python)?;
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        let channel = match Dtype::parse(dtype)? {
            Dtype::F32 => Channel::controlling::<f32>(rig, rate)?,
            Dtype::F64 => Channel::controlling::<f64>(rig, rate)?,
        };
        Ok(Self { channel })
    }

    /// Take one sample and return the valve command in V.
    ///
    /// An invalid command or measurement leaves the state, repeats the last output and raises a flag in `status`.
    ///
    /// Parameters
    /// ----------
    /// command : float
    ///     Force command, N.
    /// velocity : float
    ///     Measured piston velocity, m/s.
    /// force : float
    ///     Measured force, N.
    /// spool : float
    ///     Measured spool opening.
    /// supply_pressure : float, optional
    ///     Measured supply pressure, Pa.
    #[pyo3(signature = (command, velocity, force, spool, supply_pressure=None))]
    fn step(
        &mut self,
        command: f64,
        velocity: f64,
        force: f64,
        spool: f64,
        supply_pressure: Option<f64>,
    ) -> PyResult<f64> {
        nothing_measured(supply_pressure)?;
        let output = self.channel.tick.step(Sample { command, velocity, force, spool });
        Ok(self.channel.keep(output))
    }

    /// Take a whole array of samples and return the valve commands in V; `status` collects their flags.
    fn process<'py>(
        &mut self,
        py: Python<'py>,
        command: &Bound<'py, PyAny>,
        velocity: &Bound<'py, PyAny>,
        force: &Bound<'py, PyAny>,
        spool: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let given = [("velocity", Some(velocity)), ("force", Some(force)), ("spool", Some(spool))];
        self.channel.process(py, [("command", Some(command)), given[0], given[1], given[2]])
    }

    /// Return the last valve command once more, in V; the state stays.
    fn hold(&mut self) -> f64 {
        let output = self.channel.tick.hold();
        self.channel.keep(output)
    }

    /// Go to the state of a rig that has long been at this operating point, so that the next step has no bump.
    #[pyo3(signature = (command=0.0, velocity=0.0, force=0.0, spool=0.0))]
    fn prime(&mut self, command: f64, velocity: f64, force: f64, spool: f64) {
        self.channel.tick.prime(Sample { command, velocity, force, spool });
    }

    /// Go back to the state of a new object: a rig at rest.
    fn reset(&mut self) {
        self.channel.tick.reset();
        self.channel.status = 0;
    }

    /// Flags of the last call, bits of `eft.Status`.
    #[getter]
    fn status(&self) -> u32 {
        self.channel.status
    }
}
