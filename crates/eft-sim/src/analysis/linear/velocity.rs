//! The delay of a rig's velocity signal, including its sensors and its structure.

use std::f64::consts::TAU;

use nalgebra::Complex;

use crate::Result;
use crate::config::{RigConfig, Sensor, VelocitySource};
use crate::design::phase_delay;

/// Ratio of force over the observer's mass to the true acceleration at a frequency (Hz), for small motion of
/// the rig's structure.
fn acceleration_of_force(rig: &RigConfig, frequency: f64) -> Complex<f64> {
    let structure = &rig.plant().structure;
    let mass = rig.controller.observer_mass.unwrap_or(rig.structure.mass);
    let s = Complex::new(0.0, TAU * frequency);
    (s * structure.mass + structure.damping + Complex::from(structure.stiffness) / s) / (s * mass)
}

/// The delay (s) of the velocity over a band (Hz), including the filters and delays of its sensors. For an
/// observer of the force it includes the effect of the rig's structure. It is negative if the observer's mass
/// is too small, so that the estimate leads.
///
/// # Errors
/// As [`RigConfig::observer_gains`]; an invalid band.
pub(super) fn sensed_velocity_delay(rig: &RigConfig, sample_rate: f64, band: (f64, f64)) -> Result<f64> {
    let answer = |sensor: &Sensor, frequency: f64| {
        let filter =
            sensor.bandwidth.map_or(Complex::ONE, |corner| Complex::new(1.0, frequency / corner).inv());
        filter * Complex::cis(-TAU * frequency * f64::from(sensor.delay) / sample_rate)
    };
    let sensors = &rig.plant().sensors;
    let Some(estimate) = rig.velocity_estimate(sample_rate)? else {
        return phase_delay(|frequency| answer(&sensors.velocity, frequency), band);
    };
    estimate.delay(sample_rate, band, |frequency| {
        let acceleration = match rig.controller.velocity_source {
            VelocitySource::Observer => acceleration_of_force(rig, frequency),
            _ => answer(&sensors.acceleration, frequency),
        };
        [answer(&sensors.displacement, frequency), acceleration]
    })
}

#[cfg(test)]
mod tests {
    use eft_core::{FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState};

    use super::*;
    use crate::config::RigValues;

    fn rig(source: VelocitySource) -> RigConfig {
        let observed = |rig: &mut RigValues| {
            rig.controller.velocity_source = source;
            rig.controller.observer_mass = Some(rig.structure.mass);
        };
        RigConfig::zhao2005().with(observed).unwrap()
    }

    #[test]
    fn delays_are_those_of_the_filters() {
        assert_eq!(rig(VelocitySource::Sensor).velocity_delay(4096.0).unwrap(), 0.0);
        let derivative = rig(VelocitySource::Derivative).velocity_delay(4096.0).unwrap();
        // Two poles at 80 Hz.
        let expected = 2.0 / (TAU * 80.0);
        assert!((derivative / expected - 1.0).abs() < 0.05, "{derivative} {expected}");
    }

    #[test]
    fn the_controllers_delay_is_independent_of_the_specimen() {
        let rig = rig(VelocitySource::Observer);
        let known = rig.velocity_delay(4096.0).unwrap();
        assert!(known < 1e-6, "{known}");
        let rig = rig.with(|rig| {
            rig.structure.stiffness *= 4.0;
            rig.structure.damping *= 4.0;
            rig.structure.mass *= 0.5;
        });
        let rig = rig.unwrap();
        assert_eq!(rig.velocity_delay(4096.0).unwrap().to_bits(), known.to_bits());
        assert!(sensed_velocity_delay(&rig, 4096.0, (0.5, 10.0)).unwrap() > 1e-5);
    }

    #[test]
    fn an_observer_of_too_small_a_mass_leads_and_the_budget_says_so() {
        let rig = rig(VelocitySource::Observer);
        let mass = rig.structure.mass;
        let band = (0.3, 10.0);
        // Its acceleration is too large by the ratio of the masses: the estimate leads.
        let rig = rig.with(|rig| rig.controller.observer_mass = Some(0.5 * mass)).unwrap();
        let lead = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!(lead < -1e-3, "{lead}");
        // The delay is the slope of the phases of simulated sines.
        let phase =
            |frequency: f64| simulated(&rig, 4096.0, frequency, acceleration_of_force(&rig, frequency)).arg();
        let points: Vec<f64> = (3..=100).map(|i| 0.1 * f64::from(i)).collect();
        let middle = points.iter().sum::<f64>() / points.len() as f64;
        let slope = points.iter().map(|f| (f - middle) * phase(*f)).sum::<f64>()
            / points.iter().map(|f| (f - middle).powi(2)).sum::<f64>();
        assert!((-slope / TAU - lead).abs() < 0.05e-3, "{} {lead}", -slope / TAU);
        // The delay known to the controller is never a lead.
        assert!(rig.velocity_delay(4096.0).unwrap() >= 0.0);
    }

    /// The estimate that `eft-core` makes of a sine's velocity, over the true velocity; `given` is the ratio
    /// of the acceleration that it receives to the true one.
    fn simulated(rig: &RigConfig, rate: f64, frequency: f64, given: Complex<f64>) -> Complex<f64> {
        let observer = VelocityObserver::<f64>::new(rig.observer_gains(rate).unwrap(), rate).unwrap();
        let derivative = FilteredDerivative::<f64>::new(rig.controller.velocity_corner, rate).unwrap();
        let (mut observed, mut derived) =
            (VelocityObserverState::default(), FilteredDerivativeState::default());
        let s = Complex::new(0.0, TAU * frequency);
        let ticks = (20.0 * rate) as usize;
        let mut product = Complex::ZERO;
        for n in 0..ticks {
            let wave = (s * (n as f64 / rate)).exp();
            let (displacement, acceleration) = ((wave / s).re, (given * s * wave).re);
            let velocity = match rig.controller.velocity_source {
                VelocitySource::Derivative => derivative.step(&mut derived, displacement),
                _ => observer.step(&mut observed, displacement, acceleration),
            };
            // The second half, a whole number of periods, long after the start.
            if n >= ticks / 2 {
                product += wave.conj() * velocity;
            }
        }
        product * 4.0 / ticks as f64
    }

    #[test]
    fn responses_are_those_of_a_simulated_sine() {
        let rate = 1024.0;
        for source in [VelocitySource::Derivative, VelocitySource::Observer, VelocitySource::Accelerometer] {
            let rig = rig(source);
            let estimate = rig.velocity_estimate(rate).unwrap().unwrap();
            for frequency in [0.5, 1.6, 7.0] {
                for given in [Complex::ONE, acceleration_of_force(&rig, frequency)] {
                    let expected = estimate.response(rate, frequency, [Complex::ONE, given]);
                    let found = simulated(&rig, rate, frequency, given);
                    assert!((found - expected).norm() < 1e-6, "{source:?} {frequency}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn with_an_accelerometer_the_delay_is_that_of_its_sensor() {
        let rig = rig(VelocitySource::Accelerometer);
        assert!(rig.velocity_delay(4096.0).unwrap() < 1e-6);
        // This band is far above the few hertz up to which the observer follows the displacement.
        let band = (50.0, 100.0);
        let rig = rig.with(|rig| rig.sensors.acceleration.delay = 4).unwrap();
        let late = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((late * 4096.0 - 4.0).abs() < 0.05, "{late}");
        let rig = rig.with(|rig| rig.sensors.displacement.delay = 4).unwrap();
        let all = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((all * 4096.0 - 4.0).abs() < 1e-3, "{all}");
    }
}
