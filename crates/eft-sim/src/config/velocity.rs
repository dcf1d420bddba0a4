//! How a rig's controller makes the velocity of the displacement, and what that delays.

use nalgebra::Complex;

use super::{RigConfig, VelocitySource};
use crate::design::{ObserverNoises, VelocityEstimate, observer_gains};
use crate::error::Result;

/// Band (Hz) over which the delay of an estimate is taken.
const BAND: (f64, f64) = (0.5, 10.0);

impl RigConfig {
    /// The steady-state gains of the velocity observer at a sample rate (Hz), on displacement (1), velocity (1/s) and
    /// drift (1/s²).
    ///
    /// # Errors
    /// An invalid sample rate; noises so unlike that the observer's equation is not solved.
    pub fn observer_gains(&self, sample_rate: f64) -> Result<[f64; 3]> {
        let c = &self.controller;
        let (drift_key, drift) = match c.velocity_source {
            VelocitySource::Accelerometer => ("controller.accelerometer_drift", c.accelerometer_drift),
            _ => ("controller.observer_drift", c.observer_drift),
        };
        let noises = ObserverNoises {
            displacement: c.observer_displacement_noise,
            acceleration: c.observer_acceleration_noise,
            drift,
            drift_key,
        };
        observer_gains(&noises, sample_rate)
    }

    /// How the controller makes the velocity of the displacement; none where a sensor measures it.
    ///
    /// # Errors
    /// As [`observer_gains`](Self::observer_gains).
    pub(crate) fn velocity_estimate(&self, sample_rate: f64) -> Result<Option<VelocityEstimate>> {
        Ok(match self.controller.velocity_source {
            VelocitySource::Sensor => None,
            VelocitySource::Derivative => {
                Some(VelocityEstimate::Derivative { corner: self.controller.velocity_corner })
            }
            VelocitySource::Observer | VelocitySource::Accelerometer => {
                Some(VelocityEstimate::Observer(self.observer_gains(sample_rate)?))
            }
        })
    }

    /// The delay (s), from 0.5 to 10 Hz, of the velocity that a controller makes of the displacement, as it can know it:
    /// that of its own filters; 0 where a sensor measures the velocity.
    ///
    /// An observer that is given the acceleration is late by no more than its sampling, less than a microsecond at
    /// 4096 Hz. Given the force over a mass, it is so for a free mass; what spring and damper add is the specimen's,
    /// which the controller does not know, and stands in the delay budget alone.
    ///
    /// # Errors
    /// As [`observer_gains`](Self::observer_gains).
    pub fn velocity_delay(&self, sample_rate: f64) -> Result<f64> {
        let Some(estimate) = self.velocity_estimate(sample_rate)? else { return Ok(0.0) };
        // A lead network takes no lead back.
        Ok(estimate.delay(sample_rate, BAND, |_| [Complex::ONE; 2])?.max(0.0))
    }
}
