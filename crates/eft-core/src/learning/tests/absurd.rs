//! One absurd sample, for example by a flipped bit in a driver, on a rig without measurement ranges.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

extern crate std;

use std::{format, vec::Vec};

use super::*;

/// Finite samples that no signal of a rig can reach, in its unit.
const ABSURD: [f32; 8] = [1e6, -1e6, 1e12, -1e12, 1e30, -1e30, f32::MAX, f32::MIN];
/// Soft oil, with which the force loop is stable behind a valve that is a pure delay.
const RIG: Parameters = Parameters {
    compressibility: 7.56e-12,
    feedforward: true,
    valve_command: 10.0,
    learning: Learning::ADAPTIVE,
    ..Parameters::ZHAO2005
};
const SECOND: usize = 4096;
const LENGTH: usize = 6 * SECOND;
/// Delay of the valve (ticks).
const DELAY: usize = 24;

/// A signal of the input.
type Signal = fn(&mut Input<f32>) -> &mut f32;

/// A calibration's estimates: flow gain, valve gain, response delay over the configured one, level.
type Estimates = [f32; 4];

/// A valve with 0.95 of the table's flow and a longer delay against a piston that moves in a sine. One sample of a
/// signal may be replaced at a tick. Returns, for each tick, the estimates and whether learning is held off.
fn run(realization: Realization, fault: Option<(usize, Signal, f32)>) -> Vec<(Estimates, bool)> {
    let p = Parameters { realization, ..RIG };
    let channel = Channel::<f32, 21>::new(&p).unwrap();
    let learner = Learner::<f32, 21>::new(&p).unwrap();
    let table = FlowTable::<f64, 21>::new(p.openings, p.flows).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let (mut commands, mut valve_command) = ([0.0; DELAY], 0.0);
    let (mut force, mut last_error) = (0.0, 0.0);
    let tick = |tick: usize| {
        let time = tick as f64 / p.sample_rate;
        let wave = |size: f64, hertz: f64| size * libm::sin(core::f64::consts::TAU * hertz * time);
        let (velocity, command) = (wave(0.2, 1.5), wave(2e3, 1.1));
        let spool =
            (p.valve_gain * core::mem::replace(&mut commands[tick % DELAY], valve_command)).clamp(-1.0, 1.0);
        let mut input = Input {
            command: command as f32,
            velocity: velocity as f32,
            force: force as f32,
            spool: spool as f32,
            valve_command: valve_command as f32,
            ..Input::default()
        };
        if let Some((_, signal, sample)) = fault.filter(|(at, ..)| *at == tick) {
            *signal(&mut input) = sample;
        }
        let out = channel.step(&mut state, &input);
        // The analog controller has the same limit.
        let error = p.force_sensitivity * (command - force);
        let rate = (error - last_error) * p.sample_rate;
        last_error = error;
        let analog = p.proportional_gain * (error + f64::from(out.compensation)) + p.derivative_gain * rate;
        let digital = realization == Realization::Digital;
        valve_command = if digital { f64::from(out.voltage) } else { analog }.clamp(-10.0, 10.0);
        let load = 1.0 - spool.signum() * force / (p.piston_area * p.supply_pressure);
        let flow = 0.95 * table.flow(spool) * libm::sqrt(load.abs()) * load.signum();
        let pressed = flow - p.piston_area * velocity - p.leakage / p.piston_area * force;
        force += p.piston_area / p.compressibility * pressed / p.sample_rate;
        if let Some(window) = out.window {
            channel.publish(&mut state, learner.update(&mut memory, &window));
        }
        let c = state.calibration();
        let delay = c.response_delay / p.response_delay as f32;
        ([c.flow_gain, c.valve_gain, delay, c.level], out.status & status::ADAPTATION_FROZEN != 0)
    };
    (0..LENGTH).map(tick).collect()
}

#[test]
fn after_one_absurd_sample_learning_goes_on_within_a_second() {
    let signals: [(&str, Signal); 5] = [
        ("command", |i| &mut i.command),
        ("velocity", |i| &mut i.velocity),
        ("force", |i| &mut i.force),
        ("spool", |i| &mut i.spool),
        ("valve command", |i| &mut i.valve_command),
    ];
    for realization in [Realization::Analog, Realization::Digital] {
        let sound = run(realization, None);
        let (last, _) = sound[LENGTH - 1];
        for (value, expected) in last.into_iter().zip([0.95, 1.0, 1.2, 1.0]) {
            assert!((value - expected).abs() < 0.03, "{realization:?}: {last:?}");
        }
        // The last ticks of the first window, of one while little is known and of a later one, and a tick within.
        for at in [15, 415, 3 * SECOND - 1, 3 * SECOND + 7] {
            // At the start the controller drives the valve to its stops if the sample moves it, and the means become wrong.
            let skipped = if at < SECOND { 3 } else { 0 };
            let signals = signals.iter().skip(skipped);
            for ((name, signal), sample) in signals.flat_map(|s| ABSURD.map(|sample| (s, sample))) {
                let seen = run(realization, Some((at, *signal, sample)));
                let what = format!("{realization:?}, {name} {sample:e} at tick {at}");
                let after = &seen[at + SECOND..];
                assert!(after.iter().all(|(_, held_off)| !held_off), "{what}");
                // A velocity or a command drives the valve to its stops, which teaches something else.
                let most = match *name {
                    "command" | "velocity" => 0.5,
                    _ if at < SECOND => 0.05,
                    _ => 0.02,
                };
                for ((now, _), (expected, _)) in after.iter().zip(&sound[at + SECOND..]) {
                    let moved: [f32; 4] = core::array::from_fn(|n| (now[n] - expected[n]).abs());
                    assert!(moved.iter().all(|moved| *moved < most), "{what}: {now:?}, not {expected:?}");
                }
            }
        }
    }
}
