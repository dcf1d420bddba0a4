//! The velocity that a sampled controller uses, of a sensor or estimated, as part of a larger linear state.

use nalgebra::{DMatrix, DMatrixView};

use super::chain::{Chain, Signal};
use super::disturbance::Disturbance;
use super::plant::LinearPlant;
use crate::Result;
use crate::config::{RigConfig, Sensor, VelocitySource};
use crate::design::EstimateStates;

/// The velocity's sensor, or the sensors and states of its estimate.
#[derive(Debug, Clone)]
pub(super) enum VelocitySignal {
    Sensor(Sensed),
    Estimate {
        displacement: Sensed,
        acceleration: Acceleration,
        states: EstimateStates,
        /// Index of the first state.
        at: usize,
    },
}

/// A sensor with its gain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensed {
    gain: f64,
    chain: Chain,
}

/// Source of an estimate's acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) enum Acceleration {
    Sensor(Sensed),
    /// The measured force over this mass (kg).
    Force(f64),
}

impl Sensed {
    fn new(at: usize, sensor: &Sensor, sample_rate: f64) -> Self {
        Self {
            gain: sensor.gain,
            chain: Chain::new(at, sensor.bandwidth, sensor.delay as usize, sample_rate),
        }
    }

    fn pass(&self, state: &DMatrix<f64>, next: &mut DMatrix<f64>, signal: Signal) -> Signal {
        self.chain.pass(state, next, signal * self.gain)
    }
}

impl VelocitySignal {
    /// The signal of a rig's controller, whose states begin at `at`, at a sample rate (Hz).
    ///
    /// # Errors
    /// As [`RigConfig::observer_gains`].
    pub(super) fn new(rig: &RigConfig, at: usize, sample_rate: f64) -> Result<Self> {
        let sensors = &rig.plant().sensors;
        let Some(estimate) = rig.velocity_estimate(sample_rate)? else {
            return Ok(Self::Sensor(Sensed::new(at, &sensors.velocity, sample_rate)));
        };
        let displacement = Sensed::new(at, &sensors.displacement, sample_rate);
        let end = displacement.chain.end();
        let (acceleration, at) = if rig.controller.velocity_source == VelocitySource::Accelerometer {
            let sensor = Sensed::new(end, &sensors.acceleration, sample_rate);
            (Acceleration::Sensor(sensor), sensor.chain.end())
        } else {
            (Acceleration::Force(rig.controller.observer_mass.unwrap_or(rig.structure.mass)), end)
        };
        Ok(Self::Estimate { displacement, acceleration, states: estimate.states(sample_rate), at })
    }

    /// The index after its last state.
    pub(super) fn end(&self) -> usize {
        match self {
            Self::Sensor(sensor) => sensor.chain.end(),
            Self::Estimate { states, at, .. } => at + states.a.nrows(),
        }
    }

    /// Names for its states.
    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Self::Sensor(sensor) => sensor.chain.names("velocity"),
            Self::Estimate { displacement, acceleration, states, .. } => {
                let mut names = displacement.chain.names("displacement");
                if let Acceleration::Sensor(sensor) = acceleration {
                    names.extend(sensor.chain.names("acceleration"));
                }
                names.extend((1..=states.a.nrows()).map(|number| format!("estimate_{number}")));
                names
            }
        }
    }

    /// The velocity (m/s) of an actuator at a tick, with the measured force (N) and a row for each [`Disturbance`]; the
    /// new states are written to `next`.
    pub(super) fn pass(
        &self,
        plant: &LinearPlant,
        actuator: usize,
        state: &DMatrix<f64>,
        next: &mut DMatrix<f64>,
        force: &Signal,
        noise: &DMatrixView<'_, f64>,
    ) -> Signal {
        let true_states = state.rows(0, plant.states());
        match self {
            Self::Sensor(sensor) => {
                sensor.pass(state, next, plant.velocity(actuator) * true_states)
                    + noise.row(Disturbance::Velocity as usize)
            }
            Self::Estimate { displacement, acceleration, states, at } => {
                let moved = displacement.pass(state, next, plant.displacement(actuator) * true_states)
                    + noise.row(Disturbance::Displacement as usize);
                let accelerated = match acceleration {
                    Acceleration::Sensor(sensor) => {
                        sensor.pass(state, next, plant.acceleration(actuator) * true_states)
                            + noise.row(Disturbance::Acceleration as usize)
                    }
                    Acceleration::Force(mass) => force / *mass,
                };
                let own = state.rows(*at, states.a.nrows());
                let after = &states.a * own + states.b.column(0) * moved + states.b.column(1) * accelerated;
                next.rows_mut(*at, states.a.nrows()).copy_from(&after);
                after.row(EstimateStates::VELOCITY).into_owned()
            }
        }
    }
}
