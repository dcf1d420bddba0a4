//! The search for a gain that leads to itself.

/// Bounds of the gain (1), between a gain that leads to a larger one and a gain that leads to a smaller one. Two gains
/// that lead to each other end an iteration without bounds.
#[derive(Debug)]
pub(super) struct Bracket {
    low: f64,
    high: f64,
}

impl Bracket {
    /// Of any positive gain.
    pub(super) fn new() -> Self {
        Self { low: 0.0, high: f64::INFINITY }
    }

    /// The gain (1) to be tried after one that led to another.
    pub(super) fn next(&mut self, tried: f64, found: f64) -> f64 {
        if found > tried {
            self.low = tried;
        } else {
            self.high = tried;
        }
        if self.low < found && found < self.high { found } else { 0.5 * (self.low + self.high) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_that_lead_to_each_other_end_between_them() {
        let search = |leads_to: fn(f64) -> f64| {
            let (mut bracket, mut gain) = (Bracket::new(), 1.0);
            for _ in 0..8 {
                gain = bracket.next(gain, leads_to(gain));
            }
            gain
        };
        // Each of these has a cycle of two gains from 1 on, and the solution 1/2.
        assert!((search(|gain| 0.25 / gain) - 0.5).abs() < 5e-3);
        assert!((search(|gain| if gain > 0.5 { 0.2 } else { 0.9 }) - 0.5).abs() < 5e-3);
        // This one converges by itself.
        assert!((search(|gain| 0.4 + 0.2 * gain) - 0.5).abs() < 1e-5);
    }
}
