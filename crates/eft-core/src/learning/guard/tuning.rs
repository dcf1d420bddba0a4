//! Constants of the guard against overcompensation, for predictions of what it does.

/// Overcompensation (1) at which the guard begins to act.
pub const TOLERATED: f64 = 1.0e-2;
/// The same (1) with an integral part in the loop. The loop then remains stable at such an excess, and an overlap or a flow
/// curve that nobody told has the same effect for moments.
pub const TOLERATED_WITH_INTEGRAL: f64 = 3.0e-2;
/// Corner (Hz) of the guard's two equal low-passes, above the structure's frequency.
pub const LOW_PASS: f64 = 4.0;
/// Time (s) over which the guard averages.
pub const AVERAGE: f64 = 0.2;
/// Time (s) of the slower average, with which the guard tells a growing motion from one that decays.
pub const SLOW_AVERAGE: f64 = 4.0 * AVERAGE;
/// Share (1) of the guard's integral that is kept over a window of about 4 ms. It is forgotten in about 10 s, long beside a
/// period of the structure.
pub(super) const KEPT: f64 = 0.9996;
/// Time (s) in which the guard removes overcompensation.
pub const REMOVAL: f64 = 0.33;
/// Velocity (m/s) below which the guard does not act.
pub const QUIET: f64 = 5.0e-3;
/// Lowest factor (1) of the guard on the level.
pub const LOWEST_LEVEL: f64 = 0.5;
