//! The velocity that a rig's controller makes of the displacement, where it has no sensor of its own.

use eft_core::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};

use crate::closed_loop::controller::Precision;
use crate::config::{RigConfig, VelocitySource};
use crate::error::Result;

/// One over the mass that the force moves (1/kg), as the observer knows it; none where it takes an accelerometer's reading.
pub(crate) fn observer_per_mass(rig: &RigConfig) -> Option<f64> {
    let by_force = rig.controller.velocity_source == VelocitySource::Observer;
    by_force.then(|| 1.0 / rig.controller.observer_mass.unwrap_or(rig.structure.mass))
}

/// An estimate in the controller's precision, and what it remembers.
#[derive(Debug, Clone)]
pub(crate) enum VelocityEstimate<P> {
    Derivative(FilteredDerivative<P>, FilteredDerivativeState<P>),
    Observer {
        core: VelocityObserver<P>,
        state: VelocityObserverState<P>,
        /// What makes the acceleration of the force; none where it is measured.
        per_mass: Option<P>,
    },
}

impl<P: Precision> VelocityEstimate<P> {
    /// That of a rig at a sample rate (Hz), at rest; none where a sensor measures the velocity.
    ///
    /// # Errors
    /// What `eft-core` refuses, and an observer whose gains cannot be found.
    pub(crate) fn new(rig: &RigConfig, sample_rate: f64) -> Result<Option<Self>> {
        Ok(match rig.controller.velocity_source {
            VelocitySource::Sensor => None,
            VelocitySource::Derivative => {
                Some(Self::Derivative(P::derivative(rig, sample_rate)?, FilteredDerivativeState::default()))
            }
            VelocitySource::Observer | VelocitySource::Accelerometer => Some(Self::Observer {
                core: P::observer(rig, sample_rate)?,
                state: VelocityObserverState::default(),
                per_mass: observer_per_mass(rig).map(P::from_f64),
            }),
        })
    }

    /// One sample: velocity (m/s) for displacement (m), force (N) and acceleration (m/s²).
    pub(crate) fn velocity(&mut self, displacement: f64, force: f64, acceleration: f64) -> f64 {
        let displacement = P::from_f64(displacement);
        match self {
            Self::Derivative(core, state) => core.step(state, displacement).to_f64(),
            Self::Observer { core, state, per_mass } => {
                core.step(state, displacement, input(*per_mass, force, acceleration)).to_f64()
            }
        }
    }

    /// Long at rest at this displacement (m), under this force (N), with this acceleration (m/s²) read.
    pub(crate) fn rest(&mut self, displacement: f64, force: f64, acceleration: f64) {
        let displacement = P::from_f64(displacement);
        match self {
            Self::Derivative(core, state) => *state = core.at_rest(displacement),
            Self::Observer { core, state, per_mass } => {
                *state = core.at_rest(displacement, input(*per_mass, force, acceleration));
            }
        }
    }

    /// Whether nothing has been taken in since the start.
    pub(crate) fn is_at_rest(&self) -> bool {
        match self {
            Self::Derivative(_, state) => *state == FilteredDerivativeState::default(),
            Self::Observer { state, .. } => *state == VelocityObserverState::default(),
        }
    }
}

/// What an observer takes for the acceleration (m/s²).
fn input<P: Precision>(per_mass: Option<P>, force: f64, acceleration: f64) -> P {
    per_mass.map_or_else(|| P::from_f64(acceleration), |per_mass| P::from_f64(force) * per_mass)
}
