//! The time of one tick on this machine: the lead network, the flow table's inverse, the compensation and the
//! whole tick, in f32 and f64. Filters of `idsp` and `biquad` with the function of the lead network run on
//! the same signal.
//!
//! Every bench runs one second of a 4096 Hz signal and asserts the output. For a microcontroller the number
//! of instructions matters: see `make firmware`.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)]

use std::hint::black_box;

use biquad::Biquad as _;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dsp_process::SplitProcess as _;
use eft_core::{
    Channel, Compensation, CompensationInput, CompensationState, FlowTable, Input, LeadNetwork, LeadState,
    Learner, Learning, Parameters,
};

const TICKS: usize = 4096;
const RATE: f64 = TICKS as f64;
/// The lead network's delay (s), α and DC gain (V).
const LEAD: (f64, f64, f64) = (5.0e-3, 0.1, 12.4);
const PARAMETERS: Parameters = Parameters { sample_rate: RATE, ..Parameters::ZHAO2005 };
/// Estimators with one flow gain.
const ONE_GAIN: Learning = Learning { curve_correction: false, ..Learning::ADAPTIVE };
const ADAPTIVE: Parameters = Parameters { feedforward: true, learning: ONE_GAIN, ..PARAMETERS };

/// Two sines within ±1.
fn signal() -> Vec<f64> {
    let at = |n: usize, hertz: f64| (std::f64::consts::TAU * hertz * n as f64 / RATE).sin();
    (0..TICKS).map(|n| 0.6 * at(n, 1.6) + 0.3 * at(n, 23.0)).collect()
}

/// Table 2 of the paper, openings and flows in m³/s.
fn table() -> ([f64; 21], [f64; 21]) {
    let right = [0.0, 102.2, 187.2, 260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0];
    let left = [536.2, 508.2, 480.2, 452.3, 419.9, 377.1, 324.2, 260.9, 188.2, 101.0];
    let flow = |n: usize| if n < 10 { -left[n] } else { right[n - 10] };
    (std::array::from_fn(|n| (n as f64 - 10.0) / 10.0), std::array::from_fn(|n| flow(n) * 1.638_706_4e-5))
}

/// Asserts the sum of all outputs within a tolerance.
fn holds(name: &str, sum: f64, expected: f64, tolerance: f64) {
    assert!((sum - expected).abs() <= tolerance * expected.abs().max(1.0), "{name}: {sum}, not {expected}");
}

macro_rules! benches {
    ($function:ident, $t:ty, $name:literal, $tolerance:literal) => {
        fn $function(c: &mut Criterion) {
            let signal = signal();
            let inputs: Vec<$t> = signal.iter().map(|&x| x as $t).collect();
            let sum =
                |outputs: &mut dyn Iterator<Item = $t>| outputs.map(f64::from).map(f64::abs).sum::<f64>();
            let mut group = c.benchmark_group($name);
            group.throughput(Throughput::Elements(TICKS as u64));

            // The expected output from the difference equation, in f64.
            let (delay, alpha, gain) = LEAD;
            let lag = 2.0 * alpha * delay / (1.0 - alpha);
            let pole = (lag - 1.0 / RATE) / (lag + 1.0 / RATE);
            let rate = 2.0 * delay / (lag + 1.0 / RATE);
            let (mut x1, mut y1) = (0.0, 0.0);
            let (b0, b1) = (gain * (1.0 + rate), -gain * (pole + rate));
            let mut expected = 0.0_f64;
            for &x in &signal {
                let y = b0 * x + b1 * x1 + pole * y1;
                (x1, y1) = (x, y);
                expected += y.abs();
            }

            let lead = LeadNetwork::<$t>::new(gain, delay, alpha, RATE).unwrap();
            group.bench_function("lead network", |b| {
                b.iter(|| {
                    let mut state = LeadState::default();
                    let out = sum(&mut black_box(&inputs).iter().map(|&x| lead.step(&mut state, x)));
                    holds("lead", out, expected, $tolerance);
                })
            });
            let filter = idsp::iir::Biquad::<$t>::from([[b0 as $t, b1 as $t, 0.0], [1.0, -pole as $t, 0.0]]);
            group.bench_function("lead network by idsp", |b| {
                b.iter(|| {
                    let mut state = idsp::iir::DirectForm1::<$t>::default();
                    let out = sum(&mut black_box(&inputs).iter().map(|&x| filter.process(&mut state, x)));
                    holds("idsp", out, expected, $tolerance);
                })
            });
            let coefficients =
                biquad::Coefficients::<$t> { b0: b0 as $t, b1: b1 as $t, b2: 0.0, a1: -pole as $t, a2: 0.0 };
            group.bench_function("lead network by biquad", |b| {
                b.iter(|| {
                    let mut filter = biquad::DirectForm1::<$t>::new(coefficients);
                    let out = sum(&mut black_box(&inputs).iter().map(|&x| filter.run(x)));
                    holds("biquad", out, expected, $tolerance);
                })
            });

            let (openings, flows) = table();
            let table = FlowTable::<$t, 21>::new(&openings, &flows).unwrap();
            // The expected opening by a search for the segment, in f64.
            let opening = |q: f64| {
                let n = flows.iter().rposition(|&flow| flow <= q).unwrap_or(0).min(19);
                openings[n] + (q - flows[n]) / (flows[n + 1] - flows[n]) * 0.1
            };
            let expected = signal.iter().map(|&x| opening(8.0e-3 * x).abs()).sum::<f64>();
            let wanted: Vec<$t> = signal.iter().map(|&x| (8.0e-3 * x) as $t).collect();
            group.bench_function("table inverse", |b| {
                b.iter(|| {
                    let out = sum(&mut black_box(&wanted).iter().map(|&q| table.opening(q)));
                    holds("table", out, expected, $tolerance);
                })
            });

            let step = Compensation::<$t, 21>::new(&PARAMETERS).unwrap();
            // The expected output from the parts of the chain in f64: Eqs. (6) to (8).
            let (mut x1, mut y1) = (0.0, 0.0);
            let gain = 1.0 / (PARAMETERS.proportional_gain * PARAMETERS.valve_gain);
            let (b0, b1) = (gain * (1.0 + rate), -gain * (pole + rate));
            let mut expected = 0.0_f64;
            for &x in &signal {
                let share = 5.0e4 * x / (PARAMETERS.piston_area * PARAMETERS.supply_pressure);
                let sign = if x == 0.0 { 0.0 } else { x.signum() };
                let flow = PARAMETERS.piston_area * 0.5 * x / (1.0 - sign * share).sqrt();
                let required = opening(flow);
                let y = b0 * required + b1 * x1 + pole * y1;
                (x1, y1) = (required, y);
                expected += y.abs();
            }
            group.bench_function("full compensation step", |b| {
                b.iter(|| {
                    let (mut state, calibration) = (CompensationState::default(), step.nominal());
                    let out = sum(&mut black_box(&inputs).iter().map(|&x| {
                        let input = CompensationInput {
                            velocity: 0.5 * x,
                            force: 5.0e4 * x,
                            spool: x,
                            supply: 1.0,
                            further_flow: 0.0,
                        };
                        step.step(&mut state, &input, &calibration).value
                    }));
                    holds("step", out, expected, $tolerance);
                })
            });

            // The whole tick, of the paper's rig and of one that learns inline.
            for (name, parameters) in [("tick", &PARAMETERS), ("tick that learns", &ADAPTIVE)] {
                let channel = Channel::<$t, 21>::new(parameters).unwrap();
                let learner = Learner::<$t, 21>::new(parameters).unwrap();
                let run = || {
                    let (mut state, mut learned) = (channel.at_rest(), learner.at_rest());
                    let outputs = black_box(&inputs).iter().map(|&x| {
                        let input = Input {
                            command: 5.1e4 * x,
                            velocity: 0.5 * x,
                            force: 5.0e4 * x,
                            spool: x,
                            ..Input::default()
                        };
                        let out = channel.step(&mut state, &input);
                        if let Some(window) = out.window {
                            channel.publish(&mut state, learner.update(&mut learned, &window));
                        }
                        f64::from(out.voltage).abs()
                    });
                    outputs.sum::<f64>()
                };
                let expected = run();
                assert!(expected.is_finite() && expected > RATE, "{expected} V");
                group.bench_function(name, |b| b.iter(|| assert_eq!(run(), expected)));
            }
            group.finish();
        }
    };
}
benches!(single, f32, "f32", 1.0e-4);
benches!(double, f64, "f64", 1.0e-9);

criterion_group!(benches, single, double);
criterion_main!(benches);
