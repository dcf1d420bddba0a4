//! The overcompensation guard in a test.

use std::f64::consts::TAU;

use eft_core::guard_tuning::{AVERAGE, LOW_PASS, LOWEST_LEVEL, QUIET, REMOVAL, SLOW_AVERAGE};
use eft_core::learner_tuning::HIGH_PASS;

use crate::Result;
use crate::analysis::Guarded;
use crate::analysis::linear::{Complex, StateSpace};
use crate::analysis::prediction::signals::{Signals, Transform};
use crate::ground_motion::excitation::Command;

/// Whether a guard changes the level of a stable loop with this model: not if the motion stays too small.
pub(super) fn acts(guarded: &Guarded, model: &StateSpace, commands: &[Command]) -> Result<bool> {
    let Some(transform) = Transform::of(commands)? else { return Ok(false) };
    // The guard compares the excess with the square of the velocity over the sum of both squares.
    let quiet = QUIET * QUIET;
    let enough = quiet * (1.0 / (guarded.excess - 1.0)).max(1.0);
    for own in Signals::of(model, commands, &transform)? {
        let low_pass = |bin: usize| Complex::new(1.0, transform.frequency(bin) / LOW_PASS).powi(-2);
        let passed = own.velocity.iter().enumerate().map(|(bin, value)| value * low_pass(bin)).collect();
        let mut mean = 0.0;
        for velocity in transform.signal(passed)? {
            mean += (velocity * velocity - mean) / (AVERAGE * transform.sample_rate);
            if mean > enough {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// A guard on a loop with more compensation than it tolerates. All controllers of a building are taken to have the same
/// level.
pub(super) struct Guard {
    /// Factor (1) on the level.
    pub(super) level: f64,
    time: f64,
    motions: Vec<Motion>,
    /// Mean square of the velocity (m²/s²) times the overcompensation that is seen.
    pumped: f64,
    /// Mean squares of the velocity (m²/s²), the second over a longer time.
    squares: [f64; 2],
}

/// An actuator's velocity (m/s) as its guard sees it.
#[derive(Clone, Copy, Default)]
struct Motion {
    /// After one and after two low-passes.
    passed: [f64; 2],
    /// Mean of the velocity times the overcompensation, which the guard takes for an offset.
    offset: f64,
}

impl Guard {
    pub(super) fn at_rest(actuators: usize) -> Self {
        let motions = vec![Motion::default(); actuators];
        Self { level: 1.0, time: 0.0, motions, pumped: 0.0, squares: [0.0; 2] }
    }

    /// Adds the velocities (m/s) of a sample (s) with an overcompensation (1).
    pub(super) fn observe<'a>(&mut self, velocities: impl Iterator<Item = &'a f64>, over: f64, step: f64) {
        let (share, count) = (TAU * LOW_PASS * step, self.motions.len() as f64);
        self.time += step;
        let of_offset = (step / self.time).max(TAU * HIGH_PASS * step);
        let (mut square, mut pumped) = (0.0, 0.0);
        for (Motion { passed: [once, twice], offset }, velocity) in self.motions.iter_mut().zip(velocities) {
            *once += share * (velocity - *once);
            *twice += share * (*once - *twice);
            *offset += of_offset * (over * *twice - *offset);
            square += *twice * *twice / count;
            pumped += (over * *twice - *offset) * *twice / count;
        }
        self.pumped += (pumped - self.pumped) * step / AVERAGE;
        for (mean, time) in self.squares.iter_mut().zip([AVERAGE, SLOW_AVERAGE]) {
            *mean += (square - *mean) * step / time;
        }
    }

    /// Acts for a time (s).
    pub(super) fn act(&mut self, time: f64) {
        let ([square, slow], quiet) = (self.squares, QUIET * QUIET);
        if square > quiet && (square > slow || self.level < 1.0) {
            let change = self.pumped / (square + quiet) * time / REMOVAL;
            self.level = (self.level - change).clamp(LOWEST_LEVEL, 1.0);
        }
    }
}
