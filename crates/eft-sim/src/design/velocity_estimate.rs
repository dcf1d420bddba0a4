//! Velocity estimates from the displacement: gains of the observer, frequency response and delay.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, Matrix3, Vector2, Vector3};

use super::phase_delay;
use crate::{Error, Result, checks};

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

/// An estimate's state space, `x(n) = A·x(n − 1) + B·u(n)`.
#[derive(Debug, Clone)]
pub(crate) struct EstimateStates {
    pub(crate) a: DMatrix<f64>,
    /// A column for the displacement (m), and one for the acceleration (m/s²).
    pub(crate) b: DMatrix<f64>,
}

impl EstimateStates {
    /// Index of the state that is the estimate (m/s) of the same sample.
    pub(crate) const VELOCITY: usize = 1;
}

impl VelocityEstimate {
    /// The states at a sample rate (Hz).
    pub(crate) fn states(&self, sample_rate: f64) -> EstimateStates {
        let period = 1.0 / sample_rate;
        match *self {
            Self::Derivative { corner } => {
                let angle = TAU * corner * period;
                let share = (angle / (1.0 + 0.5 * angle)).min(1.0);
                let slope = share * sample_rate;
                // First low-pass, second low-pass, displacement.
                let a = [
                    [1.0 - share, 0.0, -slope],
                    [share * (1.0 - share), 1.0 - share, -share * slope],
                    [0.0, 0.0, 0.0],
                ];
                let b = [[slope, 0.0], [share * slope, 0.0], [1.0, 0.0]];
                EstimateStates {
                    a: DMatrix::from_row_slice(3, 3, a.as_flattened()),
                    b: DMatrix::from_row_slice(3, 2, b.as_flattened()),
                }
            }
            Self::Observer(gains) => {
                let gain = Vector3::from(gains);
                let keep = Matrix3::identity() - gain * Vector3::x().transpose();
                // The mean of this acceleration and of the last one, which is the fourth state.
                let half = keep * input(period) * 0.5;
                let (mut a, mut b) = (DMatrix::zeros(4, 4), DMatrix::zeros(4, 2));
                a.view_mut((0, 0), (3, 3)).copy_from(&(keep * transition(period)));
                a.view_mut((0, 3), (3, 1)).copy_from(&half);
                b.view_mut((0, 0), (3, 1)).copy_from(&gain);
                b.view_mut((0, 1), (3, 1)).copy_from(&half);
                b[(3, 1)] = 1.0;
                EstimateStates { a, b }
            }
        }
    }

    /// The estimated velocity over the true one at a frequency (Hz). `seen` has the ratios of its inputs,
    /// displacement and acceleration, to the true ones.
    pub(crate) fn response(&self, sample_rate: f64, frequency: f64, seen: [Complex<f64>; 2]) -> Complex<f64> {
        let [displacement, acceleration] = seen;
        let s = Complex::new(0.0, TAU * frequency);
        let EstimateStates { a, b } = self.states(sample_rate);
        let back = Complex::cis(-TAU * frequency / sample_rate);
        let system = DMatrix::identity(a.nrows(), a.nrows()) - a.map(|value| back * value);
        let driven = b.map(Complex::from) * Vector2::new(displacement / s, acceleration * s);
        system.try_inverse().map_or(Complex::ONE, |inverse| (inverse * driven)[EstimateStates::VELOCITY])
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
