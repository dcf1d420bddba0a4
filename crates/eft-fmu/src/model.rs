//! The model inside an FMU: the virtual rig, or its controller.

use eft_core::{Input, Output, status};
use eft_sim::closed_loop::{Precision, RigChannel, RigChannelState, RigReading, VirtualRig, parameters};
use eft_sim::{Error, Result, RigConfig};
use serde::{Deserialize, Serialize};

use crate::variables::{Signal, Signals, Type};

/// The part of the closed loop in an FMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Valve, actuator, structure, supply, sensors and converter.
    Rig,
    /// The digital controller with its learner and its protection.
    Controller,
}

use Type::{Boolean, Integer, Real};

const TRIPPED: Signal = ("tripped", "", Boolean, "Whether the controller's protection has tripped");

/// Whether the controller computes in single precision; it comes last in the table.
pub(crate) const SINGLE_PRECISION: Signal = (
    "single_precision",
    "",
    Boolean,
    "Whether the controller computes in single precision, as on a microcontroller",
);

type Told<T> = (Signal, fn(&T) -> f64);

const READINGS: &[Told<RigReading>] = &[
    (("force", "N", Real, "Force on the structure"), |r| r.truth.force),
    (("displacement", "m", Real, "Displacement"), |r| r.truth.displacement),
    (("velocity", "m/s", Real, "Velocity"), |r| r.truth.velocity),
    (("acceleration", "m/s²", Real, "Acceleration"), |r| r.truth.acceleration),
    (("spool", "", Real, "Spool opening"), |r| r.truth.spool),
    (("load_pressure", "Pa", Real, "Load pressure"), |r| r.truth.load_pressure),
    (("supply_pressure", "Pa", Real, "Supply pressure"), |r| r.truth.supply_pressure),
    (("measured_force", "N", Real, "Force as the load cell reports it; NaN where a sample is lost"), |r| {
        r.measured.force
    }),
    (("measured_displacement", "m", Real, "Displacement as its sensor reports it"), |r| {
        r.measured.displacement
    }),
    (("measured_velocity", "m/s", Real, "Velocity as its sensor reports it"), |r| r.measured.velocity),
    (("measured_acceleration", "m/s²", Real, "Acceleration as the accelerometer reports it"), |r| {
        r.measured.acceleration
    }),
    (("measured_spool", "", Real, "Spool opening as its sensor reports it"), |r| r.measured.spool),
    (("measured_supply_pressure", "Pa", Real, "Supply pressure as its sensor reports it"), |r| {
        r.measured.supply_pressure
    }),
    (
        (
            "status",
            "",
            Integer,
            "Bits of the rig's status: spool at a stop, stroke exceeded, converter's range exceeded",
        ),
        |r| f64::from(r.truth.status),
    ),
];

const ANSWERS: &[Told<Output<f64>>] = &[
    (("valve_command", "V", Real, "Valve command"), |o| o.voltage),
    (("compensation", "V", Real, "Compensation signal"), |o| o.compensation),
    (("used_velocity", "m/s", Real, "Velocity that the controller uses, measured or estimated"), |o| {
        o.velocity
    }),
    (("permitted_command", "N", Real, "Force command that the protection permits"), |o| o.permitted_command),
    (("authority", "", Real, "Share of the valve command that the protection permits"), |o| o.authority),
    (("status", "", Integer, "Bits of the controller's status"), |o| f64::from(o.status)),
];

const COMMANDS: &[Signal] = &[
    ("command", "N", Real, "Force command"),
    ("velocity", "m/s", Real, "Measured velocity"),
    ("force", "N", Real, "Measured force"),
    ("spool", "", Real, "Measured spool opening"),
    ("displacement", "m", Real, "Measured displacement, for the protection and an estimate of the velocity"),
    ("acceleration", "m/s²", Real, "Measured acceleration, for an estimate of the velocity"),
    ("supply_pressure", "Pa", Real, "Measured supply pressure, for its correction"),
];

const REQUESTS: &[Signal] = &[
    ("end", "", Boolean, "Asks the protection for the soft end"),
    ("trip", "", Boolean, "Trips the protection"),
];

const VALVE_COMMAND: Signal = ("valve_command", "V", Real, "Valve command, held over the step");

const NEXT_COMMAND: Signal =
    ("next_command", "N", Real, "Force command at the next sample, for the look-ahead");

impl Part {
    /// The part with this name.
    ///
    /// # Errors
    /// The name is neither "rig" nor "controller".
    pub fn named(name: &str) -> Result<Self> {
        let parts = [Self::Rig, Self::Controller];
        let found = parts.into_iter().find(|part| part.name() == name);
        found.ok_or_else(|| Error::value("part", format!("{name:?}"), "must be \"rig\" or \"controller\""))
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rig => "rig",
            Self::Controller => "controller",
        }
    }

    /// Inputs per actuator, and common inputs.
    pub(crate) fn inputs(self, rig: &RigConfig) -> Signals {
        let looks_ahead = rig.compensation.feedforward && rig.compensation.look_ahead;
        match self {
            Self::Rig => Signals { each: vec![VALVE_COMMAND], all: vec![TRIPPED] },
            Self::Controller => {
                let each = COMMANDS.iter().copied().chain(looks_ahead.then_some(NEXT_COMMAND)).collect();
                Signals { each, all: REQUESTS.to_vec() }
            }
        }
    }

    /// Outputs per actuator, and common outputs.
    pub(crate) fn outputs(self) -> Signals {
        match self {
            Self::Rig => {
                Signals { each: READINGS.iter().map(|(signal, _)| *signal).collect(), all: Vec::new() }
            }
            Self::Controller => {
                let learned = eft_sim::closed_loop::TRACES.iter().filter(|trace| trace.is_learned());
                let estimates = learned.map(|trace| (trace.name, trace.unit, Real, trace.doc));
                let each = ANSWERS.iter().map(|(signal, _)| *signal).chain(estimates).collect();
                Signals { each, all: vec![TRIPPED] }
            }
        }
    }
}

/// The controllers of all actuators, and the results of their last ticks.
pub(crate) struct ControllerModel<P: Precision> {
    actuators: Vec<(RigChannel<P>, Output<f64>)>,
    rig: RigConfig,
    tripped: bool,
}

impl<P: Precision> ControllerModel<P> {
    fn new(rig: &RigConfig) -> Result<Self> {
        let parameters = parameters(rig, rig.controller.sample_rate)?;
        let one = |_| {
            let channel = RigChannel::new(&parameters, rig.calibration.only()?)?;
            let before = channel.before();
            Ok((channel, before))
        };
        let actuators = (0..rig.structure.floors()).map(one).collect::<Result<_>>()?;
        Ok(Self { actuators, rig: rig.clone(), tripped: false })
    }

    fn step(&mut self, inputs: &[f64]) {
        let (each, requests) = inputs.split_at(inputs.len().saturating_sub(REQUESTS.len()));
        let asked = |i: usize| requests.get(i).is_some_and(|request| *request != 0.0);
        // When one actuator trips, all others trip at the next sample.
        let trips = asked(1) || self.tripped && self.actuators.len() > 1;
        let inputs = each.chunks_exact((each.len() / self.actuators.len().max(1)).max(1));
        for ((channel, last), inputs) in self.actuators.iter_mut().zip(inputs) {
            let value = |i: usize| inputs.get(i).copied().unwrap_or(0.0);
            if asked(0) {
                channel.end();
            }
            if trips {
                channel.trip();
            }
            *last = channel.step(&Input {
                command: value(0),
                next_command: inputs.get(COMMANDS.len()).copied().unwrap_or(value(0)),
                velocity: value(1),
                force: value(2),
                spool: value(3),
                displacement: value(4),
                acceleration: value(5),
                supply_pressure: value(6),
                valve_command: 0.0,
                ..Input::default()
            });
            self.tripped |= last.status & status::TRIPPED != 0;
        }
    }

    fn outputs(&self) -> Vec<f64> {
        let mut outputs = Vec::new();
        for (channel, last) in &self.actuators {
            outputs.extend(ANSWERS.iter().map(|(_, of)| of(last)));
            outputs.extend(channel.estimates(&self.rig).into_iter().map(|(_, value)| value));
        }
        outputs.push(f64::from(u8::from(self.tripped)));
        outputs
    }

    fn state(&self) -> ControllerState<P> {
        let one = |(channel, last): &(RigChannel<P>, Output<f64>)| {
            let Output { voltage, compensation, velocity, permitted_command, authority, status, .. } = *last;
            let last = [voltage, compensation, velocity, permitted_command, authority];
            ActuatorState { channel: channel.state(), last, status }
        };
        ControllerState { actuators: self.actuators.iter().map(one).collect(), tripped: self.tripped }
    }

    fn go_to(&mut self, state: &ControllerState<P>) -> Result<()> {
        if state.actuators.len() != self.actuators.len() {
            let found = format!("of {} actuators", state.actuators.len());
            return Err(Error::value("state", found, format!("must be of {}", self.actuators.len())));
        }
        for ((channel, last), ActuatorState { channel: kept, last: said, status }) in
            self.actuators.iter_mut().zip(&state.actuators)
        {
            channel.go_to(kept)?;
            let [voltage, compensation, velocity, permitted_command, authority] = *said;
            let status = *status;
            *last = Output {
                voltage,
                compensation,
                velocity,
                permitted_command,
                authority,
                status,
                window: None,
            };
        }
        self.tripped = state.tripped;
        Ok(())
    }
}

/// The state of the controllers.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct ControllerState<P: Precision> {
    actuators: Vec<ActuatorState<P>>,
    tripped: bool,
}

/// The state of an actuator's controller, and the numbers of its last output.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
struct ActuatorState<P: Precision> {
    channel: RigChannelState<P>,
    last: [f64; 5],
    status: u32,
}

/// The running model.
pub(crate) enum Model {
    Rig(Box<VirtualRig>),
    Single(Box<ControllerModel<f32>>),
    Double(Box<ControllerModel<f64>>),
}

/// The state of a model.
#[derive(Serialize, Deserialize)]
pub(crate) enum State {
    Rig(Vec<f64>),
    Single(Box<ControllerState<f32>>),
    Double(Box<ControllerState<f64>>),
}

impl Model {
    /// At rest.
    ///
    /// # Errors
    /// A rig that cannot be run.
    pub(crate) fn new(part: Part, rig: &RigConfig, single_precision: bool) -> Result<Self> {
        Ok(match (part, single_precision) {
            (Part::Rig, _) => Self::Rig(Box::new(VirtualRig::new(rig)?)),
            (Part::Controller, true) => Self::Single(Box::new(ControllerModel::new(rig)?)),
            (Part::Controller, false) => Self::Double(Box::new(ControllerModel::new(rig)?)),
        })
    }

    /// One sample.
    ///
    /// # Errors
    /// A valve command that is not finite; a rig that diverges.
    pub(crate) fn step(&mut self, inputs: &[f64]) -> Result<()> {
        match self {
            Self::Rig(rig) => {
                let (tripped, valve_commands) = inputs.split_last().unwrap_or((&0.0, &[]));
                rig.step(valve_commands, *tripped != 0.0)?;
            }
            Self::Single(controller) => controller.step(inputs),
            Self::Double(controller) => controller.step(inputs),
        }
        Ok(())
    }

    /// The outputs in the table's order.
    pub(crate) fn outputs(&self) -> Vec<f64> {
        match self {
            Self::Rig(rig) => {
                let of = |reading| READINGS.iter().map(move |(_, of)| of(&reading));
                rig.readings().flat_map(of).collect()
            }
            Self::Single(controller) => controller.outputs(),
            Self::Double(controller) => controller.outputs(),
        }
    }

    pub(crate) fn state(&self) -> State {
        match self {
            Self::Rig(rig) => State::Rig(rig.state()),
            Self::Single(controller) => State::Single(Box::new(controller.state())),
            Self::Double(controller) => State::Double(Box::new(controller.state())),
        }
    }

    /// Restores the state of a model of the same rig.
    ///
    /// # Errors
    /// A state of another model.
    pub(crate) fn go_to(&mut self, state: &State) -> Result<()> {
        match (self, state) {
            (Self::Rig(rig), State::Rig(state)) => rig.go_to(state),
            (Self::Single(controller), State::Single(state)) => controller.go_to(state),
            (Self::Double(controller), State::Double(state)) => controller.go_to(state),
            _ => Err(Error::value(
                "state",
                "another model's",
                "must be of an FMU of the same part and precision",
            )),
        }
    }
}
