//! A channel that takes over a rig in motion, with and without a dead load.

use eft::core::Input;
use eft::core::status::{FORCE_LOOP_OPEN, TRIPPED};
use eft::sim::closed_loop::{PlantStepper, RigChannel, parameters};
use eft::sim::{RigConfig, SimulateOptions};

use crate::matrix::rig;
use crate::results::keep;
use crate::sizes::benches;

const RATE: f64 = 4096.0;
/// Ticks of a second.
const TICKS: u32 = 4096;

/// A sine (N, Hz) about a dead load (N) that is applied in two seconds.
fn command(tick: u32, load: f64, [amplitude, frequency]: [f64; 2]) -> f64 {
    let time = f64::from(tick) / RATE;
    load * (0.5 * time).min(1.0) + amplitude * (std::f64::consts::TAU * frequency * time).sin()
}

/// A channel with its plant and the number of the next tick.
#[derive(Clone)]
struct Loop {
    plant: PlantStepper,
    channel: RigChannel<f64>,
    tick: u32,
    load: f64,
    sine: [f64; 2],
    has_force: bool,
}

impl Loop {
    fn new(rig: &RigConfig, load: f64, sine: [f64; 2]) -> Self {
        let plant = PlantStepper::new(rig, RATE, &SimulateOptions::default()).unwrap();
        Self { plant, channel: channel(rig), tick: 0, load, sine, has_force: true }
    }

    fn input(&self) -> Input<f64> {
        let now = self.plant.readings()[0];
        Input {
            command: command(self.tick, self.load, self.sine),
            next_command: command(self.tick + 1, self.load, self.sine),
            velocity: now.velocity,
            force: if self.has_force { now.force } else { f64::NAN },
            spool: now.spool,
            displacement: now.displacement,
            ..Input::default()
        }
    }

    /// The largest force error (N) of a number of ticks, and all flags.
    fn run(&mut self, ticks: u32) -> (f64, u32) {
        let (mut error, mut flags) = (0.0_f64, 0);
        for _ in 0..ticks {
            let input = self.input();
            let out = self.channel.step(&input);
            (error, flags) = (error.max((input.command - input.force).abs()), flags | out.status);
            self.plant.step(&[out.voltage]).unwrap();
            self.tick += 1;
        }
        (error, flags)
    }
}

fn channel(rig: &RigConfig) -> RigChannel<f64> {
    RigChannel::new(&parameters(rig, RATE).unwrap(), None).unwrap()
}

#[test]
fn a_primed_channel_takes_over_a_moving_specimen_under_a_dead_load() {
    for adaptive in [false, true] {
        let rig = rig("digital", adaptive, false, &[]);
        let mut worst = 0.0_f64;
        for load in [0.0, 10e3, -10e3] {
            let mut running = Loop::new(&rig, load, [3e3, 1.5]);
            running.run(4 * TICKS);
            for moment in 0..8 {
                running.run(TICKS / 12);
                let mut primed = Loop { channel: channel(&rig), ..running.clone() };
                primed.channel.prime(&primed.input());
                let (error, flags) = primed.run(TICKS);
                let what = format!("adaptive {adaptive}, {load} N, moment {moment}");
                assert_eq!(flags & (TRIPPED | FORCE_LOOP_OPEN), 0, "{what}");
                worst = worst.max(error);
            }
        }
        keep(format_args!("primed in motion, adaptive {adaptive}"), &[("force error", worst)]);
        // A channel at rest makes an error of at least 2.4 kN, and trips at most moments.
        assert!(worst < 1.5e3, "adaptive {adaptive}: {worst} N");
    }
}

#[test]
fn a_null_bias_that_is_known_stays_known() {
    let [_, _, small, _] = benches();
    let mut worst = [0.0_f64; 2];
    for bias in [0.005, 0.02] {
        let rig = small.rig.replace(&[("truth.servovalve.null_bias", bias.into())]).unwrap();
        let mut running = Loop::new(&rig, 0.0, small.sine);
        running.run(3 * TICKS);
        for (primed, worst) in [false, true].into_iter().zip(&mut worst) {
            let mut lost = running.clone();
            if primed {
                lost.channel.prime(&lost.input());
            }
            lost.run(TICKS / 100);
            lost.has_force = false;
            for _ in 0..TICKS {
                lost.run(1);
                *worst = worst.max(lost.plant.readings()[0].force.abs() / small.force_trip);
            }
        }
    }
    let [not_primed, primed] = worst;
    keep("load cell lost after a prime", &[("not primed", not_primed), ("primed", primed)]);
    assert!(primed < 1.02 * not_primed, "{primed} times the level, and {not_primed} without a prime");
}
