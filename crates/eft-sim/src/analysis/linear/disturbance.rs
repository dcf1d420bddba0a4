//! Sources of noise and of constant errors in the sampled loop, and their sizes.

use crate::config::{RigConfig, Sensor};

/// Sources of error of one actuator: the sensors of its controller, and the converter of the valve command.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Disturbance {
    Force,
    /// Rounding of the force, which an analog force loop does not see.
    ForceResolution,
    Velocity,
    Displacement,
    Acceleration,
    Converter,
}

impl Disturbance {
    pub(super) const ALL: [Self; 6] = [
        Self::Force,
        Self::ForceResolution,
        Self::Velocity,
        Self::Displacement,
        Self::Acceleration,
        Self::Converter,
    ];
    pub(crate) const COUNT: usize = Self::ALL.len();

    /// Number of an actuator's disturbance among the inputs of a model of some actuators.
    pub(crate) fn input(self, actuator: usize, actuators: usize) -> usize {
        actuators + Self::COUNT * actuator + self as usize
    }

    /// Standard deviation in a rig, in the signal's unit. Rounding to a step counts as noise of `step/√12`.
    pub(super) fn deviation(self, rig: &RigConfig) -> f64 {
        let (sensors, dac) = (&rig.plant().sensors, &rig.plant().dac);
        match self {
            Self::Force => sensors.force.noise,
            Self::ForceResolution => rounding(sensors.force.range, sensors.force.bits),
            Self::Velocity => deviation(&sensors.velocity),
            Self::Displacement => deviation(&sensors.displacement),
            Self::Acceleration => deviation(&sensors.acceleration),
            Self::Converter => rounding(dac.range, dac.bits),
        }
    }

    /// The key of a sensor's constant error and its size, in the signal's unit.
    pub(super) fn constant(self, rig: &RigConfig) -> Option<(&'static str, f64)> {
        let sensors = &rig.plant().sensors;
        let (key, size) = match self {
            Self::Force => ("sensors.force.bias", sensors.force.bias),
            Self::ForceResolution | Self::Converter => return None,
            Self::Velocity => ("sensors.velocity.bias", sensors.velocity.bias),
            Self::Displacement => ("sensors.displacement.bias", sensors.displacement.bias),
            Self::Acceleration => ("sensors.acceleration.bias", sensors.acceleration.bias),
        };
        (size != 0.0).then_some((key, size))
    }
}

/// Standard deviation of a reading by noise and rounding, in the signal's unit.
pub(crate) fn deviation(sensor: &Sensor) -> f64 {
    sensor.noise.hypot(rounding(sensor.range, sensor.bits))
}

fn rounding(range: Option<f64>, bits: Option<u32>) -> f64 {
    match (range, bits) {
        (Some(range), Some(bits)) => 2.0 * range * 0.5_f64.powi(bits.min(64) as i32) / 12.0_f64.sqrt(),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converter_rounds_with_the_deviation_of_a_uniform_error() {
        // 16 bits over ±10 V.
        assert!((rounding(Some(10.0), Some(16)) - 20.0 / 65536.0 / 12.0_f64.sqrt()).abs() < 1e-18);
        assert!(rounding(Some(10.0), None) == 0.0);
    }
}
