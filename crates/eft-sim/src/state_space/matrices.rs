//! Eigenvalues and exponentials of matrices whose rows differ by many powers of ten.
//!
//! With pressures in Pa and pilot flows in m³/s the entries extend over twenty decades. Balancing by powers
//! of two causes no rounding error, and keeps the relative error of both results near machine precision.

use nalgebra::linalg::balancing::{balance_parlett_reinsch, unbalance};
use nalgebra::{Complex, DMatrix, DVector, Hessenberg};

use super::qr::hessenberg_eigenvalues;
use crate::{Error, Result};

/// Eigenvalues, by magnitude, then by imaginary part.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let refused = |why| Err(Error::value("linear model", "no eigenvalues", why));
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return refused("its entries are beyond double precision");
    }
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    // Rows without feedback from other rows cannot be balanced with them, so the matrix gets a common scale.
    let largest = balanced.amax();
    let scale = if largest > 0.0 { largest } else { 1.0 };
    let Some(mut values) = hessenberg_eigenvalues(Hessenberg::new(balanced / scale).unpack_h()) else {
        return refused("the QR iteration does not converge on its entries");
    };
    values.iter_mut().for_each(|value| *value *= scale);
    values.sort_by(|a, b| a.norm().total_cmp(&b.norm()).then(a.im.total_cmp(&b.im)));
    Ok(values)
}

/// The matrix exponential.
pub(crate) fn exponential(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut balanced = matrix.clone();
    let scale: DVector<f64> = balance_parlett_reinsch(&mut balanced);
    let mut result = balanced.exp();
    unbalance(&mut result, &scale);
    result
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::analysis::linear::{FlowGain, Time, linearize};
    use crate::config::RigConfig;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_poles_of_a_building_have_the_sums_of_its_matrix(
            floors in 1_usize..9,
            alike in any::<bool>(),
            logs in prop::collection::vec((3.0..4.5, 2.0..4.5, 4.5..7.0), 8),
            delay in -4.0..-1.5,
            gain in -2.0..1.0,
            samples in 0_i64..12,
            rate in 200.0..12_800.0,
            digital in any::<bool>(),
        ) {
            let pick = |part: fn(&(f64, f64, f64)) -> f64| -> Vec<f64> {
                (0..floors).map(|i| 10.0_f64.powf(part(&logs[if alike { 0 } else { i }]))).collect()
            };
            let rig = RigConfig::zhao2005()
                .replace(&[
                    ("structure.kind", "shear_building".into()),
                    ("structure.stories.masses", pick(|one| one.0).into()),
                    ("structure.stories.dampings", pick(|one| one.1).into()),
                    ("structure.stories.stiffnesses", pick(|one| one.2).into()),
                    ("compensation.response_delay", 10.0_f64.powf(delay).into()),
                    ("compensation.computation_delay", samples.into()),
                    ("servovalve.flow_gain_scale", 10.0_f64.powf(gain).into()),
                    ("controller.realization", if digital { "digital" } else { "analog" }.into()),
                ])
                .unwrap();
            for time in [Time::Continuous, Time::Sampled(rate)] {
                let mut matrix = linearize(&rig, FlowGain::Nominal, time).unwrap().a;
                let poles = eigenvalues(&matrix).unwrap();
                prop_assert_eq!(poles.len(), matrix.nrows());
                balance_parlett_reinsch(&mut matrix);
                let (norm, round) = (matrix.norm(), 1e-14 * matrix.nrows() as f64);
                let sum: Complex<f64> = poles.iter().sum();
                let squares: Complex<f64> = poles.iter().map(|pole| pole * pole).sum();
                prop_assert!((sum - matrix.trace()).norm() <= round * norm);
                prop_assert!((squares - (&matrix * &matrix).trace()).norm() <= round * norm * norm);
            }
        }
    }

    #[test]
    fn a_badly_scaled_oscillator_keeps_its_poles_and_its_exponential() {
        // x'' + 2ζω·x' + ω²·x = 0 with the velocity in units of 1e-12.
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
    fn entries_that_are_not_finite_are_refused() {
        assert!(eigenvalues(&DMatrix::from_element(2, 2, f64::NAN)).is_err());
    }
}
