//! Common part of both classes: a channel of the simulator in either precision, its arguments and arrays.

use eft_core::{Input, Output, Parameters, Realization};
use eft_sim::RigConfig;
use eft_sim::closed_loop::{RigChannel as Core, parameters};
use eft_sim::config::VelocitySource;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::{refuse, to_python};
use crate::rig::{Rig, name, word};
use crate::run::Dtype;

enum Precision {
    F32(Core<f32>),
    F64(Core<f64>),
}

/// The same expression for the channel of either precision.
macro_rules! each {
    ($self:expr, $core:ident => $what:expr) => {
        match $self {
            Precision::F32($core) => $what,
            Precision::F64($core) => $what,
        }
    };
}

/// A rig's controller, its constructor's arguments, and the result of its last call.
pub(super) struct Channel {
    core: Precision,
    rig: RigConfig,
    dtype: Dtype,
    sample_rate: f64,
    realization: Realization,
    last: Output<f64>,
}

/// The optional arguments of a call.
#[derive(Clone, Copy, Default)]
pub(super) struct Further {
    pub(super) supply_pressure: Option<f64>,
    pub(super) valve_command: Option<f64>,
    pub(super) displacement: Option<f64>,
    pub(super) acceleration: Option<f64>,
    pub(super) next_command: Option<f64>,
    pub(super) alive: Option<f64>,
    pub(super) period: Option<f64>,
    pub(super) load_pressure: Option<f64>,
}

/// A signal by its name in the interface, with the input field of its samples.
type Column<'a, 'py> = (&'a str, Option<&'a Bound<'py, PyAny>>, fn(&mut Input<f64>) -> &mut f64);

const VELOCITY_SOURCE: &str = "controller.velocity_source";

/// Refuses a missing argument that a key of the rig requires.
fn needed(on: bool, name: &str, key: &str, given: bool) -> PyResult<()> {
    if on && !given { Err(refuse(name, "None", format!("must be given: `{key}` is on"))) } else { Ok(()) }
}

impl Channel {
    pub(super) fn new(
        rig: &Rig,
        dtype: &str,
        sample_rate: Option<f64>,
        realization: Realization,
    ) -> PyResult<Self> {
        let rate = sample_rate.unwrap_or(rig.config.controller.sample_rate);
        let dtype = Dtype::parse(dtype)?;
        // The delay is between compensation and servovalve controller, which are one step here.
        let delay = rig.config.compensation.computation_delay;
        if realization == Realization::Digital && delay > 0 {
            let allowed = "must be 0 for eft.Controller; step eft.Compensator and delay what it returns";
            return Err(refuse("compensation.computation_delay", delay, allowed));
        }
        let parameters = Parameters { realization, ..parameters(&rig.config, rate).map_err(to_python)? };
        let saved = rig.config.calibration.only().map_err(to_python)?;
        let core = match dtype {
            Dtype::F32 => Precision::F32(Core::new(&parameters, saved).map_err(to_python)?),
            Dtype::F64 => Precision::F64(Core::new(&parameters, saved).map_err(to_python)?),
        };
        let last = each!(&core, core => core.before());
        Ok(Self { core, rig: rig.config.clone(), dtype, sample_rate: rate, realization, last })
    }

    /// Rig, scheme, precision and sample rate in one line.
    pub(super) fn shown(&self) -> String {
        let own = if self.rig.compensation.adaptive { "self-calibrating " } else { "" };
        format!(
            "{}: {own}{} compensation, {} at {} Hz",
            name(&self.rig),
            word(&self.rig, "compensation.mode"),
            self.dtype.name(),
            self.sample_rate
        )
    }

    /// The arguments for a new object in `pickle`, which can only restore an object at rest.
    pub(super) fn arguments(&self) -> PyResult<(Rig, &'static str, f64)> {
        if !each!(&self.core, core => core.is_at_rest()) {
            let allowed = "must be at rest to be pickled or copied: call reset() first";
            return Err(refuse("state", "in the middle of a test", allowed));
        }
        Ok((Rig { config: self.rig.clone() }, self.dtype.name(), self.sample_rate))
    }

    /// Refuses a missing command if the compensation needs it.
    pub(super) fn needs_command(&self, given: bool) -> PyResult<()> {
        let c = &self.rig.compensation;
        for (on, key) in [
            (c.feedforward, "compensation.feedforward"),
            (c.adaptive, "compensation.adaptive"),
            (c.guard, "compensation.guard"),
            (self.rig.protection.enabled, "protection.enabled"),
        ] {
            needed(on, "command", key, given)?;
        }
        Ok(())
    }

    /// Refuses missing signals that the rig needs; `given` has the order of [`Further`].
    fn required(&self, given: [bool; 4]) -> PyResult<()> {
        let (c, p) = (&self.rig.compensation, &self.rig.protection);
        let [supply_pressure, valve_command, displacement, acceleration] = given;
        let compensates = self.realization == Realization::Analog;
        needed(c.supply_correction, "supply_pressure", "compensation.supply_correction", supply_pressure)?;
        needed(c.adaptive && compensates, "valve_command", "compensation.adaptive", valve_command)?;
        self.needs_motion(displacement, acceleration)?;
        let limited = p.displacement_warning.or(p.displacement_trip).is_some();
        needed(p.enabled && limited, "displacement", "protection.enabled", displacement)
    }

    /// Refuses missing signals for an estimate of the velocity.
    fn needs_motion(&self, displacement: bool, acceleration: bool) -> PyResult<()> {
        let source = self.rig.controller.velocity_source;
        needed(self.estimates(), "displacement", VELOCITY_SOURCE, displacement)?;
        needed(source == VelocitySource::Accelerometer, "acceleration", VELOCITY_SOURCE, acceleration)
    }

    /// Whether the velocity is estimated from the displacement.
    fn estimates(&self) -> bool {
        self.rig.controller.velocity_source != VelocitySource::Sensor
    }

    fn looks_ahead(&self) -> bool {
        self.rig.compensation.feedforward && self.rig.compensation.look_ahead
    }

    /// A sample of a rig at rest.
    fn rest(&self) -> Input<f64> {
        Input {
            command: 0.0,
            next_command: 0.0,
            velocity: 0.0,
            force: 0.0,
            spool: 0.0,
            displacement: 0.0,
            valve_command: 0.0,
            supply_pressure: self.rig.supply.pressure,
            acceleration: 0.0,
            ..Input::default()
        }
    }

    /// The complete sample of a call.
    fn sample(&self, values: [f64; 4], further: Further) -> PyResult<Input<f64>> {
        let signals =
            [further.supply_pressure, further.valve_command, further.displacement, further.acceleration];
        self.required(signals.map(|signal| signal.is_some()))?;
        if self.looks_ahead() && further.next_command.is_none() {
            return Err(refuse("next_command", "None", "must be given: `compensation.look_ahead` is on"));
        }
        let [command, velocity, force, spool] = values;
        Ok(Input {
            command,
            next_command: further.next_command.unwrap_or(command),
            velocity,
            force,
            spool,
            displacement: further.displacement.unwrap_or(0.0),
            valve_command: further.valve_command.unwrap_or(f64::NAN),
            supply_pressure: further.supply_pressure.unwrap_or(self.rig.supply.pressure),
            acceleration: further.acceleration.unwrap_or(0.0),
            alive: further.alive.unwrap_or(f64::NAN),
            period: further.period.unwrap_or(f64::NAN),
            load_pressure: further.load_pressure.unwrap_or(f64::NAN),
        })
    }

    /// One sample; `values` are command, velocity, force and spool.
    pub(super) fn step(&mut self, values: [f64; 4], further: Further) -> PyResult<f64> {
        let sample = self.sample(values, further)?;
        self.last = each!(&mut self.core, core => core.step(&sample));
        Ok(self.last.voltage)
    }

    pub(super) fn hold(&mut self) -> f64 {
        let Output { voltage, status, .. } = each!(&self.core, core => core.hold());
        self.last = Output { voltage, status, ..self.last };
        voltage
    }

    /// `values` are command, velocity, force and spool of the operating point.
    pub(super) fn prime(
        &mut self,
        values: [f64; 4],
        supply_pressure: Option<f64>,
        [displacement, acceleration]: [Option<f64>; 2],
    ) -> PyResult<()> {
        let [command, velocity, force, spool] = values;
        self.needs_motion(displacement.is_some(), acceleration.is_some())?;
        if self.estimates() && velocity != 0.0 {
            let allowed = format!("must be 0: by `{VELOCITY_SOURCE}` it is that of a displacement at rest");
            return Err(refuse("velocity", velocity, allowed));
        }
        let rest = self.rest();
        let supply_pressure = supply_pressure.unwrap_or(rest.supply_pressure);
        let (displacement, acceleration) = (displacement.unwrap_or(0.0), acceleration.unwrap_or(0.0));
        let sample =
            Input { command, velocity, force, spool, supply_pressure, displacement, acceleration, ..rest };
        each!(&mut self.core, core => core.prime(&sample));
        Ok(())
    }

    pub(super) fn reset(&mut self) {
        each!(&mut self.core, core => core.reset());
        self.last = each!(&self.core, core => core.before());
    }

    pub(super) fn end(&mut self) {
        each!(&mut self.core, core => core.end());
    }

    pub(super) fn last(&self) -> &Output<f64> {
        &self.last
    }

    /// The estimate of this trace; the configured value of a rig that does not learn.
    pub(super) fn estimate(&self, trace: &str) -> f64 {
        let estimates = each!(&self.core, core => core.estimates(&self.rig));
        estimates.iter().find(|(name, _)| *name == trace).map_or(f64::NAN, |(_, value)| *value)
    }

    /// Learned no-load flows (m³/s) of the valve at the openings of the rig's flow table.
    pub(super) fn found_flows<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let found = self.rig.found_flows(|openings| each!(&self.core, core => core.found_flows(openings)));
        PyArray1::from_vec(py, found.unwrap_or_else(|| self.rig.servovalve.flow_table.flows.clone()))
    }

    /// Processes samples in sequence and collects their flags. The default of the next commands is the
    /// command itself, with the last one held.
    pub(super) fn process<'py>(
        &mut self,
        py: Python<'py>,
        [command, velocity, force, spool]: [Option<&Bound<'py, PyAny>>; 4],
        [
            supply_pressure,
            valve_command,
            displacement,
            acceleration,
            next_command,
            alive,
            period,
            load_pressure,
        ]: [Option<&Bound<'py, PyAny>>; 8],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.required([supply_pressure, valve_command, displacement, acceleration].map(|v| v.is_some()))?;
        let columns: [Column<'_, 'py>; 12] = [
            ("velocity", velocity, |s| &mut s.velocity),
            ("force", force, |s| &mut s.force),
            ("spool", spool, |s| &mut s.spool),
            ("command", command, |s| &mut s.command),
            ("supply_pressure", supply_pressure, |s| &mut s.supply_pressure),
            ("valve_command", valve_command, |s| &mut s.valve_command),
            ("displacement", displacement, |s| &mut s.displacement),
            ("acceleration", acceleration, |s| &mut s.acceleration),
            ("next_command", next_command, |s| &mut s.next_command),
            ("alive", alive, |s| &mut s.alive),
            ("period", period, |s| &mut s.period),
            ("load_pressure", load_pressure, |s| &mut s.load_pressure),
        ];
        let rest = self.rest();
        let mut samples: Option<(&str, Vec<Input<f64>>)> = None;
        for (name, given, place) in columns {
            let Some(given) = given else { continue };
            let values = arrays::vector(name, given)?;
            let (first, samples) = samples.get_or_insert_with(|| (name, vec![rest; values.len()]));
            if values.len() != samples.len() {
                let allowed = format!("must have as many samples as {first}, {}", samples.len());
                return Err(refuse(name, format!("{} samples", values.len()), allowed));
            }
            for (sample, value) in samples.iter_mut().zip(values) {
                *place(sample) = value;
            }
        }
        let mut samples = samples.map(|(_, samples)| samples).unwrap_or_default();
        if next_command.is_none() {
            let mut next = samples.last().map_or(0.0, |s| s.command);
            for sample in samples.iter_mut().rev() {
                sample.next_command = next;
                next = sample.command;
            }
        }
        let mut last = each!(&self.core, core => core.before());
        let core = &mut self.core;
        let values = py.detach(|| {
            let mut step = |sample: &Input<f64>| {
                let output = each!(&mut *core, core => core.step(sample));
                last = Output { status: last.status | output.status, ..output };
                output.voltage
            };
            samples.iter().map(&mut step).collect::<Vec<_>>()
        });
        self.last = last;
        Ok(PyArray1::from_vec(py, values))
    }
}
