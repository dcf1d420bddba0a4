//! Linear least squares of real unknowns on complex data, with a covariance from the residuals.

use nalgebra::{SMatrix, SVector};

use super::Estimate;
use crate::fourier::Complex64;

/// Neighbouring frequencies of one sum of the uncertainty, because their residuals depend on each other.
const NEIGHBOURS: usize = 16;

/// The real numbers `p` with `Σ pᵢ·columnᵢ ≈ target` at all frequencies; `None` where the columns do not determine
/// them.
pub(super) fn least_squares<const N: usize>(
    rows: impl Iterator<Item = ([Complex64; N], Complex64)> + Clone,
) -> Option<[Estimate; N]> {
    let product = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
    let mut normal = SMatrix::<f64, N, N>::zeros();
    let mut right = SVector::<f64, N>::zeros();
    for (column, target) in rows.clone() {
        normal += SMatrix::<f64, N, N>::from_fn(|i, j| product(column[i], column[j]));
        right += SVector::<f64, N>::from_fn(|i, _| product(column[i], target));
    }
    // Unit diagonal, because the columns have different units.
    let scale = normal.diagonal().map(|square| square.sqrt().recip());
    if !scale.iter().all(|one| one.is_finite()) {
        return None;
    }
    let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.try_inverse()?;
    let inverse = SMatrix::<f64, N, N>::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let found = inverse * right;
    let mut spread = SMatrix::<f64, N, N>::zeros();
    let mut sum = SVector::<f64, N>::zeros();
    for (number, (column, target)) in rows.enumerate() {
        if number.is_multiple_of(NEIGHBOURS) {
            spread += sum * sum.transpose();
            sum.fill(0.0);
        }
        let model: Complex64 = column.iter().zip(found.iter()).map(|(a, b)| a * b).sum();
        sum += SVector::<f64, N>::from_fn(|i, _| product(column[i], target - model));
    }
    spread += sum * sum.transpose();
    let covariance = inverse * spread * inverse;
    let estimate = |i| Estimate::new(found[i], covariance[(i, i)].max(0.0).sqrt());
    found.iter().all(|one| one.is_finite()).then(|| std::array::from_fn(estimate))
}
