//! The velocity that a rig's controller makes of the displacement, where it has no sensor of its own.

use eft_core::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};

use crate::closed_loop::controller::Precision;
use crate::config::{RigConfig, VelocitySource};
use crate::error::Result;

/// One over the mass that the force moves (1/kg), as the observer knows it.
pub(crate) fn observer_per_mass(rig: &RigConfig) -> f64 {
    1.0 / rig.controller.observer_mass.unwrap_or(rig.structure.mass)
}

/// An estimate in the controller's precision, and what it remembers.
#[derive(Debug, Clone)]
pub(crate) enum VelocityEstimate<P> {
    Derivative(FilteredDerivative<P>, FilteredDerivativeState<P>),
    Observer { core: VelocityObserver<P>, state: VelocityObserverState<P>, per_mass: P },
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
            VelocitySource::Observer => Some(Self::Observer {
                core: P::observer(rig, sample_rate)?,
                state: VelocityObserverState::default(),
                per_mass: P::from_f64(observer_per_mass(rig)),
            }),
        })
    }

    /// One sample: velocity (m/s) for displacement (m) and force (N).
    pub(crate) fn velocity(&mut self, displacement: f64, force: f64) -> f64 {
        let (displacement, force) = (P::from_f64(displacement), P::from_f64(force));
        match self {
            Self::Derivative(core, state) => core.step(state, displacement).to_f64(),
            Self::Observer { core, state, per_mass } => {
                core.step(state, displacement, force * *per_mass).to_f64()
            }
        }
    }

    /// Long at rest at this displacement (m) and force (N).
    pub(crate) fn rest(&mut self, displacement: f64, force: f64) {
        let (displacement, force) = (P::from_f64(displacement), P::from_f64(force));
        match self {
            Self::Derivative(core, state) => *state = core.at_rest(displacement),
            Self::Observer { core, state, per_mass } => {
                *state = core.at_rest(displacement, force * *per_mass);
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
