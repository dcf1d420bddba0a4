//! Overcompensation guard: it reduces the level before the structure's motion grows.
//!
//! Compensation above the piston's flow gives a force error in phase with the velocity. The actuator then feeds energy
//! into the structure, beyond an overcompensation of `c/c_add` more than the damping dissipates. The guard measures this
//! error. It needs neither frequency nor damping of the structure, and acts before the motion has grown.
//!
//! The command's own flow makes a force error as well, unless a feedforward supplies it. In phase with the velocity it would
//! look like overcompensation, so the guard subtracts it. An integral part of the loop removes most of a slow error, so the
//! guard adds what this part supplies instead of the error.

#[cfg(test)]
mod tests;
pub mod tuning;

use crate::integrity::integrity;
use crate::number::Real;

/// Constants of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guard<T> {
    /// Overcompensation (1) per force error in phase with a velocity (N·s/m): the inverse of the natural velocity
    /// feedback `c_add`.
    pub(crate) per_added_damping: T,
    /// Force error (N) of the loop per flow (m³/s) that was not demanded.
    pub(crate) force_per_flow: T,
    /// 1 with a feedforward of the command's flow, else 0.
    pub(crate) fed_forward: T,
    /// Share of the error that the loop's integral part supplies after a step; 0 without this part.
    pub(crate) integrated: T,
    /// Share of the two equal low-passes of error and velocity in a step. Above their corner the loop follows the noise of
    /// its sensors.
    pub(crate) low_pass: T,
    /// Share of the averages in a step.
    pub(crate) average: T,
    /// The same for the slow average with which the motion is compared.
    pub(crate) slow_average: T,
    /// Mean square of the velocity (m²/s²) below which the guard does not act.
    pub(crate) quiet: T,
    /// Overcompensation (1) that is tolerated.
    pub(crate) tolerated: T,
    /// Share of the overcompensation that is removed in a step.
    pub(crate) correction: T,
    /// Lowest level (1).
    pub(crate) lowest: T,
}
integrity!(Guard<T>: per_added_damping, force_per_flow, fed_forward, integrated, low_pass, average, slow_average, quiet, tolerated, correction, lowest);

/// The state of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct GuardState<T> {
    error: LowPass<T>,
    velocity: LowPass<T>,
    /// Force error (N) that the loop's integral part has removed.
    integral: T,
    /// Mean of the error, which offsets of the sensors cause.
    mean_error: T,
    pumped: T,
    squares: T,
    slow_squares: T,
    pub(crate) level: T,
}
integrity!(GuardState<T>: error, velocity, integral, mean_error, pumped, squares, slow_squares, level);

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
            integral: zero,
            mean_error: zero,
            pumped: zero,
            squares: zero,
            slow_squares: zero,
            level: T::splat(1.0),
        }
    }
}

impl<T: Real> Guard<T> {
    /// Adds force error (N, measured less command), flow (m³/s) of the actuator beyond the demanded one, and velocity
    /// (m/s).
    pub(crate) fn observe(&self, state: &mut GuardState<T>, error: T, undemanded: T, velocity: T) {
        state.integral = T::splat(tuning::KEPT) * state.integral + self.integrated * error;
        let without_integral = error + state.integral;
        state.error = state.error.after(without_integral + self.force_per_flow * undemanded, self.low_pass);
        state.velocity = state.velocity.after(velocity, self.low_pass);
        let error = state.error.second - state.mean_error;
        let velocity = state.velocity.second;
        let square = velocity * velocity;
        state.pumped = state.pumped + self.average * (error * velocity - state.pumped);
        state.squares = state.squares + self.average * (square - state.squares);
        state.slow_squares = state.slow_squares + self.slow_average * (square - state.slow_squares);
    }

    /// Follows the mean error by a `share` of the difference.
    pub(crate) fn follow_offset(&self, state: &mut GuardState<T>, share: T) {
        state.mean_error = state.mean_error + share * (state.error.second - state.mean_error);
    }

    /// Changes the level until the error feeds no energy into the motion and takes none. It begins if the overcompensation
    /// exceeds the tolerance and the motion grows, and ends when the level is 1 again.
    pub(crate) fn act(&self, state: &mut GuardState<T>) {
        let one = T::splat(1.0);
        // At a very small motion offsets and noise dominate.
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
