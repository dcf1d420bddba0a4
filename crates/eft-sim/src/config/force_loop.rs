//! The force loop that is designed from a rig, in place of the gains that stand in its configuration.

use std::borrow::Cow;

use super::{GivenForceLoop, Realization, RigConfig, RigValues};
use crate::design::{self, HeldPiston};
use crate::error::Result;

impl RigConfig {
    /// The force loop designed from what the controller believes of this rig, at a sample rate (Hz), whether it is in
    /// use or not.
    ///
    /// # Errors
    /// A flow curve without a slope at the origin; a rig for which no robust gains exist.
    pub fn designed_force_loop(&self, sample_rate: f64) -> Result<design::ForceLoop> {
        let (valve, sensor) = (&self.servovalve, &self.sensors.force);
        let (_, steeper) = valve.flow_table.slopes()?;
        design::design(&HeldPiston {
            pilot_time_constant: valve.pilot_time_constant,
            pilot_flow_gain: valve.pilot_flow_gain,
            spool_voltage: valve.spool_sensitivity * valve.spool_stroke,
            spool_volume: valve.spool_area * valve.spool_stroke,
            flow_gain: steeper,
            compressibility: self.actuator.compressibility,
            leakage: self.actuator.leakage + valve.leakage.proportional,
            piston_area: self.actuator.piston_area,
            force_sensitivity: self.controller.force_sensitivity,
            cell_bandwidth: sensor.bandwidth,
            delay: sensor.delay + self.dac.delay,
            sample_rate,
        })
    }

    /// Puts the designed force loop in use, in controller and plant alike: an analog one runs in the plant.
    pub(super) fn design_force_loop(&mut self, sample_rate: f64) -> Result<()> {
        let designed = self.designed_force_loop(sample_rate)?;
        let given = &self.values.controller;
        self.given.get_or_insert(GivenForceLoop {
            proportional_gain: given.proportional_gain,
            derivative_gain: given.derivative_gain,
            realization: given.realization,
        });
        let plant = self.truth.as_mut().map(|truth| &mut truth.plant.values);
        for values in [Some(&mut self.values), plant].into_iter().flatten() {
            values.controller.proportional_gain = designed.proportional_gain;
            values.controller.derivative_gain = designed.derivative_gain;
            values.controller.realization = Realization::Digital;
        }
        Ok(())
    }

    /// This rig with the force loop that is designed for a sample rate (Hz), where one is in use.
    ///
    /// # Errors
    /// As [`designed_force_loop`](Self::designed_force_loop).
    pub(crate) fn at_rate(&self, sample_rate: f64) -> Result<Cow<'_, Self>> {
        if self.given.is_none() || self.controller.sample_rate == sample_rate {
            return Ok(Cow::Borrowed(self));
        }
        let mut rig = self.clone();
        rig.values.controller.sample_rate = sample_rate;
        rig.design_force_loop(sample_rate)?;
        Ok(Cow::Owned(rig))
    }

    /// Values of this rig, perhaps changed, with the force loop as it was given where the designed one still stands.
    pub(super) fn as_given(&self, values: &RigValues) -> RigValues {
        let mut values = values.clone();
        if let Some(given) = &self.given {
            let (controller, designed) = (&mut values.controller, &self.values.controller);
            if controller.proportional_gain == designed.proportional_gain {
                controller.proportional_gain = given.proportional_gain;
            }
            if controller.derivative_gain == designed.derivative_gain {
                controller.derivative_gain = given.derivative_gain;
            }
            if controller.realization == designed.realization {
                controller.realization = given.realization;
            }
        }
        values
    }
}
