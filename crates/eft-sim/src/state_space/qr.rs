//! Eigenvalues of an upper Hessenberg matrix by Francis's double-shift QR iteration.
//!
//! nalgebra's Schur decomposition does not converge if the stories of a building share a pole. It computes
//! the polynomial of the shifts from products that cancel, and has no exceptional shifts. This version
//! computes the polynomial from differences, as LAPACK's `dlahqr`, and uses exceptional shifts in every tenth
//! step on an eigenvalue.

use nalgebra::{Complex, DMatrix};

/// Largest number of steps on one eigenvalue; two or three are typical.
const MOST_STEPS: usize = 300;
/// After this number of steps without convergence an entry is compared with the largest one. Several delays make a
/// group of poles at zero, which no entry there is small beside.
const STUCK: usize = 40;
/// After this number of steps without convergence the shifts are replaced, to leave a cycle.
const EXCEPTIONAL: usize = 10;

/// The eigenvalues in no particular order, complex ones in exact pairs; `None` if the iteration does not
/// converge.
///
/// The entries must be finite. The matrix is overwritten.
pub(super) fn hessenberg_eigenvalues(mut h: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let largest = h.amax();
    let mut values = Vec::with_capacity(h.nrows());
    // The active block ends before `end`.
    let (mut end, mut steps) = (h.nrows(), 0);
    while end > 0 {
        let start = block_start(&mut h, end, largest, steps >= STUCK);
        match end - start {
            1 => values.push(Complex::new(h[(start, start)], 0.0)),
            2 => values.extend(eigenvalues_of_two(entries(&h, start))),
            _ if steps == MOST_STEPS => return None,
            _ => {
                steps += 1;
                let shifts = shifts(&h, start, end, steps);
                sweep(&mut h, start, end, shifts);
                continue;
            }
        }
        (end, steps) = (start, 0);
    }
    Some(values)
}

/// Start of the coupled block that ends before `end`. The entry that couples it to the rows before is
/// negligible and set to zero, beside its neighbours or, if `stuck`, beside the largest entry.
fn block_start(h: &mut DMatrix<f64>, end: usize, largest: f64, stuck: bool) -> usize {
    for k in (1..end).rev() {
        let neighbours = h[(k - 1, k - 1)].abs() + h[(k, k)].abs();
        let scale = if stuck || neighbours == 0.0 { largest } else { neighbours };
        if h[(k, k - 1)].abs() <= f64::EPSILON * scale {
            h[(k, k - 1)] = 0.0;
            return k;
        }
    }
    0
}

/// The diagonal block of two rows that begins at `at`, row by row.
fn entries(h: &DMatrix<f64>, at: usize) -> [f64; 4] {
    [h[(at, at)], h[(at, at + 1)], h[(at + 1, at)], h[(at + 1, at + 1)]]
}

fn eigenvalues_of_two([a, b, c, d]: [f64; 4]) -> [Complex<f64>; 2] {
    let half = 0.5 * (a - d);
    let discriminant = half * half + b * c;
    if discriminant < 0.0 {
        let value = Complex::new(d + half, (-discriminant).sqrt());
        return [value, value.conj()];
    }
    // Distances of the eigenvalues to `d`: the larger is computed without cancellation, the other from the
    // product of both.
    let far = half + discriminant.sqrt().copysign(half);
    let near = if far == 0.0 { 0.0 } else { -b * c / far };
    [Complex::new(d + far, 0.0), Complex::new(d + near, 0.0)]
}

/// The eigenvalues of the last two rows. If they are real, the one nearer to the last entry is used twice.
fn shifts(h: &DMatrix<f64>, start: usize, end: usize, steps: usize) -> [Complex<f64>; 2] {
    if steps.is_multiple_of(EXCEPTIONAL) {
        // The exceptional shifts of LAPACK, alternately about the first and the last entry.
        let (at, below) = if (steps / EXCEPTIONAL).is_multiple_of(2) {
            (end - 1, [(end - 1, end - 2), (end - 2, end - 3)])
        } else {
            (start, [(start + 1, start), (start + 2, start + 1)])
        };
        let size: f64 = below.into_iter().map(|entry| h[entry].abs()).sum();
        let diagonal = 0.75 * size + h[(at, at)];
        return eigenvalues_of_two([diagonal, -0.4375 * size, size, diagonal]);
    }
    let [first, second] = eigenvalues_of_two(entries(h, end - 2));
    let last = h[(end - 1, end - 1)];
    if first.im != 0.0 {
        [first, second]
    } else if (first.re - last).abs() <= (second.re - last).abs() {
        [first; 2]
    } else {
        [second; 2]
    }
}

/// One step, which moves the bulge of the two shifts through the block.
fn sweep(h: &mut DMatrix<f64>, start: usize, end: usize, shifts: [Complex<f64>; 2]) {
    let (first, mut bulge) = bulge_start(h, start, end, shifts);
    for k in first..end - 1 {
        let rows = 3.min(end - k);
        if k > first {
            bulge = [h[(k, k - 1)], h[(k + 1, k - 1)], if rows == 3 { h[(k + 2, k - 1)] } else { 0.0 }];
        }
        // The reflection I − tau·v·vᵀ, with 1 as first element of v, which removes all entries of the bulge
        // but the first.
        let size: f64 = bulge.iter().map(|entry| entry.abs()).sum();
        if size == 0.0 {
            continue;
        }
        // The squares of small entries themselves would vanish.
        let norm = size * bulge.iter().map(|entry| (entry / size) * (entry / size)).sum::<f64>().sqrt();
        let kept = -norm.copysign(bulge[0]);
        let tau = (kept - bulge[0]) / kept;
        let v = [1.0, bulge[1] / (bulge[0] - kept), bulge[2] / (bulge[0] - kept)];
        if k > first {
            h[(k, k - 1)] = kept;
            for row in 1..rows {
                h[(k + row, k - 1)] = 0.0;
            }
        } else if k > start {
            h[(k, k - 1)] *= 1.0 - tau;
        }
        let height = h.nrows();
        for column in k..end {
            let entries = &mut h.as_mut_slice()[column * height + k..][..rows];
            reflect(entries, 1, &v[..rows], tau);
        }
        let columns = &mut h.as_mut_slice()[k * height..][..rows * height];
        for row in start..end.min(k + 4) {
            reflect(&mut columns[row..], height, &v[..rows], tau);
        }
    }
}

/// Reflects the entries at every `stride`, as many as `v` has; its first element is 1.
fn reflect(entries: &mut [f64], stride: usize, v: &[f64], tau: f64) {
    let mut along = entries[0];
    for i in 1..v.len() {
        along += v[i] * entries[i * stride];
    }
    along *= tau;
    for i in 0..v.len() {
        entries[i * stride] -= along * v[i];
    }
}

/// The row in which the bulge may start, after two consecutive small entries, and its first column.
fn bulge_start(h: &DMatrix<f64>, start: usize, end: usize, shifts: [Complex<f64>; 2]) -> (usize, [f64; 3]) {
    let [one, other] = shifts;
    let mut m = end - 3;
    loop {
        let [here, above, below, next] = entries(h, m);
        // A pair's imaginary parts are opposite.
        let scale = (here - other.re).abs() + other.im.abs() + below.abs();
        let low = below / scale;
        let bulge = [
            low * above + (here - one.re) * ((here - other.re) / scale) - one.im * (other.im / scale),
            low * ((here - one.re) + (next - other.re)),
            low * h[(m + 2, m + 1)],
        ];
        if m == start {
            return (m, bulge);
        }
        let around = h[(m - 1, m - 1)].abs() + here.abs() + next.abs();
        let spill = h[(m, m - 1)].abs() * (bulge[1].abs() + bulge[2].abs());
        if spill <= f64::EPSILON * bulge[0].abs() * around {
            return (m, bulge);
        }
        m -= 1;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Hessenberg;
    use proptest::prelude::*;

    use super::*;

    /// The eigenvalues, after checks of residuals, sum and sum of squares.
    fn checked(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
        let n = matrix.nrows();
        let values = hessenberg_eigenvalues(Hessenberg::new(matrix.clone()).unpack_h()).unwrap();
        assert_eq!(values.len(), n);
        let (norm, round) = (matrix.norm(), 1e-14 * n as f64);
        for value in &values {
            // The norm of (A − λ·1)⁻¹, which is this large only for a matrix that is singular apart from rounding.
            let shifted =
                matrix.map(|entry| Complex::new(entry, 0.0)) - DMatrix::from_diagonal_element(n, n, *value);
            let inverse = shifted.lu().try_inverse().map_or(f64::INFINITY, |inverse| inverse.norm());
            let singular = inverse * norm * round;
            // Not a number where the matrix is zero.
            assert!(singular.is_nan() || singular > 1.0, "{value}: {singular:e}");
        }
        let sum: Complex<f64> = values.iter().sum();
        let squares: Complex<f64> = values.iter().map(|value| value * value).sum();
        assert!((sum - matrix.trace()).norm() <= round * norm, "{sum}");
        assert!((squares - (matrix * matrix).trace()).norm() <= round * norm * norm, "{squares}");
        values
    }

    proptest! {
        #[test]
        fn random_matrices_have_their_eigenvalues(
            n in 1_usize..24,
            seed in prop::collection::vec(-1.0_f64..1.0, 24 * 24),
            decades in 0.0_f64..6.0,
        ) {
            // The rows decrease by a number of decades, and every third entry is zero.
            checked(&DMatrix::from_fn(n, n, |i, j| {
                let fall = 10.0_f64.powf(-decades * i as f64 / n as f64);
                if (i + 2 * j) % 3 == 0 { 0.0 } else { fall * seed[24 * i + j] }
            }));
        }

        #[test]
        fn eigenvalues_that_many_blocks_share_are_found(
            blocks in 2_usize..9,
            shared in -1.0_f64..1.0,
            seed in prop::collection::vec(-1.0_f64..1.0, 24 * 24),
            coupling in 1e-16_f64..1e-9,
        ) {
            // As for many equal stories: each has the same three poles, with a very weak coupling.
            let n = 3 * blocks;
            let values = checked(&DMatrix::from_fn(n, n, |i, j| {
                let block = [[shared, 0.3, 0.0], [-0.2, 0.1, 0.5], [0.0, 0.0, shared]];
                let own = if i / 3 == j / 3 { block[i % 3][j % 3] } else { 0.0 };
                own + coupling * seed[24 * i + j]
            }));
            prop_assert!(values.iter().filter(|value| (**value - shared).norm() < 1e-3).count() >= blocks);
        }
    }

    #[test]
    fn a_cycle_ends_by_exceptional_shifts() {
        for n in 3..60 {
            // The roots of λⁿ = 1.
            let values = checked(&DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == (j + 1) % n))));
            assert!(values.iter().all(|value| (value.powu(n as u32) - 1.0).norm() < 1e-11), "{n}");
        }
    }

    #[test]
    fn eigenvalues_of_zeros_and_of_chains_of_delays_are_found() {
        assert_eq!(checked(&DMatrix::zeros(5, 5)), [Complex::default(); 5]);
        let chain = DMatrix::from_fn(40, 40, |i, j| f64::from(u8::from(i == j + 1)));
        assert_eq!(hessenberg_eigenvalues(chain).unwrap(), [Complex::default(); 40]);
    }
}
