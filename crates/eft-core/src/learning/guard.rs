//! Overcompensation guard: takes the level back before the structure swings up.
//!
//! Compensation above the piston's flow gives the force an error in phase with the velocity: the actuator then pumps
//! energy into the structure, and past `c/c_add` more than its damping takes out. The guard watches that error
//! itself, so it needs neither the structure's frequency nor its damping, and it sees the pump before the motion
//! has had time to grow.

use crate::integrity::integrity;
use crate::number::Real;

/// Constants of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guard<T> {
    /// Overcompensation (1) per force error in phase with a velocity (N·s/m): the inverse of the natural velocity
    /// feedback `c_add`.
    pub(crate) per_added_damping: T,
    /// Force error (N) that the loop leaves per flow (m³/s) that was not demanded.
    pub(crate) force_per_flow: T,
    /// 1 where the command's own flow is demanded, 0 where it is not.
    pub(crate) fed_forward: T,
    /// Share of the way that the two equal low-passes of error and velocity go in a step: above them the loop
    /// follows its sensors' noise.
    pub(crate) low_pass: T,
    /// Share of the way that the averages go to their input in a step.
    pub(crate) average: T,
    /// The same of the slow average that the motion is held against.
    pub(crate) slow_average: T,
    /// Mean square of a velocity (m²/s²) below which the guard has no voice.
    pub(crate) quiet: T,
    /// Overcompensation (1) that is tolerated.
    pub(crate) tolerated: T,
    /// Share of the overcompensation that is taken back in a step.
    pub(crate) correction: T,
    /// Lowest level (1) the guard goes to.
    pub(crate) lowest: T,
}
integrity!(Guard<T>: per_added_damping, force_per_flow, fed_forward, low_pass, average, slow_average, quiet, tolerated, correction, lowest);

/// What the guard remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct GuardState<T> {
    error: LowPass<T>,
    velocity: LowPass<T>,
    /// Of the error: what offsets of sensors make.
    mean_error: T,
    pumped: T,
    squares: T,
    slow_squares: T,
    pub(crate) level: T,
}
integrity!(GuardState<T>: error, velocity, mean_error, pumped, squares, slow_squares, level);

/// Two equal first-order low-passes in series.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
struct LowPass<T> {
    first: T,
    second: T,
}
integrity!(LowPass<T>: first, second);

impl<T: Real> LowPass<T> {
    fn after(self, input: T, share: T) -> Self {
        let first = self.first + share * (input - self.first);
        Self { first, second: self.second + share * (first - self.second) }
    }
}

impl<T: Real> Default for GuardState<T> {
    fn default() -> Self {
        let zero = T::splat(0.0);
        Self {
            error: LowPass::default(),
            velocity: LowPass::default(),
            mean_error: zero,
            pumped: zero,
            squares: zero,
            slow_squares: zero,
            level: T::splat(1.0),
        }
    }
}

impl<T: Real> Guard<T> {
    /// Takes in force error (N, measured less command), flow (m³/s) that the actuator took beyond what was demanded
    /// for it, and velocity (m/s).
    pub(crate) fn observe(&self, state: &mut GuardState<T>, error: T, undemanded: T, velocity: T) {
        state.error = state.error.after(error + self.force_per_flow * undemanded, self.low_pass);
        state.velocity = state.velocity.after(velocity, self.low_pass);
        let error = state.error.second - state.mean_error;
        let velocity = state.velocity.second;
        let square = velocity * velocity;
        state.pumped = state.pumped + self.average * (error * velocity - state.pumped);
        state.squares = state.squares + self.average * (square - state.squares);
        state.slow_squares = state.slow_squares + self.slow_average * (square - state.slow_squares);
    }

    /// Follows the error that offsets make, by a `share` of the way.
    pub(crate) fn follow_offset(&self, state: &mut GuardState<T>, share: T) {
        state.mean_error = state.mean_error + share * (state.error.second - state.mean_error);
    }

    /// Acts where the error pumps more than is tolerated into a motion that grows, and then until the level is back
    /// at 1: moves the level until the error neither pumps nor drains.
    pub(crate) fn act(&self, state: &mut GuardState<T>) {
        let one = T::splat(1.0);
        // Where hardly anything moves, offsets and noise would have a voice.
        if !(state.squares > self.quiet) {
            return;
        }
        let over = state.pumped * self.per_added_damping / (state.squares + self.quiet);
        let pumps = over > self.tolerated && state.squares > state.slow_squares;
        if pumps || state.level < one {
            state.level = (state.level - self.correction * over).limit(self.lowest, one);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GUARD: Guard<f64> = Guard {
        per_added_damping: 1e-5,
        force_per_flow: 0.0,
        fed_forward: 1.0,
        low_pass: 0.1,
        average: 0.02,
        slow_average: 0.005,
        quiet: 1e-6,
        tolerated: 0.01,
        correction: 0.01,
        lowest: 0.5,
    };

    /// The level after a growing swing of period 160 windows with this error (N per m/s) in phase with the velocity,
    /// or a quarter of a period behind.
    fn level(in_phase: f64, behind: f64) -> f64 {
        let mut state = GuardState::default();
        for n in 0..640_u32 {
            let t = f64::from(n);
            let (sin, cos) = (t * core::f64::consts::TAU / 160.0).sin_cos();
            let size = 0.1 * (t / 200.0).exp();
            let error = size * (in_phase * sin - behind * cos);
            GUARD.observe(&mut state, error, 0.0, size * sin);
            GUARD.act(&mut state);
        }
        state.level
    }

    #[test]
    fn a_pump_takes_the_level_back_and_nothing_else_does() {
        // 5 % of the natural velocity feedback pumped in.
        assert!(level(5e3, 0.0) < 0.97);
        for (in_phase, behind) in [(0.0, 0.0), (-5e3, 0.0), (5e2, 0.0), (0.0, 5e3)] {
            assert!((level(in_phase, behind) - 1.0).abs() < 1e-12, "{in_phase} {behind}");
        }
        assert!((level(1e9, 0.0) - GUARD.lowest).abs() < 1e-12);
    }
}
