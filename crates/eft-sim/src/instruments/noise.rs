//! Noise as a function of seed, stream and index. It has no state, so threads, order and restarts do not
//! change it.

use std::f64::consts::{LN_2, SQRT_2, TAU};

use crate::lanes::{Num, WIDEST, Work};

/// Weyl increment of SplitMix64 (Steele, Lea, Flood 2014), 2⁶⁴ over the golden ratio.
const WEYL: u64 = 0x9e37_79b9_7f4a_7c15;

/// One stream of random numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    key: u64,
}

/// Number of normal deviates computed together.
const BLOCK: usize = 16;
const PAIRS: usize = BLOCK / 2;

impl Noise {
    /// Stream `stream` of a seed. A stream is a part of SplitMix64's cycle of length 2⁶⁴, from a scattered
    /// start.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self { key: mix(mix(seed.wrapping_add(WEYL)) ^ mix(stream.wrapping_mul(WEYL))) }
    }

    /// Uniform in [0, 1).
    #[inline(always)]
    pub(crate) fn uniform(&self, index: u64) -> f64 {
        // 53 bits fill the significand.
        (self.word(index) >> 11) as f64 * 2f64.powi(-53)
    }

    /// Normal with mean 0 and standard deviation 1.
    pub(crate) fn normal(&self, index: u64) -> f64 {
        let blocks = BLOCK as u64;
        let mut normals = [0.0; BLOCK];
        self.normals(index / blocks, &mut normals);
        normals[(index % blocks) as usize]
    }

    /// Normal deviates at the indices from `BLOCK·block` on (Box and Muller): indices 2n and 2n + 1 share two
    /// words.
    // One loop over independent pairs, which the compiler vectorizes.
    #[inline(always)]
    fn normals(&self, block: u64, normals: &mut [f64; BLOCK]) {
        let first = block.wrapping_mul(BLOCK as u64);
        let (mut cosines, mut sines) = ([0.0; PAIRS], [0.0; PAIRS]);
        for (pair, (cosine, sine)) in cosines.iter_mut().zip(&mut sines).enumerate() {
            let even = first.wrapping_add(2 * pair as u64);
            // Never 0, because its logarithm is infinite.
            let radius = (-2.0 * logarithm(1.0 - self.uniform(even))).sqrt();
            let (c, s) = cosine_and_sine(self.uniform(even.wrapping_add(1)));
            (*cosine, *sine) = (radius * c, radius * s);
        }
        for (pair, (cosine, sine)) in cosines.iter().zip(&sines).enumerate() {
            (normals[2 * pair], normals[2 * pair + 1]) = (*cosine, *sine);
        }
    }

    #[inline(always)]
    fn word(&self, index: u64) -> u64 {
        mix(self.key.wrapping_add(index.wrapping_add(1).wrapping_mul(WEYL)))
    }
}

/// SplitMix64's output function.
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Natural logarithm of a normal number in (0, 1]. The error is 6·10⁻¹⁶ of the logarithm, or of 0.5 near 1.
// By the series of the inverse hyperbolic tangent, without a branch, a table or a call.
#[inline(always)]
fn logarithm(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    // Numbers with this exponent are integers, so an integer can be written into their lowest bits.
    const WHOLE: f64 = 4_503_599_627_370_496.0;
    let bits = x.to_bits();
    let exponent = f64::from_bits(WHOLE.to_bits() | (bits >> 52)) - (WHOLE + 1023.0);
    let mantissa = f64::from_bits((bits & MANTISSA) | 1f64.to_bits());
    let high = mantissa > SQRT_2;
    let (mantissa, exponent) = if high { (0.5 * mantissa, exponent + 1.0) } else { (mantissa, exponent) };
    let t = (mantissa - 1.0) / (mantissa + 1.0);
    let square = t * t;
    let mut sum = 1.0 / 19.0;
    for odd in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        sum = sum * square + 1.0 / odd;
    }
    2.0 * t + (2.0 * t * square * sum + exponent * LN_2)
}

/// Cosine and sine of a fraction of a turn in [0, 1).
#[inline(always)]
fn cosine_and_sine(share: f64) -> (f64, f64) {
    // The sum of this and a small number rounds the number to an integer, which is in the last bits of the
    // sum.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const SIGN: u64 = 1 << 63;
    let rounded = 4.0 * share + ROUND;
    let (quarter, bits) = (rounded - ROUND, rounded.to_bits());
    let angle = (share - 0.25 * quarter) * TAU;
    let square = angle * angle;
    let (mut sine, mut cosine) = (1.0, 1.0);
    for n in [16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
        sine = 1.0 - sine * square * (1.0 / (n * (n + 1.0)));
        cosine = 1.0 - cosine * square * (1.0 / (n * (n - 1.0)));
    }
    let sine = sine * angle;
    let odd = bits & 1 == 1;
    let (c, s) = if odd { (sine, cosine) } else { (cosine, sine) };
    let signed = |value: f64, quarters: u64| f64::from_bits(value.to_bits() ^ ((quarters << 62) & SIGN));
    (signed(c, bits.wrapping_add(1)), signed(s, bits))
}

/// The noise of one sensor per lane, in sequence from index 0.
#[derive(Debug, Clone)]
pub(crate) struct NoiseLanes<S> {
    lanes: Vec<Noise>,
    block: [S; BLOCK],
}

impl<S: Num> NoiseLanes<S> {
    pub(crate) fn new(lane: impl Fn(usize) -> Noise) -> Self {
        Self { lanes: (0..S::LANES).map(lane).collect(), block: [S::splat(0.0); BLOCK] }
    }

    /// Normal deviates at an index, which must be 0 or the one after the last.
    #[inline(always)]
    pub(crate) fn at(&mut self, index: u64) -> S {
        let offset = index as usize % BLOCK;
        if offset == 0 {
            self.fill(index / BLOCK as u64);
        }
        self.block[offset]
    }

    /// Sets the index of the next call.
    pub(crate) fn go_to(&mut self, index: u64) {
        self.fill(index / BLOCK as u64);
    }

    #[inline(never)]
    fn fill(&mut self, block: u64) {
        S::dispatch(Fill { noise: self, block });
    }
}

struct Fill<'a, S> {
    noise: &'a mut NoiseLanes<S>,
    block: u64,
}

impl<S: Num> Work for Fill<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let mut normals = [[0.0; BLOCK]; WIDEST];
        for (lane, normals) in self.noise.lanes.iter().zip(&mut normals) {
            lane.normals(self.block, normals);
        }
        for (i, value) in self.noise.block.iter_mut().enumerate() {
            *value = S::from_lanes(|lane| normals[lane][i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eft_core::Scalar;

    #[test]
    fn words_are_those_of_splitmix64() {
        // The published sequence of seed 1234567.
        let noise = Noise { key: 1_234_567 };
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([0, 1, 2].map(|i| noise.word(i)), expected);
    }

    #[test]
    fn logarithm_and_turn_are_those_of_the_library() {
        let noise = Noise::new(3, 0);
        for i in 0..100_000 {
            let share = noise.uniform(i);
            let x = (1.0 - share) * 2f64.powi(-(i as i32 % 50));
            // This logarithm has three roundings, the library's has one.
            assert!((logarithm(x) - x.ln()).abs() <= 6e-16 * x.ln().abs().max(0.5), "{x}");
            let (c, s) = cosine_and_sine(share);
            let (sine, cosine) = (TAU * share).sin_cos();
            // The angle passed to the library is itself rounded.
            assert!((c - cosine).abs() < 1e-15 && (s - sine).abs() < 1e-15, "{share}");
        }
        assert_eq!((logarithm(1.0), cosine_and_sine(0.0), cosine_and_sine(0.5).0), (0.0, (1.0, 0.0), -1.0));
    }

    #[test]
    fn each_lane_has_the_numbers_of_its_own_stream() {
        let of = |lane: usize| Noise::new(5, lane as u64);
        let mut lanes = NoiseLanes::<eft_core::Lanes<f64, 4>>::new(of);
        for index in 0..100 {
            let side_by_side = lanes.at(index);
            assert!((0..4).all(|i| side_by_side.lane(i).to_bits() == of(i).normal(index).to_bits()));
        }
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
