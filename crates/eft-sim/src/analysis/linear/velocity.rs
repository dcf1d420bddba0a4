//! The velocity of rigs that measure only displacement: the observer's gains, and what either estimate delays.

use std::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Vector3};

use super::phase_delay::phase_delay;
use crate::checks;
use crate::config::{RigConfig, Sensor, VelocitySource};
use crate::error::{Error, Result};

/// Band (Hz) over which the delay of an estimate is taken.
const BAND: (f64, f64) = (0.5, 10.0);

/// From one sample to the next: displacement, velocity, drift.
fn transition(period: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, period, 0.5 * period * period, 0.0, 1.0, period, 0.0, 0.0, 1.0)
}

/// What an acceleration held over a sample does to them.
fn input(period: f64) -> Vector3<f64> {
    Vector3::new(0.5 * period * period, period, 0.0)
}

/// The steady-state gains of a rig's velocity observer at a sample rate (Hz), on displacement (1), velocity (1/s) and
/// drift (1/s²): from the discrete Riccati equation, by doubling.
///
/// # Errors
/// An invalid sample rate; noises so unlike that the equation is not solved.
pub fn observer_gains(rig: &RigConfig, sample_rate: f64) -> Result<[f64; 3]> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let c = &rig.controller;
    let period = 1.0 / sample_rate;
    let variance = c.observer_displacement_noise * c.observer_displacement_noise;
    let b = input(period) * c.observer_acceleration_noise;
    let (key, rate) = match c.velocity_source {
        VelocitySource::Accelerometer => ("controller.accelerometer_drift", c.accelerometer_drift),
        _ => ("controller.observer_drift", c.observer_drift),
    };
    let drift = rate * period;
    let mut h = b * b.transpose() + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, drift * drift));
    let mut a = transition(period).transpose();
    let mut g = Matrix3::from_diagonal(&Vector3::new(1.0 / variance, 0.0, 0.0));
    let refuse = || Error::value(key, rate, "must suit the other noises");
    for _ in 0..60 {
        let inverse = (Matrix3::identity() + g * h).try_inverse().ok_or_else(refuse)?;
        let next = h + a.transpose() * h * inverse * a;
        g += a * inverse * g * a.transpose();
        a = a * inverse * a;
        let change = (next - h).norm();
        h = next;
        if change <= 1e-15 * h.norm() {
            let spread = h[(0, 0)] + variance;
            return Ok([h[(0, 0)] / spread, h[(1, 0)] / spread, h[(2, 0)] / spread]);
        }
    }
    Err(refuse())
}

/// Force over the observer's mass at a frequency (Hz), over the true acceleration, for the rig's structure at small
/// motion.
fn acceleration_of_force(rig: &RigConfig, frequency: f64) -> Complex<f64> {
    let structure = &rig.plant().structure;
    let mass = rig.controller.observer_mass.unwrap_or(rig.structure.mass);
    let s = Complex::new(0.0, TAU * frequency);
    (s * structure.mass + structure.damping + Complex::from(structure.stiffness) / s) / (s * mass)
}

/// The estimated velocity over the true one at a frequency (Hz); 1 for a sensor. `seen` is what the estimate gets for
/// displacement and acceleration, over the true ones.
fn response(
    rig: &RigConfig,
    gains: [f64; 3],
    sample_rate: f64,
    frequency: f64,
    seen: [Complex<f64>; 2],
) -> Complex<f64> {
    let [displacement, acceleration] = seen;
    let period = 1.0 / sample_rate;
    let s = Complex::new(0.0, TAU * frequency);
    let back = (-s * period).exp();
    let one = Complex::new(1.0, 0.0);
    match rig.controller.velocity_source {
        VelocitySource::Sensor => one,
        VelocitySource::Derivative => {
            let angle = TAU * rig.controller.velocity_corner * period;
            let share = (angle / (1.0 + 0.5 * angle)).min(1.0);
            let low_pass = Complex::from(share) / (one - back * (1.0 - share));
            displacement * (one - back) / s * sample_rate * low_pass * low_pass
        }
        VelocitySource::Observer | VelocitySource::Accelerometer => {
            let mean = s * acceleration * (one + back) * 0.5;
            let a = transition(period).map(Complex::from);
            let gain = Vector3::from(gains).map(Complex::from);
            let keep =
                Matrix3::identity() - gain * Vector3::new(one, Complex::ZERO, Complex::ZERO).transpose();
            let driven = keep * input(period).map(Complex::from) * mean + gain * displacement / s;
            let system = Matrix3::identity() - keep * a * back;
            system.try_inverse().map_or(one, |inverse| (inverse * driven)[1])
        }
    }
}

/// The delay (s), from 0.5 to 10 Hz, of the velocity that a controller makes of the displacement, as it can know it: that
/// of its own filters; 0 where a sensor measures the velocity.
///
/// An observer that is given the acceleration is late by no more than its sampling, less than a microsecond at 4096 Hz.
/// Given the force over a mass, it is so for a free mass; what spring and damper add is the specimen's, which the
/// controller does not know, and stands in the delay budget alone.
///
/// # Errors
/// As [`observer_gains`].
pub fn velocity_delay(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    // A lead network takes no lead back.
    Ok(delay_behind(rig, sample_rate, BAND, |_| [Complex::ONE; 2])?.max(0.0))
}

/// The delay (s) of the velocity over a band (Hz), with the filters and delays of the sensors before it, and for an
/// observer of the force with what the rig's structure does; negative where an observer's mass that is too small has it
/// lead.
///
/// # Errors
/// As [`observer_gains`]; an invalid band.
pub(super) fn sensed_velocity_delay(rig: &RigConfig, sample_rate: f64, band: (f64, f64)) -> Result<f64> {
    let answer = |sensor: &Sensor, frequency: f64| {
        let filter =
            sensor.bandwidth.map_or(Complex::ONE, |corner| Complex::new(1.0, frequency / corner).inv());
        filter * Complex::cis(-TAU * frequency * f64::from(sensor.delay) / sample_rate)
    };
    let sensors = &rig.plant().sensors;
    let source = rig.controller.velocity_source;
    if source == VelocitySource::Sensor {
        return phase_delay(|frequency| answer(&sensors.velocity, frequency), band);
    }
    delay_behind(rig, sample_rate, band, |frequency| {
        let acceleration = match source {
            VelocitySource::Observer => acceleration_of_force(rig, frequency),
            _ => answer(&sensors.acceleration, frequency),
        };
        [answer(&sensors.displacement, frequency), acceleration]
    })
}

/// The delay (s) of an estimated velocity over a band (Hz) where the estimate gets this at a frequency (Hz) for
/// displacement and acceleration, over the true ones; negative where it leads.
fn delay_behind(
    rig: &RigConfig,
    sample_rate: f64,
    band: (f64, f64),
    seen: impl Fn(f64) -> [Complex<f64>; 2],
) -> Result<f64> {
    if rig.controller.velocity_source == VelocitySource::Sensor {
        return Ok(0.0);
    }
    let gains = observer_gains(rig, sample_rate)?;
    let estimate = |frequency| response(rig, gains, sample_rate, frequency, seen(frequency));
    phase_delay(estimate, band)
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
    fn gains_solve_the_riccati_equation() {
        let drifts = [(VelocitySource::Observer, 200.0), (VelocitySource::Accelerometer, 10.0)];
        for (source, drift) in drifts {
            let rig = rig(source).with(|rig| {
                rig.controller.observer_drift = 200.0;
                rig.controller.accelerometer_drift = 10.0;
            });
            check_gains(&rig.unwrap(), drift);
        }
    }

    fn check_gains(rig: &RigConfig, drift: f64) {
        let gains = observer_gains(rig, 4096.0).unwrap();
        // By iteration, the long way.
        let (a, b) =
            (transition(1.0 / 4096.0), input(1.0 / 4096.0) * rig.controller.observer_acceleration_noise);
        let drift = drift / 4096.0;
        let q = b * b.transpose() + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, drift * drift));
        let r = rig.controller.observer_displacement_noise.powi(2);
        let (mut p, mut k) = (q, Vector3::zeros());
        for _ in 0..400_000 {
            k = p.column(0) / (p[(0, 0)] + r);
            p = a * (p - k * p.row(0)) * a.transpose() + q;
        }
        for (found, expected) in gains.into_iter().zip(k.iter()) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{gains:?} {k}");
        }
    }

    #[test]
    fn delays_are_those_of_the_filters() {
        assert_eq!(velocity_delay(&rig(VelocitySource::Sensor), 4096.0).unwrap(), 0.0);
        let derivative = velocity_delay(&rig(VelocitySource::Derivative), 4096.0).unwrap();
        // Two poles at 80 Hz.
        let expected = 2.0 / (TAU * 80.0);
        assert!((derivative / expected - 1.0).abs() < 0.05, "{derivative} {expected}");
    }

    #[test]
    fn the_controller_s_delay_says_nothing_of_the_specimen() {
        let rig = rig(VelocitySource::Observer);
        let known = velocity_delay(&rig, 4096.0).unwrap();
        assert!(known < 1e-6, "{known}");
        let rig = rig.with(|rig| {
            rig.structure.stiffness *= 4.0;
            rig.structure.damping *= 4.0;
            rig.structure.mass *= 0.5;
        });
        let rig = rig.unwrap();
        assert_eq!(velocity_delay(&rig, 4096.0).unwrap().to_bits(), known.to_bits());
        assert!(sensed_velocity_delay(&rig, 4096.0, BAND).unwrap() > 1e-5);
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
        // By the phases of simulated sines, whose delay is its slope.
        let phase =
            |frequency: f64| simulated(&rig, 4096.0, frequency, acceleration_of_force(&rig, frequency)).arg();
        let points: Vec<f64> = (3..=100).map(|i| 0.1 * f64::from(i)).collect();
        let middle = points.iter().sum::<f64>() / points.len() as f64;
        let slope = points.iter().map(|f| (f - middle) * phase(*f)).sum::<f64>()
            / points.iter().map(|f| (f - middle).powi(2)).sum::<f64>();
        assert!((-slope / TAU - lead).abs() < 0.05e-3, "{} {lead}", -slope / TAU);
        // What the controller knows of is no lead.
        assert!(velocity_delay(&rig, 4096.0).unwrap() >= 0.0);
    }

    /// The estimate that `eft-core` makes of a sine's velocity, over it; `given` is what it gets for the acceleration,
    /// over the true one.
    fn simulated(rig: &RigConfig, rate: f64, frequency: f64, given: Complex<f64>) -> Complex<f64> {
        let observer = VelocityObserver::<f64>::new(observer_gains(rig, rate).unwrap(), rate).unwrap();
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
            let gains = observer_gains(&rig, rate).unwrap();
            for frequency in [0.5, 1.6, 7.0] {
                for given in [Complex::ONE, acceleration_of_force(&rig, frequency)] {
                    let expected = response(&rig, gains, rate, frequency, [Complex::ONE, given]);
                    let found = simulated(&rig, rate, frequency, given);
                    assert!((found - expected).norm() < 1e-6, "{source:?} {frequency}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn behind_an_accelerometer_the_delay_is_its_own() {
        let rig = rig(VelocitySource::Accelerometer);
        assert!(velocity_delay(&rig, 4096.0).unwrap() < 1e-6);
        // Far above the few hertz up to which the observer follows the displacement.
        let band = (50.0, 100.0);
        let rig = rig.with(|rig| rig.sensors.acceleration.delay = 4).unwrap();
        let late = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((late * 4096.0 - 4.0).abs() < 0.05, "{late}");
        let rig = rig.with(|rig| rig.sensors.displacement.delay = 4).unwrap();
        let all = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((all * 4096.0 - 4.0).abs() < 1e-3, "{all}");
    }
}
