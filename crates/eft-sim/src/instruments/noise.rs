//! Noise whose value is a function of seed, stream and index alone: no state, so no thread, order or restart
//! can change it.

use std::f64::consts::TAU;

/// Weyl increment of SplitMix64 (Steele, Lea, Flood 2014), 2⁶⁴ over the golden ratio.
const WEYL: u64 = 0x9e37_79b9_7f4a_7c15;

/// One stream of random numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    key: u64,
}

impl Noise {
    /// Stream `stream` of a seed. Streams are stretches of SplitMix64's one cycle, 2⁶⁴ long, from scattered starts.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self { key: mix(mix(seed.wrapping_add(WEYL)) ^ mix(stream.wrapping_mul(WEYL))) }
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&self, index: u64) -> f64 {
        // 53 bits fill the significand.
        (self.word(index) >> 11) as f64 * 2f64.powi(-53)
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller): indices 2n and 2n + 1 share two words.
    pub(crate) fn normal(&self, index: u64) -> f64 {
        let even = index & !1;
        // Away from 0, whose logarithm is infinite.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform(even)));
        let angle = TAU * self.uniform(even + 1);
        radius * if index == even { libm::cos(angle) } else { libm::sin(angle) }
    }

    fn word(&self, index: u64) -> u64 {
        mix(self.key.wrapping_add(index.wrapping_add(1).wrapping_mul(WEYL)))
    }
}

/// SplitMix64's output function.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_splitmix64() {
        // The published sequence of seed 1234567.
        let noise = Noise { key: 1_234_567 };
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([0, 1, 2].map(|i| noise.word(i)), expected);
    }

    #[test]
    fn normals_have_the_moments_of_a_normal() {
        const N: usize = 200_000;
        let (a, b) = (Noise::new(1, 0), Noise::new(1, 1));
        let draw = |noise: &Noise| (0..N as u64).map(|i| noise.normal(i)).collect::<Vec<_>>();
        let (x, y) = (draw(&a), draw(&b));
        let mean = |f: &dyn Fn(usize) -> f64| (0..N).map(f).sum::<f64>() / N as f64;
        // Four standard errors of each estimate.
        let error = 4.0 / (N as f64).sqrt();
        assert!(mean(&|i| x[i]).abs() < error);
        assert!((mean(&|i| x[i].powi(2)) - 1.0).abs() < error * 2f64.sqrt());
        assert!(mean(&|i| x[i].powi(3)).abs() < error * 15f64.sqrt());
        assert!((mean(&|i| x[i].powi(4)) - 3.0).abs() < error * 96f64.sqrt());
        for lag in [1, 2, 7] {
            assert!(mean(&|i| x[i] * x[(i + lag) % N]).abs() < error, "lag {lag}");
        }
        assert!(mean(&|i| x[i] * y[i]).abs() < error, "streams");
    }
}
