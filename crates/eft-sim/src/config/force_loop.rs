//! The designed force loop, which replaces the gains of the configuration.

use std::borrow::Cow;
use std::f64::consts::{FRAC_2_PI, TAU};

use super::{Controller, FlowCurve, ForceLoop, MotionAt, Realization, RigConfig, RigValues};
use crate::design::{self, HeldPiston};
use crate::{Result, checks};

/// Opening (1) of an oscillation about rest. At the oil column of the paper's rig it is 0.4 kN, a quarter of a percent
/// of the stall force.
const OSCILLATION: f64 = 1e-3;

/// A valve about rest, at no load.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AtRest {
    /// Slopes (m³/s per unit opening) of a small oscillation, from both sides. They are equal within a wide underlap.
    pub(crate) shallower: f64,
    pub(crate) steeper: f64,
    /// The steeper slope (m³/s per unit opening) beyond an underlap.
    pub(crate) beyond: f64,
    /// Leakage (m³/(s·Pa)) through the ports that an underlap leaves open.
    pub(crate) leakage: f64,
}

impl Controller {
    fn gains(&self) -> [f64; 3] {
        [self.proportional_gain, self.derivative_gain, self.integral_gain]
    }

    fn gains_mut(&mut self) -> [&mut f64; 3] {
        [&mut self.proportional_gain, &mut self.derivative_gain, &mut self.integral_gain]
    }
}

impl RigConfig {
    /// The force loop designed from the configured rig without its `truth`, at a sample rate (Hz). It need
    /// not be in use.
    ///
    /// # Errors
    /// The sample rate is not allowed, the flow curve has no slope at the origin, or no robust gains exist for
    /// the rig.
    pub fn designed_force_loop(&self, sample_rate: f64) -> Result<design::ForceLoop> {
        checks::sample_rate("sample_rate", sample_rate)?;
        let rest = self.at_rest(&self.servovalve.flow_table)?;
        let piston = self.held_piston(&rest, rest.steeper, self.measured_compressibility());
        design::design(&HeldPiston {
            flow_gain_beyond: (rest.beyond != rest.steeper).then_some(rest.beyond),
            sample_rate,
            latency: self.further_latency(sample_rate),
            ..piston
        })
    }

    /// Valve, oil and load cell of these values with the piston at rest, for a flow gain (m³/s per unit
    /// opening) and a compressibility (m³/Pa).
    pub(crate) fn held_piston(&self, rest: &AtRest, flow_gain: f64, compressibility: f64) -> HeldPiston {
        let (valve, sensor) = (&self.servovalve, &self.sensors.force);
        HeldPiston {
            pilot_time_constant: valve.pilot_time_constant,
            torque_motor: valve.torque_motor_frequency.map(|f| (f, valve.torque_motor_damping)),
            pilot_flow_gain: valve.pilot_flow_gain,
            spool_voltage: valve.spool_sensitivity * valve.spool_stroke,
            spool_volume: valve.spool_area * valve.spool_stroke,
            flow_gain,
            flow_gain_beyond: None,
            compressibility,
            leakage: self.actuator.leakage + valve.leakage.proportional + rest.leakage,
            piston_area: self.actuator.piston_area,
            force_sensitivity: self.controller.force_sensitivity,
            cell_bandwidth: sensor.bandwidth,
            delay: sensor.delay + self.dac.delay,
            latency: 0.0,
            identified: self.controller.identified_plant,
            sample_rate: self.controller.sample_rate,
        }
    }

    /// Known latency (s) of the load cell that its configured delay and bandwidth do not explain.
    fn further_latency(&self, sample_rate: f64) -> f64 {
        let cell = &self.sensors.force;
        let filter = cell.bandwidth.map_or(0.0, |bandwidth| 1.0 / (TAU * bandwidth));
        (self.controller.force_delay - f64::from(cell.delay) / sample_rate - filter).max(0.0)
    }

    /// A flow curve of this rig's valve and piston about rest.
    pub(crate) fn at_rest(&self, curve: &FlowCurve) -> Result<AtRest> {
        let lap = (-self.servovalve.overlap).max(0.0);
        let [pulling, pushing] = self.actuator.flow_factors();
        let [(pulled, slope), (pushed, slope_back)] = curve.around(lap)?;
        let (slope, slope_back) = (pulling * slope, pushing * slope_back);
        // Within an underlap the other side passes its flow as well.
        let both = gain_within_limit(lap, OSCILLATION);
        let (pull, push) = (slope + both * slope_back, slope_back + both * slope);
        // −∂Q_L/∂P_L of the two square roots; that of the pushing side contains the area ratio.
        let ports = pulling * pulled - pushing * pushed / self.actuator.area_ratio;
        let leakage = self.servovalve.flow_gain_scale * ports / (2.0 * self.supply.pressure);
        Ok(AtRest {
            shallower: pull.min(push),
            steeper: pull.max(push),
            beyond: slope.max(slope_back),
            leakage,
        })
    }

    /// Compressibility (m³/Pa) for the measured motion. If the motion is measured at the structure, it
    /// includes the attachment.
    pub(crate) fn measured_compressibility(&self) -> f64 {
        let attached = match self.sensors.motion_at {
            MotionAt::Piston => 0.0,
            MotionAt::Structure => self.actuator.attachment_compressibility(),
        };
        self.actuator.compressibility + attached
    }

    /// Uses the designed force loop in controller and plant, because an analog loop is part of the plant.
    pub(super) fn design_force_loop(&mut self, sample_rate: f64) -> Result<()> {
        let designed = self.designed_force_loop(sample_rate)?;
        let configured = &self.values.controller;
        self.configured_loop.get_or_insert((configured.gains(), configured.realization));
        let gains = [designed.proportional_gain, designed.derivative_gain, designed.integral_gain];
        let plant = self.truth.as_mut().map(|truth| &mut truth.plant.values);
        for values in [Some(&mut self.values), plant].into_iter().flatten() {
            values.controller.gains_mut().into_iter().zip(gains).for_each(|(own, gain)| *own = gain);
            values.controller.realization = Realization::Digital;
        }
        Ok(())
    }

    /// This rig with the force loop designed for a sample rate (Hz), if it uses a designed loop.
    ///
    /// # Errors
    /// As [`designed_force_loop`](Self::designed_force_loop).
    pub(crate) fn at_rate(&self, sample_rate: f64) -> Result<Cow<'_, Self>> {
        if self.configured_loop.is_none() || self.controller.sample_rate == sample_rate {
            return Ok(Cow::Borrowed(self));
        }
        let mut rig = self.clone();
        rig.values.controller.sample_rate = sample_rate;
        rig.design_force_loop(sample_rate)?;
        Ok(Cow::Owned(rig))
    }

    /// This rig with the gains of its loop at a sample rate (Hz) as given ones.
    ///
    /// # Errors
    /// As [`designed_force_loop`](Self::designed_force_loop).
    pub(crate) fn with_fixed_gains(&self, sample_rate: f64) -> Result<Self> {
        let mut rig = self.at_rate(sample_rate)?.into_owned();
        if rig.configured_loop.take().is_some() {
            rig = rig.varied(|values| values.controller.force_loop = ForceLoop::Pd);
        }
        Ok(rig)
    }

    /// Possibly changed values of this rig, in which an unchanged designed loop is replaced by the configured
    /// gains.
    pub(super) fn with_configured_gains(&self, values: &RigValues) -> RigValues {
        let mut values = values.clone();
        if let Some((configured, realization)) = self.configured_loop {
            let (controller, designed) = (&mut values.controller, &self.values.controller);
            let both = designed.gains().into_iter().zip(configured);
            for (own, (designed, configured)) in controller.gains_mut().into_iter().zip(both) {
                *own = if *own == designed { configured } else { *own };
            }
            if controller.realization == designed.realization {
                controller.realization = realization;
            }
        }
        values
    }
}

/// The describing function (1) of the part of a sine with this amplitude that is within a limit.
pub(crate) fn gain_within_limit(limit: f64, amplitude: f64) -> f64 {
    let share = limit / amplitude;
    if share >= 1.0 {
        return 1.0;
    }
    FRAC_2_PI * (libm::asin(share) + share * (1.0 - share * share).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lapped(underlap: f64) -> RigConfig {
        RigConfig::zhao2005().with(|rig| rig.servovalve.overlap = -underlap).unwrap()
    }

    #[test]
    fn the_slope_about_rest_is_the_describing_function_of_an_oscillation() {
        let curve = &RigConfig::zhao2005().servovalve.flow_table;
        let [(_, pulling), (_, pushing)] = curve.around(0.0).unwrap();
        for lap in [0.0, 1e-5, 2e-4, 9e-4, 1e-3, 4e-3] {
            let rest = lapped(lap).at_rest(curve).unwrap();
            // By quadrature of the flow through both ports; the mean of both sides is the gain of a symmetric signal.
            let count = 200_000;
            let sum: f64 = (0..count)
                .map(|i| {
                    let sine = (TAU * (f64::from(i) + 0.5) / f64::from(count)).sin();
                    let x = OSCILLATION * sine;
                    let flow = pulling * (x + lap).max(0.0) + pushing * (x - lap).min(0.0);
                    2.0 * (flow - lap * (pulling - pushing) / 2.0) * sine / f64::from(count)
                })
                .sum();
            let mean = 0.5 * (rest.shallower + rest.steeper);
            assert!((sum / OSCILLATION / mean - 1.0).abs() < 1e-6, "{lap}: {} {mean}", sum / OSCILLATION);
            assert!(rest.shallower <= rest.steeper && (rest.beyond - pulling.max(pushing)).abs() < 1e-15);
        }
    }

    #[test]
    fn the_gains_follow_the_width_of_an_underlap() {
        let gain = |lap| lapped(lap).designed_force_loop(4096.0).unwrap().proportional_gain;
        let none = gain(0.0);
        let shares = [1e-7, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3].map(|lap| gain(lap) / none);
        assert!((shares[0] - 1.0).abs() < 1e-3 && (shares[1] - 1.0).abs() < 0.02, "{shares:?}");
        assert!(shares[..5].windows(2).all(|pair| pair[1] < pair[0]), "{shares:?}");
        // Within a wide lap both ports pass their flow.
        assert!(shares[4..].iter().all(|share| (share - 0.5).abs() < 0.05), "{shares:?}");
    }

    #[test]
    fn the_margins_are_the_smaller_ones_within_an_underlap_and_beyond() {
        let rig = lapped(2e-3);
        let designed = rig.designed_force_loop(4096.0).unwrap();
        let rest = rig.at_rest(&rig.servovalve.flow_table).unwrap();
        let piston = |flow_gain| {
            let plant = rig.held_piston(&rest, flow_gain, rig.measured_compressibility());
            designed.on(&HeldPiston { sample_rate: 4096.0, ..plant }).margins().unwrap()
        };
        let (within, beyond) = (piston(rest.steeper), piston(rest.beyond));
        let margins = designed.margins().unwrap();
        assert_eq!(margins.gain, within.gain);
        assert!(margins.damping == beyond.damping && beyond.damping < 0.8 * within.damping, "{margins:?}");
    }
}
