//! One sensor: from the true signal to what the controller reads.
//!
//! In this order: bandwidth, gain, bias and noise, range and resolution, fault, delay, lost samples.

use std::collections::VecDeque;

use crate::config::{self, FaultKind};
use crate::instruments::low_pass::LowPass;
use crate::instruments::noise::Noise;
use crate::instruments::quantizer::Quantizer;

/// A failure from one tick to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fault {
    pub(crate) kind: FaultKind,
    pub(crate) first: u64,
    pub(crate) end: u64,
}

/// What stands between a signal and the analog electronics that it is wired to: `gain·signal + offset`.
///
/// Converter, delay and lost samples belong to the digital side and do not reach it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AnalogOutput {
    pub(crate) gain: f64,
    pub(crate) offset: f64,
}

/// One sensor of one rig.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    bandwidth: Option<f64>,
    low_pass: Option<LowPass>,
    sample_rate: f64,
    gain: f64,
    bias: f64,
    deviation: f64,
    noise: Noise,
    converter: Option<Quantizer>,
    dropout: f64,
    lost: Noise,
    delay: usize,
    pending: VecDeque<f64>,
    fault: Option<Fault>,
    stuck_at: f64,
}

impl Channel {
    /// A sensor whose noise is drawn from the streams `stream` and `stream + 1` of a seed.
    pub(crate) fn new(
        sensor: &config::Sensor,
        fault: Option<Fault>,
        sample_rate: f64,
        seed: u64,
        stream: u64,
    ) -> Self {
        Self {
            bandwidth: sensor.bandwidth,
            low_pass: None,
            sample_rate,
            gain: sensor.gain,
            bias: sensor.bias,
            deviation: sensor.noise,
            noise: Noise::new(seed, stream),
            converter: sensor.range.map(|range| Quantizer::new(range, sensor.bits)),
            dropout: sensor.dropout,
            lost: Noise::new(seed, stream + 1),
            delay: sensor.delay as usize,
            pending: VecDeque::new(),
            fault,
            stuck_at: 0.0,
        }
    }

    /// The reading at tick `tick` of a signal, and the wire to the analog side until the next. A lost sample reads
    /// NaN. Before the first tick the signal counts as having stood still.
    pub(crate) fn read(&mut self, tick: u64, signal: f64) -> (f64, AnalogOutput) {
        let passed = match self.bandwidth {
            None => signal,
            Some(bandwidth) => {
                let rate = self.sample_rate;
                self.low_pass.get_or_insert_with(|| LowPass::new(bandwidth, rate, signal)).pass(signal)
            }
        };
        let seen = self.gain * passed;
        let error = if self.deviation > 0.0 {
            self.bias + self.deviation * self.noise.normal(tick)
        } else {
            self.bias
        };
        let sound = AnalogOutput { gain: self.gain, offset: error };
        let converted = self.converter.map_or(seen + error, |converter| converter.convert(seen + error));
        let (reported, wire) = match self.fault {
            Some(fault) if (fault.first..fault.end).contains(&tick) => match fault.kind {
                FaultKind::Lost => (f64::NAN, AnalogOutput { gain: 0.0, offset: 0.0 }),
                FaultKind::Zero => (0.0, AnalogOutput { gain: 0.0, offset: 0.0 }),
                FaultKind::Stuck => (self.stuck_at, AnalogOutput { gain: 0.0, offset: self.stuck_at }),
                FaultKind::Sign => (-converted, AnalogOutput { gain: -self.gain, offset: -error }),
            },
            _ => (converted, sound),
        };
        self.stuck_at = reported;
        let delivered = self.delayed(reported);
        let dropped = self.dropout > 0.0 && self.lost.uniform(tick) < self.dropout;
        (if dropped { f64::NAN } else { delivered }, wire)
    }

    fn delayed(&mut self, reading: f64) -> f64 {
        if self.delay == 0 {
            return reading;
        }
        self.pending.push_back(reading);
        if self.pending.len() > self.delay + 1 {
            self.pending.pop_front();
        }
        self.pending.front().copied().unwrap_or(reading)
    }
}
