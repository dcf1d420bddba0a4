//! The limits and the state of each comparison.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::plausibility::sums::{Began, Evidence, Sum};

/// The coefficients and limits of the flow balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BalanceLimits<T> {
    /// Coefficient (1) of the high-passes.
    pub(in crate::protection) high: T,
    /// Share (1) of the envelopes above the motion's frequencies that remains in a sample.
    pub(in crate::protection) fast_decay: T,
    /// Residuals (m³/s) by noise and offsets, slow and fast.
    pub(in crate::protection) drift: T,
    pub(in crate::protection) fast_drift: T,
    /// Flow (m³/s) that an overlap of the spool may block.
    pub(in crate::protection) null_drift: T,
    /// Limits (m³) of the sums.
    pub(in crate::protection) slow: T,
    pub(in crate::protection) fast: T,
    pub(in crate::protection) turned: T,
}
integrity!(BalanceLimits<T>: high, fast_decay, drift, fast_drift, null_drift, slow, fast, turned);

/// The state of the flow balance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Balance<T> {
    /// Time (s) since the first sample, until the low-passes have settled.
    pub(super) age: T,
    /// The valve's last flow (m³/s).
    pub(super) flow: T,
    /// Low-passed: flow of the valve, flow of piston and leakage (m³/s), force (N).
    pub(super) passed: T,
    pub(super) taken: T,
    pub(super) force: T,
    /// High-passes of the residual, the valve's flow and the oil's flow (m³/s).
    pub(super) residual_above: [T; 2],
    pub(super) passed_above: [T; 2],
    pub(super) oil_above: [T; 2],
    /// Envelopes (m³/s) of the larger flow, and of those above the motion's frequencies.
    pub(super) most_flow: T,
    pub(super) most_passed_above: T,
    pub(super) most_oil_above: T,
    /// Recent nearness of the spool to null (1).
    pub(super) near_null: T,
    /// Sums (m³) of the slow and the fast residual, and of a force of the wrong sign.
    pub(super) slow: Sum<T>,
    pub(super) fast: Sum<T>,
    pub(super) turned: Sum<T>,
}
integrity!(Balance<T>: age, flow, passed, taken, force, residual_above, passed_above, oil_above, most_flow, most_passed_above, most_oil_above, near_null, slow, fast, turned);

/// The limits of velocity and displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MotionLimits<T> {
    /// Differences (m/s) by noise, of travel and ratio.
    pub(in crate::protection) drift: T,
    pub(in crate::protection) ratio_drift: T,
    /// Limits (m) of the sums.
    pub(in crate::protection) travel: T,
    pub(in crate::protection) ratio: T,
    /// Largest time (s) between velocity and displacement.
    pub(in crate::protection) late: T,
}
integrity!(MotionLimits<T>: drift, ratio_drift, travel, ratio, late);

/// The state of velocity and displacement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Motion<T> {
    /// The last velocity (m/s) and displacement (m).
    pub(super) last_velocity: T,
    pub(super) last_displacement: T,
    /// Low-passed velocity (m/s) and displacement (m).
    pub(super) velocity: T,
    pub(super) displacement: T,
    /// Velocity, its difference from the displacement's (m/s), and the flow's residual (m³/s), with a further low-pass.
    pub(super) fine_velocity: T,
    pub(super) fine_off: T,
    pub(super) fine_residual: T,
    /// Envelope (m/s) of the larger velocity.
    pub(super) fastest: T,
    /// Sums (m) of travel and ratio, and the velocities at which they began.
    pub(super) travel: Sum<T>,
    pub(super) ratio: Sum<T>,
    pub(super) travel_began: Began<T>,
    pub(super) ratio_began: Began<T>,
    /// Average (m⁴/s²) of the squared flow residual with the velocity minus that with the displacement, over twice the
    /// piston area.
    pub(super) worse: T,
    /// The same average of the square of the faster one of velocity and displacement (m²/s²).
    pub(super) swept: T,
    /// Evidence about the motion since the sum of the travel began.
    pub(super) evidence: Evidence<T>,
    /// Whether this sample follows the last displacement.
    pub(super) goes_on: bool,
}
integrity!(Motion<T>: last_velocity, last_displacement, velocity, displacement, fine_velocity, fine_off, fine_residual, fastest, travel, ratio, travel_began, ratio_began, worse, swept, evidence, goes_on);

/// The limits of the spool and its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StrokeLimits<T> {
    /// Coefficient (1) of the valve model's two lags.
    pub(in crate::protection) lag: T,
    /// Differences (1) by noise and offsets, and by noise in a motion against the command.
    pub(in crate::protection) drift: T,
    pub(in crate::protection) against_drift: T,
    /// Limits (s) of the sums.
    pub(in crate::protection) difference: T,
    pub(in crate::protection) against: T,
}
integrity!(StrokeLimits<T>: lag, drift, against_drift, difference, against);

/// The state of the spool and its command: openings (1).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Stroke<T> {
    /// The valve model's opening after its first lag and after both.
    pub(super) first: T,
    pub(super) opening: T,
    /// Low-passed: the valve model's opening and the spool's, and their means.
    pub(super) asked: T,
    pub(super) reached: T,
    pub(super) asked_mean: T,
    pub(super) reached_mean: T,
    /// Envelope of the larger opening.
    pub(super) widest: T,
    /// Sums (s) of the difference, and of a motion against the command.
    pub(super) difference: Sum<T>,
    pub(super) against: Sum<T>,
}
integrity!(Stroke<T>: first, opening, asked, reached, asked_mean, reached_mean, widest, difference, against);

impl<T: Real> Stroke<T> {
    /// The state of a spool at rest at an opening (1).
    pub(super) fn at(opening: T) -> Self {
        let [first, asked, reached, asked_mean, reached_mean] = [opening; 5];
        Self { first, opening, asked, reached, asked_mean, reached_mean, ..Self::default() }
    }
}

/// Coefficients of the followed motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Following<T> {
    /// Coefficient (1) of the low-pass of the velocity by the flow balance.
    pub(in crate::protection) moved: T,
    /// Share (1) of the step between two sources of the velocity that remains after a sample.
    pub(in crate::protection) fade: T,
    /// The brake's largest force (N), and the reciprocal of the velocity (s/m) from which on it has this force.
    pub(in crate::protection) brake: T,
    pub(in crate::protection) per_braked: T,
}
integrity!(Following<T>: moved, fade, brake, per_braked);

/// The followed motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct Followed<T> {
    /// The last velocity (m/s), and the remaining step from the previous source (m/s).
    pub(super) velocity: T,
    pub(super) step: T,
    /// The low-passed velocity (m/s) of the brake.
    pub(super) braked: T,
    /// The velocity's source.
    pub(super) source: u32,
}
integrity!(Followed<T>: velocity, step, braked, source);

/// The velocity by the flow balance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct ByFlow<T> {
    /// The low-passed velocities (m/s) by the flows of valve and oil.
    pub(super) valve: T,
    pub(super) oil: T,
    /// The last force (N), and whether there has been one.
    pub(super) force: T,
    pub(super) has_force: bool,
}
integrity!(ByFlow<T>: valve, oil, force, has_force);
