//! Bounds of the estimates, with a gate that accepts every window.

mod absurd;
mod closed_forms;
mod configured;
mod deviations;
mod established;
mod flows;
mod known_noise;
mod least_squares;
mod nodes;
mod restart;
mod saved;
mod times;
mod valves;

use super::*;
use crate::channel::{Channel, ChannelState};
use crate::parameters::{Learning, Parameters, Realization};
use crate::signals::Input;
use crate::status;
use crate::table::FlowTable;

/// A valve: true flow over the table's (1), the spool's gain over the configured one (1), delay (s).
type Valve = [f64; 3];
const SOUND: Valve = [1.0, 1.0, 5.0e-3];

/// The estimates for a valve after some seconds of a sine, the last flags, and the largest rates of the estimates (1/s).
fn found([flow_gain, valve_gain, delay]: Valve, learning: Learning) -> (Valve, u32, Valve) {
    let p = Parameters { realization: Realization::Analog, learning, ..Parameters::ZHAO2005 };
    let table = FlowTable::<f64, 21>::new(p.openings, p.flows).unwrap();
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let mut learner = Learner::<f64, 21>::new(&p).unwrap();
    learner.gate.threshold = 1.0;
    let (mut state, mut memory, mut flags) = (channel.at_rest(), learner.at_rest(), 0);
    let estimates = |state: &ChannelState<f64>| {
        let c = state.calibration();
        [c.flow_gain, c.valve_gain, c.response_delay]
    };
    let (mut before, mut rates) = (estimates(&state), [0.0; 3]);
    let wave = |time: f64| 0.3 * libm::sin(core::f64::consts::TAU * 0.8 * time);
    for tick in 0..20_000_u32 {
        let time = f64::from(tick) / p.sample_rate;
        let spool = valve_gain * wave(time - delay);
        let velocity = flow_gain * table.flow(spool) / p.piston_area;
        let valve_command = wave(time) / p.valve_gain;
        let input = Input { command: 0.0, velocity, force: 0.0, spool, valve_command, ..Input::default() };
        let out = channel.step(&mut state, &input);
        flags = out.status;
        if let Some(window) = out.window {
            channel.publish(&mut state, learner.update(&mut memory, &window));
            let now = estimates(&state);
            let window = f64::from(channel.window_ticks()) / p.sample_rate;
            for ((rate, now), before) in rates.iter_mut().zip(now).zip(before) {
                *rate = f64::max(*rate, (now - before).abs() / window);
            }
            before = now;
        }
    }
    (estimates(&state), flags, rates)
}

/// With wide bounds each estimate is near the true value. With the default ones it stops at its own bound.
#[test]
fn estimates_stop_at_their_bounds() {
    let bounded = Learning { guard: false, ..Learning::ADAPTIVE };
    let wide = [0.01, 10.0];
    let free =
        Learning { flow_gain_bounds: wide, valve_gain_bounds: wide, response_delay_bounds: wide, ..bounded };
    let [flow, spool, delay] = SOUND;
    let cases = [
        (0, [1.6, spool, delay], 1.35),
        (0, [0.5, spool, delay], 0.7),
        (1, [flow, 1.5, delay], 1.25),
        (1, [flow, 0.6, delay], 0.8),
        (2, [flow, spool, 30.0e-3], 20.0e-3),
        (2, [flow, spool, 0.5e-3], 1.0e-3),
    ];
    for (estimate, valve, bound) in cases {
        let of = |valve: Valve| valve.get(estimate).copied().unwrap();
        let (estimates, flags, _) = found(valve, free);
        assert!((of(estimates) - of(valve)).abs() < 0.16 * of(SOUND), "{estimates:?}");
        assert_eq!(flags & status::ESTIMATE_BOUNDED, 0);
        let (estimates, flags, _) = found(valve, bounded);
        assert!((of(estimates) - bound).abs() < 1e-3 * of(SOUND), "{estimates:?}");
        assert_ne!(flags & status::ESTIMATE_BOUNDED, 0);
    }
}

#[test]
fn estimates_change_at_limited_rates() {
    let wide = [0.01, 10.0];
    let free = Learning {
        flow_gain_bounds: wide,
        valve_gain_bounds: wide,
        response_delay_bounds: wide,
        ..Learning::ADAPTIVE
    };
    let (.., rates) = found([1.6, 1.5, 30.0e-3], Learning { guard: false, ..free });
    // The response delay's is twice the configured delay.
    for (rate, most) in rates.into_iter().zip([0.5, 0.2, 10.0e-3]) {
        assert!((rate / most - 1.0).abs() < 1e-6, "{rates:?}");
    }
}
