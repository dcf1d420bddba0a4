//! The velocity of rigs that measure only displacement: the observer's gains, and what either estimate delays.

use std::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Vector3};

use super::delay_budget::phase_delay;
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
    checks::positive("sample_rate", sample_rate, "Hz")?;
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

/// The estimated velocity over the true one at a frequency (Hz), for the rig's structure at small motion; 1 for a
/// sensor. `seen` is what the sensors make of displacement and acceleration.
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
        source => {
            let structure = &rig.structure;
            let mass = rig.controller.observer_mass.unwrap_or(structure.mass);
            let force = s * structure.mass + structure.damping + Complex::from(structure.stiffness) / s;
            let by_force = source == VelocitySource::Observer;
            let given = if by_force { force / mass } else { s * acceleration };
            let mean = given * (one + back) * 0.5;
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

/// The delay (s) of the velocity that the compensation gets from a rig's displacement, from 0.5 to 10 Hz; 0 where a
/// sensor measures the velocity.
///
/// # Errors
/// As [`observer_gains`].
pub fn velocity_delay(rig: &RigConfig, sample_rate: f64) -> Result<f64> {
    delay_behind(rig, sample_rate, BAND, |_, _| Complex::ONE)
}

/// The same over a band (Hz), with the filters and delays of the sensors before it.
///
/// # Errors
/// As [`observer_gains`]; an invalid band.
pub(super) fn sensed_velocity_delay(rig: &RigConfig, sample_rate: f64, band: (f64, f64)) -> Result<f64> {
    delay_behind(rig, sample_rate, band, |sensor, frequency| {
        let filter =
            sensor.bandwidth.map_or(Complex::ONE, |corner| Complex::new(1.0, frequency / corner).inv());
        filter * Complex::cis(-TAU * frequency * f64::from(sensor.delay) / sample_rate)
    })
}

/// The delay (s) of the velocity over a band (Hz), behind sensors that answer to a frequency (Hz) like this.
fn delay_behind(
    rig: &RigConfig,
    sample_rate: f64,
    band: (f64, f64),
    answer: impl Fn(&Sensor, f64) -> Complex<f64>,
) -> Result<f64> {
    let sensors = &rig.sensors;
    if rig.controller.velocity_source == VelocitySource::Sensor {
        return phase_delay(|frequency| answer(&sensors.velocity, frequency), band);
    }
    let gains = observer_gains(rig, sample_rate)?;
    let estimate = |frequency| {
        let seen = [&sensors.displacement, &sensors.acceleration].map(|sensor| answer(sensor, frequency));
        response(rig, gains, sample_rate, frequency, seen)
    };
    Ok(phase_delay(estimate, band)?.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(source: VelocitySource) -> RigConfig {
        let mut rig = RigConfig::zhao2005();
        rig.controller.velocity_source = source;
        rig.controller.observer_mass = Some(rig.structure.mass);
        rig
    }

    #[test]
    fn gains_solve_the_riccati_equation() {
        let drifts = [(VelocitySource::Observer, 200.0), (VelocitySource::Accelerometer, 10.0)];
        for (source, drift) in drifts {
            let mut rig = rig(source);
            rig.controller.observer_drift = 200.0;
            rig.controller.accelerometer_drift = 10.0;
            check_gains(&rig, drift);
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
        let observer = velocity_delay(&rig(VelocitySource::Observer), 4096.0).unwrap();
        assert!(observer < 0.2 * derivative, "{observer}");
    }

    #[test]
    fn behind_an_accelerometer_the_delay_is_its_own() {
        let mut rig = rig(VelocitySource::Accelerometer);
        assert!(velocity_delay(&rig, 4096.0).unwrap() < 1e-6);
        // Far above the few hertz up to which the observer follows the displacement.
        let band = (50.0, 100.0);
        rig.sensors.acceleration.delay = 4;
        let late = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((late * 4096.0 - 4.0).abs() < 0.05, "{late}");
        rig.sensors.displacement.delay = 4;
        let all = sensed_velocity_delay(&rig, 4096.0, band).unwrap();
        assert!((all * 4096.0 - 4.0).abs() < 1e-3, "{all}");
    }
}
