//! Noise of which a part is integrated, as that of the spool is in a displacement.
//!
//! The differences of white noise and of the integral of white noise are a moving average of order one, `e_i − θ·e_(i−1)`.
//! Of white noise alone the memory `θ` is one, of an integral zero. The filter `w_i = Δ_i + θ·w_(i−1)` makes it white again.

use crate::{Result, interruption};

/// Halvings of one less the memory that are tried.
const HALVINGS: i32 = 13;
/// Largest memory (1), that of white noise.
pub(super) const MOST_MEMORY: f64 = 1.0 - 1.0 / (1 << HALVINGS) as f64;

/// Least number of sums over a time that show what residuals have in common.
const LEAST_SUMS: usize = 20;

/// Several signals of a stretch.
pub(super) struct Part {
    /// Number of signals.
    pub(super) width: usize,
    /// The values of all signals at a sample, sample by sample.
    pub(super) values: Vec<f64>,
}

impl Part {
    /// The values of all signals, sample by sample.
    pub(super) fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.width)
    }
}

/// Memory (1) of noise: the one whose whitened noise is smallest, of a few between 0 and 1.
pub(super) fn memory_of(noise: impl Iterator<Item = Vec<f64>>) -> Result<f64> {
    let parts: Vec<Part> = noise.map(|values| Part { width: 1, values }).collect();
    let mut best = (f64::INFINITY, MOST_MEMORY);
    for halvings in (0..=HALVINGS).rev() {
        let memory = 1.0 - libm::exp2(-f64::from(halvings));
        let mut square = 0.0;
        for part in &parts {
            square += whitened(part, memory)?.values.iter().map(|v| v * v).sum::<f64>();
        }
        if square < best.0 {
            best = (square, memory);
        }
    }
    Ok(best.1)
}

/// Signals in which noise with this memory is white, free of an offset and a drift.
pub(super) fn whitened(part: &Part, memory: f64) -> Result<Part> {
    let (width, given) = (part.width, &part.values);
    let samples = (given.len() / width).saturating_sub(1);
    let mut white = vec![0.0; samples * width];
    let mut row = vec![0.0; width];
    let row = &mut row[..width];
    for (i, white) in white.chunks_exact_mut(width).enumerate() {
        if i.is_multiple_of(1024) {
            interruption::check()?;
        }
        let (before, now) = given[i * width..(i + 2) * width].split_at(width);
        for k in 0..width {
            row[k] = row[k] * memory + now[k] - before[k];
            white[k] = row[k];
        }
    }
    // An offset, which is the unknown noise of the first sample, and a drift.
    let (mut level, mut drift) = (1.0, 0.0);
    let mut free = vec![[0.0; 2]; samples];
    for one in &mut free {
        drift = drift * memory + 1.0;
        *one = [level, drift];
        level *= memory;
    }
    let product = |of: &dyn Fn([f64; 2]) -> f64| free.iter().map(|one| of(*one)).sum::<f64>();
    let share = product(&|[level, drift]| level * drift) / product(&|[level, _]| level * level);
    free.iter_mut().for_each(|[level, drift]| *drift -= share * *level);
    for which in 0..2 {
        let square: f64 = free.iter().map(|one| one[which] * one[which]).sum();
        row.fill(0.0);
        for (one, white) in free.iter().zip(white.chunks_exact(width)) {
            let part = one[which] / square;
            for k in 0..width {
                row[k] += part * white[k];
            }
        }
        for (one, white) in free.iter().zip(white.chunks_exact_mut(width)) {
            for k in 0..width {
                white[k] -= one[which] * row[k];
            }
        }
    }
    Ok(Part { width, values: white })
}

/// Factor on a variance by what residuals have in common over any time, such as the misfit of straight pieces.
pub(super) fn clustering(parts: &[Vec<f64>]) -> f64 {
    let square: f64 = parts.iter().flatten().map(|rest| rest * rest).sum();
    let each = square / parts.iter().map(Vec::len).sum::<usize>() as f64;
    let mut most = 1.0_f64;
    for length in (1..).map(|halving| 1 << halving) {
        let sums: Vec<f64> =
            parts.iter().flat_map(|part| part.chunks_exact(length)).map(|one| one.iter().sum()).collect();
        if sums.len() < LEAST_SUMS {
            break;
        }
        let together = sums.iter().map(|sum| sum * sum).sum::<f64>() / (sums.len() * length) as f64;
        // NaN, of a spool at rest, has nothing in common.
        most = most.max(together / each);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_and_whitening_are_those_of_the_noise() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for (direct, integrated) in [(1.0, 0.0), (1.0, 0.1), (1.0, 1.0), (0.0, 1.0)] {
            let mut sum = 0.0;
            let noise: Vec<f64> = (0..40_000)
                .map(|_| {
                    sum += integrated * uniform();
                    sum + direct * uniform()
                })
                .collect();
            let memory = memory_of(std::iter::once(noise.clone())).unwrap();
            // Steady state of the Kalman filter of a random walk in noise.
            let ratio = integrated / f64::max(direct, 1e-9);
            let exact = 1.0 + 0.5 * ratio * ratio - ratio * (1.0 + 0.25 * ratio * ratio).sqrt();
            let off = (1.0 - memory).max(1e-3) / (1.0 - exact).max(1e-3);
            assert!((0.5..2.0).contains(&off), "{direct} {integrated}: {memory}, not {exact}");
            let white = whitened(&Part { width: 1, values: noise }, memory).unwrap().values;
            let square: f64 = white.iter().map(|v| v * v).sum();
            let product: f64 = white.windows(2).map(|pair| pair[0] * pair[1]).sum();
            assert!((product / square).abs() < 0.2, "{direct} {integrated}: {}", product / square);
        }
    }
}
