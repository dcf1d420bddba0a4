//! A run in which an adaptive controller learns. The rig's valve passes more than its table says. A sample is lost now
//! and then. Towards the end the sensors are wrong, so that a protection trips.

use eft_core::Input;

use crate::{Hash, Xorshift};

/// Ticks of the run.
const TICKS: u32 = 100_000;
/// The sensors are wrong from this tick on.
const LYING: u32 = 80_000;

/// One tick's command and measurements, in SI units.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Force command (N).
    pub command: f32,
    /// The next tick's (N), for a rig that looks ahead: without noise, and NaN now and then.
    pub next_command: f32,
    /// Piston velocity (m/s).
    pub velocity: f32,
    /// Force (N).
    pub force: f32,
    /// Spool opening (1).
    pub spool: f32,
    /// Displacement (m).
    pub displacement: f32,
    /// Supply pressure (Pa).
    pub supply_pressure: f32,
}

impl Sample {
    /// As a channel takes it.
    pub fn input(&self) -> Input<f32> {
        let Self { command, next_command, velocity, force, spool, displacement, supply_pressure } = *self;
        Input {
            command,
            next_command,
            velocity,
            force,
            spool,
            displacement,
            supply_pressure,
            ..Input::default()
        }
    }
}

/// A slow swing between −1 and 1.
fn triangle(tick: u32) -> f32 {
    let phase = (tick & 0x3ff) as f32 / 256.0;
    if phase < 2.0 { phase - 1.0 } else { 3.0 - phase }
}

/// A sensor's reading: the true value with noise, or an invalid number.
fn report(random: &mut Xorshift, tick: u32, scale: f32, truth: f32) -> f32 {
    let noise = random.regular(5.0e-4 * scale);
    if tick < LYING {
        return if tick % 1009 == 1008 && random.next() % 4 == 0 { f32::NAN } else { truth + noise };
    }
    if tick & 0x700 == 0x400 { random.sample(scale) } else { truth + noise }
}

/// Valve command and flags of every tick.
pub fn learning(mut step: impl FnMut(&Sample) -> (f32, u32)) -> u64 {
    let (mut random, mut hash) = (Xorshift(20_051), Hash::EMPTY);
    let mut position = 0.0;
    for tick in 0..TICKS {
        let (swing, opening) = (triangle(tick), 0.3 * triangle(tick));
        // Within 1 % of the rigs' tables, times 1.05, over the piston area.
        let velocity = (2.293 - 1.579 * opening.abs()) * opening;
        position += velocity * (1.0 / 4096.0);
        let mut report = |scale: f32, truth: f32| report(&mut random, tick, scale, truth);
        let sample = Sample {
            command: report(1.0e4, 2.0e3 * swing),
            next_command: if tick % 1013 == 1012 { f32::NAN } else { 2.0e3 * triangle(tick + 1) },
            velocity: report(1.0, velocity),
            force: report(1.5e5, 1.9e3 * swing),
            spool: report(1.0, opening),
            displacement: report(0.127, position),
            supply_pressure: report(1.9e7, 1.9e7),
        };
        let (valve_command, status) = step(&sample);
        hash.add(valve_command.to_bits());
        hash.add(status);
    }
    hash.get()
}
