//! The velocity estimate of a rig's controller, and its delay.

use nalgebra::Complex;

use super::{RigConfig, VelocitySource};
use crate::Result;
use crate::design::{ObserverNoises, VelocityEstimate, observer_gains};

/// Band (Hz) for the delay of an estimate.
const BAND: (f64, f64) = (0.5, 10.0);

impl RigConfig {
    /// The steady-state gains of the velocity observer at a sample rate (Hz), on displacement (1), velocity (1/s) and
    /// drift (1/s²).
    ///
    /// # Errors
    /// An invalid sample rate, or noises of so different size that the observer's equation has no numerical
    /// solution.
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

    /// The velocity estimate of the controller; `None` if a sensor measures the velocity.
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

    /// The delay (s), from 0.5 to 10 Hz, of the controller's velocity estimate, as far as the controller
    /// knows it. This is the delay of its own filters. It is 0 if a sensor measures the velocity.
    ///
    /// An observer with a measured acceleration has only the delay of its sampling, less than a microsecond
    /// at 4096 Hz. An observer with force over mass has the same delay for a free mass. The effect of spring
    /// and damper depends on the specimen, which the controller does not know; it is in the delay budget
    /// only.
    ///
    /// # Errors
    /// As [`observer_gains`](Self::observer_gains).
    pub fn velocity_delay(&self, sample_rate: f64) -> Result<f64> {
        let Some(estimate) = self.velocity_estimate(sample_rate)? else { return Ok(0.0) };
        // A lead network cannot compensate for a lead.
        Ok(estimate.delay(sample_rate, BAND, |_| [Complex::ONE; 2])?.max(0.0))
    }

    /// The delay (s) for which the lead network compensates before anything is learned. A learning controller adds
    /// that of its own estimate of the velocity.
    ///
    /// # Errors
    /// As [`observer_gains`](Self::observer_gains).
    pub(crate) fn first_lead(&self, sample_rate: f64) -> Result<f64> {
        let own = if self.compensation.adaptive { self.velocity_delay(sample_rate)? } else { 0.0 };
        Ok(self.compensation.lead_delay() + own)
    }
}
