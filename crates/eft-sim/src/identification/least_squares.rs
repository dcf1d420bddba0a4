//! Linear least squares of real unknowns on complex data, with a covariance from the residuals.

use nalgebra::{SMatrix, SVector};

use super::Estimate;
use crate::fourier::Complex64;

/// Neighbouring frequencies of one sum of the uncertainty, because their residuals depend on each other.
const NEIGHBOURS: usize = 16;

/// Columns and target at one frequency.
pub(super) type Row<const N: usize> = ([Complex64; N], Complex64);

/// The real numbers `p` with `Σ pᵢ·columnᵢ ≈ target` at all frequencies; `None` where the columns do not determine
/// them.
pub(super) fn least_squares<const N: usize>(
    rows: impl Iterator<Item = Row<N>> + Clone,
) -> Option<[Estimate; N]> {
    errors_in_variables(rows.map(|row| (row, [])))
}

/// The same where columns and target contain noise. Beside each row is one standard deviation of every independent source in
/// columns and target. Its squares, which would draw the unknowns towards zero, are subtracted.
pub(super) fn errors_in_variables<const N: usize, const S: usize>(
    rows: impl Iterator<Item = (Row<N>, [Row<N>; S])> + Clone,
) -> Option<[Estimate; N]> {
    let product = |a: Complex64, b: Complex64| a.re * b.re + a.im * b.im;
    let signed = |(row, noise): (Row<N>, [Row<N>; S])| {
        std::iter::once((1.0, row)).chain(noise.into_iter().map(|source| (-1.0, source)))
    };
    let mut normal = SMatrix::<f64, N, N>::zeros();
    let mut right = SVector::<f64, N>::zeros();
    for (sign, (column, target)) in rows.clone().flat_map(signed) {
        normal += SMatrix::<f64, N, N>::from_fn(|i, j| sign * product(column[i], column[j]));
        right += SVector::<f64, N>::from_fn(|i, _| sign * product(column[i], target));
    }
    // Unit diagonal, because the columns have different units.
    let scale = normal.diagonal().map(|square| square.sqrt().recip());
    if !scale.iter().all(|one| one.is_finite()) {
        return None;
    }
    let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    let inverse = SMatrix::<f64, N, N>::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let found = inverse * right;
    let mut spread = SMatrix::<f64, N, N>::zeros();
    let mut sum = SVector::<f64, N>::zeros();
    let mut count = 0;
    for row in rows {
        if count % NEIGHBOURS == 0 {
            spread += sum * sum.transpose();
            sum.fill(0.0);
        }
        count += 1;
        for (sign, (column, target)) in signed(row) {
            let model: Complex64 = column.iter().zip(found.iter()).map(|(a, b)| a * b).sum();
            sum += SVector::<f64, N>::from_fn(|i, _| sign * product(column[i], target - model));
        }
    }
    spread += sum * sum.transpose();
    // The unknowns take a part of the scatter.
    let sums = count.div_ceil(NEIGHBOURS);
    let freedom = sums as f64 / sums.saturating_sub(N).max(1) as f64;
    let covariance = inverse * spread * inverse * freedom;
    let estimate = |i| Estimate { value: found[i], uncertainty: covariance[(i, i)].max(0.0).sqrt() };
    found.iter().all(|one| one.is_finite()).then(|| std::array::from_fn(estimate))
}
