//! A channel that takes over a rig in motion, with and without a dead load.

use eft::core::Input;
use eft::core::status::{FORCE_LOOP_OPEN, TRIPPED};
use eft::sim::closed_loop::{PlantStepper, RigChannel, parameters};
use eft::sim::{RigConfig, SimulateOptions};

use crate::matrix::rig;
use crate::results::keep;

const RATE: f64 = 4096.0;
/// Ticks of a second.
const TICKS: u32 = 4096;

/// A sine of 3 kN at 1.5 Hz about a dead load (N) that is applied in two seconds.
fn command(tick: u32, load: f64) -> f64 {
    let time = f64::from(tick) / RATE;
    load * (0.5 * time).min(1.0) + 3e3 * (std::f64::consts::TAU * 1.5 * time).sin()
}

/// A channel with its plant and the number of the next tick.
#[derive(Clone)]
struct Loop {
    plant: PlantStepper,
    channel: RigChannel<f64>,
    tick: u32,
    load: f64,
}

impl Loop {
    fn new(rig: &RigConfig, load: f64) -> Self {
        let plant = PlantStepper::new(rig, RATE, &SimulateOptions::default()).unwrap();
        Self { plant, channel: channel(rig), tick: 0, load }
    }

    fn input(&self) -> Input<f64> {
        let now = self.plant.readings()[0];
        Input {
            command: command(self.tick, self.load),
            next_command: command(self.tick + 1, self.load),
            velocity: now.velocity,
            force: now.force,
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
            let mut running = Loop::new(&rig, load);
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
