//! A learner that starts from what another has saved: the same calibration and deviations, also in the other precision
//! and at another sample rate.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

extern crate std;

use std::{format, vec::Vec};

use super::*;
use crate::compensation::{Calibration, Deviations, LeadNetwork};
use crate::learning::learner::LearnerState;
use crate::learning::saved::SavedCalibration;
use crate::learning::{Learner, Window};
use crate::number::Real;

const RIG: Parameters = Parameters {
    realization: Realization::Analog,
    learning: Learning { guard: false, curve_correction: true, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};

/// A motion: its frequency (1/s), the lateness (s) of the velocity's sensor, and noise of velocity (m/s) and spool (1).
#[derive(Clone, Copy, Debug)]
struct Motion {
    frequency: f64,
    late: f64,
    noise: f64,
}

/// In the second motion most of the response delay's deviation is systematic, so it does not show the frequency.
const MOTIONS: [Motion; 3] = [
    Motion { frequency: 5.0, late: 0.0, noise: 1e-3 },
    Motion { frequency: 25.0, late: 1.5e-3, noise: 1e-5 },
    Motion { frequency: 40.0, late: -1e-3, noise: 1e-4 },
];

/// Noise between -1 and 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Learns from a motion between two times (s), and returns its windows. The valve differs from the table by gain, direction and null offset.
fn learn(
    p: &Parameters,
    motion: Motion,
    [start, end]: [f64; 2],
    learner: &Learner<f64, 21>,
    memory: &mut LearnerState<f64>,
) -> Vec<Window<f64>> {
    let channel = Channel::<f64, 21>::new(p).unwrap();
    let table = FlowTable::<f64, 21>::new(p.openings, p.flows).unwrap();
    let (mut state, mut noise, mut windows) = (channel.at_rest(), Noise(1), Vec::new());
    for tick in (start * p.sample_rate) as u32..(end * p.sample_rate) as u32 {
        let time = f64::from(tick) / p.sample_rate;
        let wave = |time: f64| 0.3 * time.clamp(0.0, 1.0) * libm::sin(motion.frequency * time);
        let spool = |time: f64| 1.03 * wave(time - 7e-3);
        let opening = spool(time - motion.late);
        let sided = if opening > 0.0 { 1.02 } else { 0.98 };
        let velocity = 1.06 * sided * table.flow(opening - 0.01) / p.piston_area;
        let input = Input {
            command: 0.0,
            force: 0.0,
            velocity: velocity + motion.noise * noise.next(),
            spool: spool(time) + motion.noise * noise.next(),
            valve_command: wave(time) / p.valve_gain,
            ..Input::default()
        };
        if let Some(window) = channel.step(&mut state, &input).window {
            channel.publish(&mut state, learner.update(memory, &window));
            windows.push(window);
        }
    }
    windows
}

/// A learner after four seconds of a motion.
fn learned(p: &Parameters, motion: Motion) -> (Learner<f64, 21>, LearnerState<f64>) {
    let learner = Learner::<f64, 21>::new(p).unwrap();
    let mut memory = learner.at_rest();
    learn(p, motion, [0.0, 4.0], &learner, &mut memory);
    // Lost windows teach nothing. Meanwhile every node of the curve is refreshed.
    for number in 0..1000 {
        learner.update(&mut memory, &Window { lost: 1, ..Window::first(number) });
    }
    assert!(memory.evidence.amount > 1e-3, "{motion:?}: {memory:?}");
    (learner, memory)
}

/// Every number of a calibration but its window, its deviations and its test ratio.
fn numbers<T: Real>(c: &Calibration<T>) -> Vec<f64> {
    let lead = [c.lead.pole(), c.lead.rate(), c.lead.gain()];
    let estimates =
        [c.flow_gain, c.valve_gain, c.response_delay, c.velocity_delay, c.null_offset, c.null_signal];
    // The offsets as shares of 0.1 m³/s.
    let curve = c.curve.iter().flat_map(|piece| [10.0 * piece.offset.to_f64(), piece.slope.to_f64()]);
    lead.into_iter().chain(estimates).map(T::to_f64).chain(curve).collect()
}

fn same(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    for (n, (found, expected)) in found.iter().zip(expected).enumerate() {
        let near = (found - expected).abs() <= tolerance * (expected.abs() + 1e-2);
        assert!(near, "{what}, {n}: {found:e}, not {expected:e}");
    }
}

/// The deviations, over those that are expected.
fn ratios<T: Real>(found: &Deviations<T>, expected: &Deviations<f64>) -> [f64; 5] {
    let each =
        |d: &Deviations<f64>| [d.flow_gain, d.valve_gain, d.response_delay, d.velocity_delay, d.null_offset];
    let found = Deviations {
        flow_gain: found.flow_gain.to_f64(),
        valve_gain: found.valve_gain.to_f64(),
        response_delay: found.response_delay.to_f64(),
        velocity_delay: found.velocity_delay.to_f64(),
        null_offset: found.null_offset.to_f64(),
    };
    let (found, expected) = (each(&found), each(expected));
    core::array::from_fn(|n| found[n] / expected[n])
}

/// The calibration that starts from what was saved, and the mean-square frequency (1/s²) of its motion.
fn restarted<T: Real>(learner: &Learner<T, 21>, saved: &SavedCalibration) -> (Calibration<T>, f64) {
    let state = learner.start_from(saved).unwrap();
    let square = learner.valve.mean_square_frequency(&state.evidence.valve);
    (learner.first_calibration(&state), square.to_f64())
}

#[test]
fn a_restart_changes_no_number_of_a_calibration() {
    for motion in MOTIONS {
        let what = format!("{motion:?}");
        let (learner, memory) = learned(&RIG, motion);
        let (saved, before) = (learner.saved(&memory), learner.first_calibration(&memory));
        let square = learner.valve.mean_square_frequency(&memory.evidence.valve);
        let share = square / (motion.frequency * motion.frequency);
        assert!((0.5..2.0).contains(&share), "{what}: {share}");
        let (now, found) = restarted(&learner, &saved);
        same(&what, &[found], &[square], 1e-12);
        same(&what, &numbers(&now), &numbers(&before), 1e-11);
        same(&what, &ratios(&now.deviations, &before.deviations), &[1.0; 5], 1e-9);
        // Single precision, and back.
        let single = Learner::<f32, 21>::new(&RIG).unwrap();
        let (now, found) = restarted(&single, &saved);
        same(&what, &[found], &[square], 1e-6);
        same(&what, &numbers(&now)[..9], &numbers(&before)[..9], 1e-6);
        same(&what, &numbers(&now)[9..], &numbers(&before)[9..], 1e-5);
        same(&what, &ratios(&now.deviations, &before.deviations), &[1.0; 5], 1e-4);
        let again = single.saved(&single.start_from(&saved).unwrap());
        let (now, _) = restarted(&learner, &again);
        same(&what, &numbers(&now)[..9], &numbers(&before)[..9], 1e-6);
        same(&what, &numbers(&now)[9..], &numbers(&before)[9..], 1e-5);
        same(&what, &ratios(&now.deviations, &before.deviations), &[1.0; 5], 1e-3);
    }
}

/// The first new window that teaches something replaces little of what was learned in four seconds.
#[test]
fn the_share_of_the_flow_gain_outlasts_a_restart() {
    for motion in MOTIONS {
        let (learner, memory) = learned(&RIG, motion);
        let mut saved = learner.saved(&memory);
        saved.curve.flow_gain_share = 0.05;
        let mut state = learner.start_from(&saved).unwrap();
        let mut other = state;
        let windows = learn(&RIG, motion, [4.0, 5.0], &learner, &mut other);
        let mut shares = windows.iter().map(|window| {
            learner.update(&mut state, window);
            learner.saved(&state).curve.flow_gain_share
        });
        let share = shares.find(|share| (share - 0.05).abs() > 1e-6).unwrap();
        assert!((0.045..0.055).contains(&share), "{motion:?}: {share}");
    }
}

/// The network is discretised at the sample rate. Its gain and its delay are those of the motion.
#[test]
fn a_restart_at_another_rate_has_the_same_network() {
    let delay = |lead: LeadNetwork<f64>, rate: f64| (1.0 + lead.pole()) / (1.0 - lead.pole()) / rate;
    for motion in MOTIONS {
        let (learner, memory) = learned(&RIG, motion);
        let (saved, before) = (learner.saved(&memory), learner.first_calibration(&memory));
        let square = learner.valve.mean_square_frequency(&memory.evidence.valve);
        for sample_rate in [2048.0, 8192.0, 10_000.0] {
            let what = format!("{motion:?}, {sample_rate} Hz");
            let other = Learner::<f64, 21>::new(&Parameters { sample_rate, ..RIG }).unwrap();
            let (now, found) = restarted(&other, &saved);
            same(&what, &[found], &[square], 1e-9);
            let [then, now_delay] = [delay(before.lead, RIG.sample_rate), delay(now.lead, sample_rate)];
            same(&what, &[now.lead.gain(), 1e3 * now_delay], &[before.lead.gain(), 1e3 * then], 1e-9);
            same(&what, &numbers(&now)[3..], &numbers(&before)[3..], 1e-9);
            let again = other.saved(&other.start_from(&saved).unwrap());
            let (back, _) = restarted(&learner, &again);
            same(&what, &ratios(&back.deviations, &before.deviations), &[1.0; 5], 1e-6);
        }
    }
}
