//! Eigenvalues and exponentials of matrices whose rows differ by many powers of ten.
//!
//! Pressures in Pa beside pilot flows in m³/s spread the entries over twenty decades: balancing by powers of two
//! first costs no rounding and keeps the relative error of both near the machine's.

use nalgebra::linalg::balancing::{balance_parlett_reinsch, unbalance};
use nalgebra::{Complex, DMatrix, DVector, Schur};

use crate::error::{Error, Result};

/// Sweeps of the QR iteration before it is given up, per row.
const SWEEPS_PER_ROW: usize = 1000;

/// Eigenvalues, by magnitude, then by imaginary part.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    // Rows that nothing couples back have no partner to balance with; a common scale is still wanted.
    let sweeps = SWEEPS_PER_ROW * matrix.nrows();
    let finite = matrix.iter().all(|entry| entry.is_finite());
    let schur = if finite { Schur::try_new(balanced, f64::EPSILON, sweeps) } else { None };
    let Some(schur) = schur else {
        return Err(Error::value(
            "linear model",
            "no eigenvalues",
            "its entries are beyond double precision",
        ));
    };
    let mut values: Vec<_> = schur.complex_eigenvalues().iter().copied().collect();
    values.sort_by(|a, b| a.norm().total_cmp(&b.norm()).then(a.im.total_cmp(&b.im)));
    Ok(values)
}

/// The matrix exponential.
pub(super) fn exponential(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut balanced = matrix.clone();
    let scale: DVector<f64> = balance_parlett_reinsch(&mut balanced);
    let mut result = balanced.exp();
    unbalance(&mut result, &scale);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_badly_scaled_oscillator_keeps_its_poles_and_its_exponential() {
        // x'' + 2ζω·x' + ω²·x = 0 with the velocity counted in units of 1e-12.
        let (zeta, omega, unit) = (0.03, 10.0, 1e12);
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0 / unit, -omega * omega * unit, -2.0 * zeta * omega]);
        let poles = eigenvalues(&a).unwrap();
        let damped = omega * (1.0_f64 - zeta * zeta).sqrt();
        assert!((poles[0].re + zeta * omega).abs() < 1e-13 && (poles[1].im - damped).abs() < 1e-12);

        let (t, decay) = (0.37, -zeta * omega);
        let phi = exponential(&(a * t));
        let (sin, cos) = (damped * t).sin_cos();
        let expected = (decay * t).exp() * (cos - decay / damped * sin);
        assert!((phi[(0, 0)] - expected).abs() < 1e-14);
        assert!((phi[(0, 1)] * unit - (decay * t).exp() * sin / damped).abs() < 1e-15);
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        assert!(eigenvalues(&DMatrix::from_element(2, 2, f64::NAN)).is_err());
    }
}
