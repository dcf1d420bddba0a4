//! Several rigs side by side: their number types, and the processor's instructions for them.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
mod avx512;
mod dispatch;
#[cfg(target_arch = "x86_64")]
mod eight;
mod processor;
#[cfg(target_arch = "x86_64")]
mod table_rows;

use eft_core::{Flags, Lanes, Scalar};

use processor::with_best_instructions;

pub(crate) use dispatch::{WideWork, dispatch_wide, width};
pub(crate) use processor::Work;

/// Largest number of rigs side by side.
pub(crate) const WIDEST: usize = 8;

/// The number type of the plant: double precision, one or several side by side.
pub trait Num: Scalar<Element = f64> + 'static {
    /// `self + factor·other`, rounded once.
    ///
    /// # Cost
    /// One instruction if the processor has it; otherwise many times as long for the same bits.
    fn plus(self, factor: Self, other: Self) -> Self;

    /// Runs `work`, which computes with these numbers, with the instructions that this processor has.
    fn dispatch<W: Work>(work: W) -> W::Output;

    /// Appends one lane of each number.
    #[inline(always)]
    fn append(to: &mut Vec<f64>, from: &[Self], lane: usize) {
        to.extend(from.iter().map(|numbers| numbers.lane(lane)));
    }

    /// The same of status words.
    #[inline(always)]
    fn append_flags(to: &mut Vec<u32>, from: &[Self::Flags], lane: usize) {
        to.extend(from.iter().map(|words| words.lane(lane)));
    }
}

impl Num for f64 {
    #[inline(always)]
    fn plus(self, factor: f64, other: f64) -> f64 {
        factor.mul_add(other, self)
    }
    fn dispatch<W: Work>(work: W) -> W::Output {
        with_best_instructions(work)
    }
    #[inline(always)]
    fn append(to: &mut Vec<f64>, from: &[f64], _: usize) {
        to.extend_from_slice(from);
    }
}

impl<const N: usize> Num for Lanes<f64, N> {
    #[inline(always)]
    fn plus(self, factor: Self, other: Self) -> Self {
        Self::from_lanes(|i| self.lane(i).plus(factor.lane(i), other.lane(i)))
    }
    fn dispatch<W: Work>(work: W) -> W::Output {
        with_best_instructions(work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The operations that a type of several numbers replaces by its own instructions.
    struct Replaced([f64; 2]);

    impl WideWork for Replaced {
        type Output = [u64; 3];

        fn run<S: Num>(self) -> [u64; 3] {
            let [a, b] = self.0.map(S::splat);
            [a.larger(b), a.smaller(b), a.times_sign_of(b)].map(|wide| {
                let bits = wide.lane(0).to_bits();
                assert!((1..S::LANES).all(|lane| wide.lane(lane).to_bits() == bits));
                bits
            })
        }
    }

    #[test]
    fn a_lane_has_the_bits_of_the_number_for_zeros_and_nan() {
        let values = [0.0, 1.5, f64::MIN_POSITIVE / 4.0, f64::INFINITY, f64::NAN];
        let values = || values.into_iter().flat_map(|value| [value, -value]);
        for (a, b) in values().flat_map(|a| values().map(move |b| (a, b))) {
            let alone = [a.larger(b), a.smaller(b), a.times_sign_of(b)].map(f64::to_bits);
            assert_eq!(dispatch_wide(Replaced([a, b])).unwrap_or(alone), alone, "{a} {b}");
        }
    }
}
