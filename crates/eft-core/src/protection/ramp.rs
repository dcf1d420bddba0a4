//! Ramps of any length that end at the exact sample, because positions are integers.

use crate::error::{ConfigError, check, within};
use crate::integrity::integrity;
use crate::number::Real;

/// The end of a ramp, in its steps.
const FULL: u64 = 1 << 62;
/// Longest ramp (samples): up to here a ramp is exact to a sample.
const LONGEST: f64 = 1e9;

/// Progress of a ramp in a sample (1/2⁶²).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ramp(u64);
integrity!(Ramp: 0);

/// The position of a ramp, from zero to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Position(u64);
integrity!(Position: 0);

impl Ramp {
    /// A ramp over a time (s) at a rate (Hz), of at least one sample.
    pub(crate) const fn new(name: &'static str, time: f64, rate: f64) -> Result<Self, ConfigError> {
        let samples = check!(within(name, time, 0.0, LONGEST / rate)) * rate;
        // A tolerance of half a sample, for a time that is not a binary fraction.
        let samples = (samples + 0.5) as u64;
        Ok(Self(if samples > 1 { FULL.div_ceil(samples) } else { FULL }))
    }
}

impl Position {
    #[inline(always)]
    pub(crate) fn up(self, ramp: Ramp) -> Self {
        let next = self.0 + ramp.0;
        Self(if next < FULL { next } else { FULL })
    }
    #[inline(always)]
    pub(crate) fn down(self, ramp: Ramp) -> Self {
        Self(self.0.saturating_sub(ramp.0))
    }
    #[inline(always)]
    pub(crate) fn is_zero(self) -> bool {
        self.0 == 0
    }
    /// Position as a share (1); exactly 0 and 1 at the ends.
    #[inline(always)]
    pub(crate) fn share<T: Real>(self) -> T {
        // A share of 2⁻³¹ is fine enough for either precision.
        T::from_u32((self.0 >> 31) as u32) * T::splat(1.0 / (1_u32 << 31) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_ramp_ends_on_its_sample() {
        // 300 s at 20 kHz, and the shortest.
        for (time, rate, samples) in
            [(300.0, 20e3, 6_000_000), (0.3, 4096.0, 1229), (0.0, 1e3, 1), (1e-3, 1e3, 1)]
        {
            let ramp = Ramp::new("ramp_time", time, rate).unwrap();
            let (mut up, mut n) = (Position::default(), 0);
            while up.share::<f32>().to_bits() != 1.0_f32.to_bits() {
                up = up.up(ramp);
                n += 1;
            }
            // In `f32` the last samples of a long ramp round to 1.
            assert!(n <= samples && samples - n <= samples / 10_000_000 + 1, "{n} of {samples}");
            let (mut down, mut n) = (Position(FULL), 0);
            while !down.is_zero() {
                down = down.down(ramp);
                n += 1;
            }
            assert_eq!(n, samples);
        }
        assert!(Ramp::new("ramp_time", 2e5, 1e4).is_err());
    }
}
