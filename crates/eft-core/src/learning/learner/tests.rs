//! One update of a learner, with round numbers and filters that pass the last input.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod decisions;
mod measurements;

use super::{Learner, LearnerState};
use crate::learning::window::{Moment, Sums, Window};
use crate::parameters::{Learning, Parameters};

/// Ticks of a window.
const TICKS: f64 = 16.0;
/// Flow (m³/s) of an opened valve without a load.
const GREATEST: f64 = 8.0;
/// Force (N) of the whole supply pressure.
const MOST_FORCE: f64 = 2048.0;

/// A rig whose constants are powers of two: a window is 1/256 s.
const RIG: Parameters = Parameters {
    piston_area: 2.0,
    supply_pressure: 0.5 * MOST_FORCE,
    compressibility: 1.0 / 512.0,
    leakage: 1.0,
    openings: &[-1.0, 0.0, 1.0],
    flows: &[-GREATEST, 0.0, GREATEST],
    flow_gain: GREATEST,
    valve_gain: 0.5,
    feedforward: true,
    learning: Learning { guard: false, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};
/// Flow (m³/s) per force (N), and per change of force (N) over a window.
const LEAK: f64 = 0.5;
const VOLUME: f64 = 0.25;

/// With or without the correction of the flow table, and with every window in the evidence.
fn learner(curve_correction: bool) -> Learner<f64, 3> {
    let learning = Learning { curve_correction, ..RIG.learning };
    let mut learner = Learner::<f64, 3>::new(&Parameters { learning, ..RIG }).unwrap();
    learner.filter.low_pass = 1.0;
    learner.gate.excitation = -1.0;
    learner
}

/// The mean signals of a window.
#[derive(Clone, Copy, Default)]
struct Means {
    velocity: f64,
    force: f64,
    spool: f64,
    valve_command: f64,
    command: f64,
}

fn window(number: u32, means: Means) -> Window<f64> {
    let Means { velocity, force, spool, valve_command, command } = means;
    let sums = Sums { velocity, force, spool, command, valve_command, spool_without_command: 0.0 };
    let sums = Sums {
        velocity: TICKS * sums.velocity,
        force: TICKS * sums.force,
        spool: TICKS * sums.spool,
        command: TICKS * sums.command,
        valve_command: TICKS * sums.valve_command,
        ..sums
    };
    let moment = Moment { force, command };
    Window { number, lost: 0, lost_commands: 0, sums, start: moment, end: moment, supply: 1.0 }
}

/// The state after whole windows of these means, from the first number on.
fn after(learner: &Learner<f64, 3>, windows: &[Means]) -> LearnerState<f64> {
    let mut state = learner.at_rest();
    for (number, means) in (0..).zip(windows) {
        learner.update(&mut state, &window(number, *means));
    }
    state
}

fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}
