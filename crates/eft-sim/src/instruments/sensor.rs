//! The sensors of one signal, for one rig or several side by side: from true values to readings.
//!
//! The order is bandwidth, gain, bias and noise, range and resolution, fault, delay, lost samples. A fault that
//! disturbs the analog output comes before the range. Effects of some rigs only are computed lane by lane, the
//! others in vector lanes.

use std::collections::VecDeque;

use eft_core::Mask;

use crate::config::{self, FaultKind};
use crate::instruments::low_pass::LowPass;
use crate::instruments::noise::{Noise, NoiseLanes};
use crate::instruments::quantizer::Quantizer;
use crate::lanes::{Num, WIDEST};

/// A failure from one tick to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fault {
    pub(crate) kind: FaultKind,
    pub(crate) first: u64,
    pub(crate) end: u64,
    /// Gain, offset, drift per tick or standard deviation, by the kind.
    pub(crate) size: f64,
    /// The deviates of a fault that is noise.
    pub(crate) noise: Noise,
}

impl Fault {
    /// The value and the analog output of the sensor at a tick of a fault that disturbs them; otherwise as given.
    fn disturbed(&self, tick: u64, value: f64, analog: AnalogOutput<f64>) -> (f64, AnalogOutput<f64>) {
        let added = match self.kind {
            FaultKind::Dead => return (analog.offset, AnalogOutput { gain: 0.0, ..analog }),
            FaultKind::Offset => self.size,
            FaultKind::Drift => self.size * (tick - self.first) as f64,
            FaultKind::Noise => self.size * self.noise.normal(tick),
            _ => return (value, analog),
        };
        (value + added, AnalogOutput { offset: analog.offset + added, ..analog })
    }
}

/// The analog output of a sensor to analog electronics: `gain·signal + offset`.
///
/// Converter, delay and lost samples belong to the digital side and do not affect it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AnalogOutput<S> {
    pub(crate) gain: S,
    pub(crate) offset: S,
}

impl<S: Num> AnalogOutput<S> {
    /// That of an ideal sensor.
    #[inline(always)]
    pub(crate) fn ideal() -> Self {
        Self { gain: S::splat(1.0), offset: S::splat(0.0) }
    }
}

/// Whether a sensor reports the true value.
pub(crate) fn is_ideal(sensor: &config::Sensor) -> bool {
    let config::Sensor { gain, noise, bandwidth, bits, range, delay, bias, dropout } = sensor;
    let ideal = *gain == 1.0 && *noise == 0.0 && *bias == 0.0 && *dropout == 0.0;
    ideal && *delay == 0 && bandwidth.is_none() && bits.is_none() && range.is_none()
}

/// One sensor per lane.
#[derive(Debug, Clone)]
pub(crate) struct Sensor<S: Num> {
    /// Lanes with an ideal sensor.
    ideal: S::Mask,
    /// Empty if no lane has a bandwidth.
    filters: Vec<Option<LowPass>>,
    gain: S,
    bias: S,
    deviation: S,
    /// `None` if no lane has noise.
    noise: Option<NoiseLanes<S>>,
    /// Empty if in every lane the reading equals the analog output.
    stages: Vec<DigitalStage>,
}

/// The digital part of a sensor, after its analog output.
#[derive(Debug, Clone)]
struct DigitalStage {
    converter: Option<Quantizer>,
    fault: Option<Fault>,
    stuck_at: f64,
    delay: usize,
    pending: VecDeque<f64>,
    dropout: f64,
    lost: Noise,
}

/// A sensor: its configuration, its fault and the seed of its noise.
pub(crate) type LaneSensor<'a> = (&'a config::Sensor, Option<Fault>, u64);

impl<S: Num> Sensor<S> {
    /// The sensors `of(0)`, `of(1)`, … one per lane, with noise from the streams `stream` and `stream + 1`.
    pub(crate) fn new<'a>(of: &dyn Fn(usize) -> LaneSensor<'a>, sample_rate: f64, stream: u64) -> Self {
        let lanes: Vec<_> = (0..S::LANES).map(of).collect();
        let number = |value: fn(&config::Sensor) -> f64| S::from_lanes(|i| value(lanes[i].0));
        let filter = |lane: &LaneSensor<'_>| lane.0.bandwidth.map(|corner| LowPass::new(corner, sample_rate));
        let mut filters: Vec<_> = lanes.iter().map(filter).collect();
        if filters.iter().all(Option::is_none) {
            filters.clear();
        }
        let mut stages: Vec<_> = lanes.iter().map(|lane| DigitalStage::new(lane, stream + 1)).collect();
        if stages.iter().all(DigitalStage::is_none) {
            stages.clear();
        }
        let noisy = lanes.iter().any(|lane| lane.0.noise > 0.0);
        Self {
            ideal: S::Mask::from_lanes(|i| is_ideal(lanes[i].0) && lanes[i].1.is_none()),
            filters,
            gain: number(|sensor| sensor.gain),
            bias: number(|sensor| sensor.bias),
            deviation: number(|sensor| sensor.noise),
            noise: noisy.then(|| NoiseLanes::new(|i| Noise::new(lanes[i].2, stream))),
            stages,
        }
    }

    /// The readings of a signal at tick `tick`, and the analog output until the next tick. Ticks must come in
    /// sequence from 0. A lost sample reads NaN. Before the first tick the signal was constant.
    #[inline(always)]
    pub(crate) fn read(&mut self, tick: u64, signal: S) -> (S, AnalogOutput<S>) {
        if self.ideal.all() {
            return (signal, AnalogOutput::ideal());
        }
        let mut filtered = signal;
        if !self.filters.is_empty() {
            let lanes = &mut self.filters;
            filtered =
                S::from_lanes(|i| lanes[i].as_mut().map_or(signal.lane(i), |one| one.step(signal.lane(i))));
        }
        let mut error = self.bias;
        if let Some(noise) = &mut self.noise {
            error = error + self.deviation * noise.at(tick);
        }
        let (mut reading, mut analog) =
            (self.gain * filtered + error, AnalogOutput { gain: self.gain, offset: error });
        if !self.stages.is_empty() {
            let mut answers = [(0.0, AnalogOutput { gain: 0.0, offset: 0.0 }); WIDEST];
            for (i, (stage, answer)) in self.stages.iter_mut().zip(&mut answers).enumerate() {
                let analog = AnalogOutput { gain: analog.gain.lane(i), offset: analog.offset.lane(i) };
                *answer = stage.read(tick, reading.lane(i), analog);
            }
            reading = S::from_lanes(|i| answers[i].0);
            analog.gain = S::from_lanes(|i| answers[i].1.gain);
            analog.offset = S::from_lanes(|i| answers[i].1.offset);
        }
        (S::select(self.ideal, signal, reading), analog)
    }

    /// Visits every number of the state after the first reading, to store or to replace it.
    pub(crate) fn numbers(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        self.filters.iter_mut().flatten().for_each(|filter| filter.numbers(visit));
        for stage in &mut self.stages {
            visit(&mut stage.stuck_at);
            stage.pending.iter_mut().for_each(&mut *visit);
        }
    }

    /// Sets the tick of the next reading.
    pub(crate) fn go_to(&mut self, tick: u64) {
        if let Some(noise) = &mut self.noise {
            noise.go_to(tick);
        }
    }
}

impl DigitalStage {
    fn new((sensor, fault, seed): &LaneSensor<'_>, stream: u64) -> Self {
        Self {
            converter: sensor.range.map(|range| Quantizer::new(range, sensor.bits)),
            fault: *fault,
            stuck_at: 0.0,
            delay: sensor.delay as usize,
            pending: VecDeque::new(),
            dropout: sensor.dropout,
            lost: Noise::new(*seed, stream),
        }
    }

    fn is_none(&self) -> bool {
        self.converter.is_none() && self.fault.is_none() && self.delay == 0 && self.dropout == 0.0
    }

    fn read(&mut self, tick: u64, sound: f64, wire: AnalogOutput<f64>) -> (f64, AnalogOutput<f64>) {
        let fault = self.fault.filter(|fault| (fault.first..fault.end).contains(&tick));
        let (analog_value, wire) = fault.map_or((sound, wire), |fault| fault.disturbed(tick, sound, wire));
        let converted = self.converter.map_or(analog_value, |converter| converter.convert(analog_value));
        let (reported, analog) = match fault {
            Some(fault) => match fault.kind {
                FaultKind::Lost => (f64::NAN, AnalogOutput { gain: 0.0, offset: 0.0 }),
                FaultKind::Zero => (0.0, AnalogOutput { gain: 0.0, offset: 0.0 }),
                FaultKind::Stuck => (self.stuck_at, AnalogOutput { gain: 0.0, offset: self.stuck_at }),
                FaultKind::Sign => (-converted, AnalogOutput { gain: -wire.gain, offset: -wire.offset }),
                FaultKind::Gain => {
                    let gain = fault.size;
                    (gain * converted, AnalogOutput { gain: gain * wire.gain, offset: gain * wire.offset })
                }
                FaultKind::Dead | FaultKind::Offset | FaultKind::Drift | FaultKind::Noise => {
                    (converted, wire)
                }
            },
            None => (converted, wire),
        };
        self.stuck_at = reported;
        let delivered = self.delayed(reported);
        let dropped = self.dropout > 0.0 && self.lost.uniform(tick) < self.dropout;
        (if dropped { f64::NAN } else { delivered }, analog)
    }

    fn delayed(&mut self, reading: f64) -> f64 {
        if self.delay == 0 {
            return reading;
        }
        if self.pending.is_empty() {
            self.pending.resize(self.delay, reading);
        }
        self.pending.push_back(reading);
        self.pending.pop_front().unwrap_or(reading)
    }
}
