//! A sensor's bandwidth: the first-order lag `ẏ = ω·(u − y)`, sampled.

use std::f64::consts::TAU;

/// The next output is `pole` times the last one plus `older` times the last input plus `newer` times the new one. This is
/// exact for a signal that is linear between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lag {
    pub(crate) pole: f64,
    pub(crate) older: f64,
    pub(crate) newer: f64,
}

impl Lag {
    /// A lag with a bandwidth (Hz) at a sample rate (Hz).
    pub(crate) fn new(bandwidth: f64, sample_rate: f64) -> Self {
        let z = TAU * bandwidth / sample_rate;
        let pole = libm::exp(-z);
        let mean = -libm::expm1(-z) / z;
        Self { pole, older: mean - pole, newer: 1.0 - mean }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct LowPass {
    lag: Lag,
    /// The last input and output; none before the first input, at which the filter is at rest.
    last: Option<[f64; 2]>,
}

impl LowPass {
    /// A filter with a bandwidth (Hz) at a sample rate (Hz).
    pub(crate) fn new(bandwidth: f64, sample_rate: f64) -> Self {
        Self { lag: Lag::new(bandwidth, sample_rate), last: None }
    }

    pub(crate) fn step(&mut self, signal: f64) -> f64 {
        let Lag { pole, older, newer } = self.lag;
        let [input, output] = self.last.unwrap_or([signal; 2]);
        let output = pole * output + older * input + newer * signal;
        self.last = Some([signal, output]);
        output
    }

    /// Visits every number of the state, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.last.iter_mut().flatten().for_each(visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exponential of glibc ends with another bit.
    #[test]
    fn a_filter_has_the_same_bits_on_every_platform() {
        assert_eq!(LowPass::new(58.0, 4096.0).lag.pole.to_bits(), 0x3fed_46a2_153c_df32);
    }

    #[test]
    fn sine_comes_out_with_the_gain_and_phase_of_a_first_order_lag() {
        let (bandwidth, frequency, rate) = (100.0, 40.0, 8192.0);
        let mut filter = LowPass::new(bandwidth, rate);
        let ratio: f64 = frequency / bandwidth;
        let (gain, lag) = (1.0 / (1.0 + ratio * ratio).sqrt(), ratio.atan());
        for n in 0..8192 {
            let phase = TAU * frequency * f64::from(n) / rate;
            let out = filter.step(phase.sin());
            if n > 4096 {
                // The chord of a sine is below it by (2πf/f_s)²/12 on average.
                assert!((out - gain * (phase - lag).sin()).abs() < 1e-4);
            }
        }
    }
}
