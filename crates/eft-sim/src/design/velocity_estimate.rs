//! Velocity estimates from the displacement: gains of the observer, frequency response and delay.

use std::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Vector3};

use super::phase_delay;
use crate::checks;
use crate::error::{Error, Result};

/// The noises that a velocity observer assumes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ObserverNoises {
    /// Of the displacement (m).
    pub(crate) displacement: f64,
    /// Of the acceleration (m/s²).
    pub(crate) acceleration: f64,
    /// Drift rate of the acceleration's offset (m/s³).
    pub(crate) drift: f64,
    /// The configuration's key of the drift.
    pub(crate) drift_key: &'static str,
}

/// The method of a velocity estimate.
#[derive(Debug, Clone, Copy)]
pub(crate) enum VelocityEstimate {
    /// Differences of the displacement after two low-pass filters with this corner (Hz).
    Derivative {
        /// Hz.
        corner: f64,
    },
    /// An observer with gains on displacement (1), velocity (1/s) and drift (1/s²).
    Observer([f64; 3]),
}

/// From one sample to the next: displacement, velocity, drift.
fn transition(period: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, period, 0.5 * period * period, 0.0, 1.0, period, 0.0, 0.0, 1.0)
}

/// Effect of an acceleration held over a sample on the states.
fn input(period: f64) -> Vector3<f64> {
    Vector3::new(0.5 * period * period, period, 0.0)
}

/// The steady-state gains of an observer at a sample rate (Hz): the solution of the discrete Riccati equation
/// by doubling.
///
/// # Errors
/// An invalid sample rate; noises of so different size that the equation has no numerical solution.
pub(crate) fn observer_gains(noises: &ObserverNoises, sample_rate: f64) -> Result<[f64; 3]> {
    checks::sample_rate("sample_rate", sample_rate)?;
    let period = 1.0 / sample_rate;
    let variance = noises.displacement * noises.displacement;
    let b = input(period) * noises.acceleration;
    let drift = noises.drift * period;
    let mut h = b * b.transpose() + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, drift * drift));
    let mut a = transition(period).transpose();
    let mut g = Matrix3::from_diagonal(&Vector3::new(1.0 / variance, 0.0, 0.0));
    let refuse = || Error::value(noises.drift_key, noises.drift, "must suit the other noises");
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

impl VelocityEstimate {
    /// The estimated velocity over the true one at a frequency (Hz). `seen` has the ratios of its inputs,
    /// displacement and acceleration, to the true ones.
    pub(crate) fn response(&self, sample_rate: f64, frequency: f64, seen: [Complex<f64>; 2]) -> Complex<f64> {
        let [displacement, acceleration] = seen;
        let period = 1.0 / sample_rate;
        let s = Complex::new(0.0, TAU * frequency);
        let back = (-s * period).exp();
        let one = Complex::new(1.0, 0.0);
        match *self {
            Self::Derivative { corner } => {
                let angle = TAU * corner * period;
                let share = (angle / (1.0 + 0.5 * angle)).min(1.0);
                let low_pass = Complex::from(share) / (one - back * (1.0 - share));
                displacement * (one - back) / s * sample_rate * low_pass * low_pass
            }
            Self::Observer(gains) => {
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

    /// The delay (s) of the estimate over a band (Hz); negative if it leads. `seen` gives for a frequency
    /// (Hz) the ratios of its inputs, displacement and acceleration, to the true ones.
    ///
    /// # Errors
    /// An invalid band.
    pub(crate) fn delay(
        &self,
        sample_rate: f64,
        band: (f64, f64),
        seen: impl Fn(f64) -> [Complex<f64>; 2],
    ) -> Result<f64> {
        phase_delay(|frequency| self.response(sample_rate, frequency, seen(frequency)), band)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_solve_the_riccati_equation() {
        for drift in [200.0, 10.0] {
            let noises = ObserverNoises { displacement: 1e-6, acceleration: 0.05, drift, drift_key: "drift" };
            let gains = observer_gains(&noises, 4096.0).unwrap();
            // The same gains by plain iteration.
            let (a, b) = (transition(1.0 / 4096.0), input(1.0 / 4096.0) * noises.acceleration);
            let step = drift / 4096.0;
            let q = b * b.transpose() + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, step * step));
            let r = noises.displacement * noises.displacement;
            let (mut p, mut k) = (q, Vector3::zeros());
            for _ in 0..400_000 {
                k = p.column(0) / (p[(0, 0)] + r);
                p = a * (p - k * p.row(0)) * a.transpose() + q;
            }
            for (found, expected) in gains.into_iter().zip(k.iter()) {
                assert!((found / expected - 1.0).abs() < 1e-6, "{gains:?} {k}");
            }
        }
    }
}
