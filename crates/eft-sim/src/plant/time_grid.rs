//! The ticks of a test, the integration steps between them, and the longest step for a rig's effects.

use std::f64::consts::TAU;

use crate::config::RigConfig;
use crate::plant::{bypass_valve, structure};

/// The ticks of a test and the integration steps between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimeGrid {
    /// Ticks per second (Hz).
    pub(crate) sample_rate: f64,
    /// Integration steps per tick.
    pub(crate) steps: u32,
    /// Length of an integration step (s).
    pub(crate) step: f64,
}

impl TimeGrid {
    /// A grid with ticks per second (Hz) and integration steps per tick.
    pub(crate) fn new(sample_rate: f64, steps: u32) -> Self {
        Self { sample_rate, steps, step: 1.0 / sample_rate / f64::from(steps) }
    }

    /// Ticks that take a fraction of a second to compute. After so many a long loop asks whether to go on.
    pub(crate) fn ticks_per_check(&self) -> usize {
        (65_536 / self.steps).clamp(1, 1024) as usize
    }
}

/// The longest step (s) that the effects beyond the paper's model allow.
pub(crate) fn longest_step(rig: &RigConfig) -> f64 {
    let rig = rig.plant();
    let (actuator, supply) = (&rig.actuator, &rig.supply);
    let masses = (0..rig.structure.floors()).map(|n| rig.structure.story(n).mass);
    let mass = masses.fold(f64::INFINITY, f64::min);
    let friction = actuator.friction / (mass * actuator.friction_velocity);
    let stop = actuator.stop_stiffness.map_or(0.0, |k| (k / mass).sqrt());
    let accumulator = supply.droop.zip(supply.accumulator).map_or(0.0, |(r, c)| 1.0 / (r * c));
    // The reading follows the force and has hardly a transient of its own, so two fifths of the time constant do: on
    // laboratory rigs the traces change by less than 1e-4 of their peaks.
    let cell = 0.5 * rig.sensors.force.bandwidth.map_or(0.0, |f| TAU * f);
    let bypass = bypass_valve::fastest_rate(rig);
    let motor = rig.servovalve.torque_motor_frequency.map_or(0.0, |f| TAU * f);
    let fastest = [friction, stop, accumulator, cell, motor, bypass, structure::fastest_rate(rig)];
    // A fifth of the fastest time constant: well within the stability limit of 2.8, and accurate to 1e-5 per
    // step.
    0.2 / fastest.into_iter().fold(0.0, f64::max)
}
