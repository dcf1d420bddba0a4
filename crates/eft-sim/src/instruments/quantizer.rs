//! An analog-to-digital or digital-to-analog converter: range and resolution.

/// Clips to a range and rounds to the nearest of `2^bits` codes (two's complement, zero among them).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quantizer {
    step: f64,
    lowest: f64,
    highest: f64,
}

impl Quantizer {
    /// A quantizer with a range on both sides of zero and, if given, a number of bits over the whole range.
    pub(crate) fn new(range: f64, bits: Option<u32>) -> Self {
        match bits {
            None => Self { step: 0.0, lowest: -range, highest: range },
            Some(bits) => {
                let step = 2.0 * range / 2f64.powi(bits.min(64) as i32);
                Self { step, lowest: -range, highest: range - step }
            }
        }
    }

    /// The nearest code; NaN stays.
    pub(crate) fn convert(&self, value: f64) -> f64 {
        let clipped = value.clamp(self.lowest, self.highest);
        if self.step > 0.0 { (clipped / self.step).round() * self.step } else { clipped }
    }

    /// Whether a value is outside the range.
    pub(crate) fn clips(&self, value: f64) -> bool {
        value > self.highest + 0.5 * self.step || value < self.lowest - 0.5 * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_to_codes_and_stops_at_the_ends() {
        // Two bits over ±2: codes −2, −1, 0, 1.
        let converter = Quantizer::new(2.0, Some(2));
        let given = [-9.0, -1.6, -1.4, -0.2, 0.2, 0.6, 1.7, 9.0];
        assert_eq!(given.map(|v| converter.convert(v)), [-2.0, -2.0, -1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert!(
            converter.clips(1.6) && !converter.clips(1.4) && !converter.clips(-2.2) && converter.clips(-2.6)
        );
        assert_eq!(Quantizer::new(2.0, None).convert(1.2345), 1.2345);
        assert_eq!(Quantizer::new(2.0, None).convert(-7.0), -2.0);
        assert!(converter.convert(f64::NAN).is_nan());
    }

    #[test]
    fn error_is_uniform_over_a_step() {
        let converter = Quantizer::new(1.0, Some(12));
        let step = 2.0 / 4096.0;
        let errors: Vec<f64> =
            (0..10_000).map(|i| 1e-4 * f64::from(i) * 0.999).map(|v| converter.convert(v) - v).collect();
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        assert!((variance / (step * step / 12.0) - 1.0).abs() < 0.02);
    }
}
