//! The limits and the state of each comparison.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::plausibility::sums::{Cusum, CusumStart, Evidence, count_since};

/// The coefficients and limits of the flow balance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlowLimits<T> {
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
    pub(in crate::protection) wrong_sign: T,
}
integrity!(FlowLimits<T>: high, fast_decay, drift, fast_drift, null_drift, slow, fast, wrong_sign);

/// The state of the flow balance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct FlowBalance<T> {
    /// Time (s) since the first sample, until the low-passes have settled.
    pub(super) age: T,
    /// The valve's last flow (m³/s).
    pub(super) last_flow: T,
    /// Low-passed: flow of the valve, flow of piston and leakage (m³/s), force (N).
    pub(super) valve_flow: T,
    pub(super) load_flow: T,
    pub(super) force: T,
    /// High-passes of the residual, the valve's flow and the oil's flow (m³/s).
    pub(super) fast_residual: [T; 2],
    pub(super) fast_valve_flow: [T; 2],
    pub(super) fast_oil_flow: [T; 2],
    /// Envelopes (m³/s) of the larger flow, and of those above the motion's frequencies.
    pub(super) flow_envelope: T,
    pub(super) fast_valve_envelope: T,
    pub(super) fast_oil_envelope: T,
    /// Recent nearness of the spool to null (1).
    pub(super) near_null: T,
    /// Sums (m³) of the slow and the fast residual, and of a force of the wrong sign.
    pub(super) slow: Cusum<T>,
    pub(super) fast: Cusum<T>,
    pub(super) wrong_sign: Cusum<T>,
}
integrity!(
    FlowBalance<T>: age, last_flow, valve_flow, load_flow, force, fast_residual, fast_valve_flow, fast_oil_flow,
    flow_envelope, fast_valve_envelope, fast_oil_envelope, near_null, slow, fast, wrong_sign
);

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
    pub(in crate::protection) latency: T,
}
integrity!(MotionLimits<T>: drift, ratio_drift, travel, ratio, latency);

/// The state of velocity and displacement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct MotionSums<T> {
    /// The last velocity (m/s) and displacement (m).
    pub(super) last_velocity: T,
    pub(super) last_displacement: T,
    /// Low-passed velocity (m/s) and displacement (m).
    pub(super) velocity: T,
    pub(super) displacement: T,
    /// Velocity, its difference from the displacement's (m/s), and the flow's residual (m³/s), with a further low-pass.
    pub(super) ratio_velocity: T,
    pub(super) ratio_difference: T,
    pub(super) ratio_residual: T,
    /// Envelope (m/s) of the larger velocity.
    pub(super) speed_envelope: T,
    /// Sums (m) of travel and ratio, and the velocities at which they began.
    pub(super) travel: Cusum<T>,
    pub(super) ratio: Cusum<T>,
    pub(super) travel_start: CusumStart<T>,
    pub(super) ratio_start: CusumStart<T>,
    /// Average (m⁴/s²) of the squared flow residual with the velocity minus that with the displacement, over twice the
    /// piston area.
    pub(super) misfit: T,
    /// The same average of the square of the faster one of velocity and displacement (m²/s²).
    pub(super) mean_square_speed: T,
    /// Evidence about the motion since the sum of the travel began.
    pub(super) evidence: Evidence<T>,
    /// Ticks since the last displacement; 0 before the first.
    pub(super) ticks: u32,
}
integrity!(
    MotionSums<T>: last_velocity, last_displacement, velocity, displacement, ratio_velocity, ratio_difference,
    ratio_residual, speed_envelope, travel, ratio, travel_start, ratio_start, misfit, mean_square_speed, evidence,
    ticks
);

impl<T> MotionSums<T> {
    /// Counts a tick that is not compared.
    #[inline(always)]
    pub(super) fn miss(&mut self) {
        count_since(&mut self.ticks);
    }
}

/// The limits of the spool and its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpoolLimits<T> {
    /// Coefficient (1) of the valve model's two lags.
    pub(in crate::protection) lag: T,
    /// Differences (1) by noise and offsets, and by noise in a motion against the command.
    pub(in crate::protection) drift: T,
    pub(in crate::protection) against_drift: T,
    /// Limits (s) of the sums.
    pub(in crate::protection) difference: T,
    pub(in crate::protection) against: T,
}
integrity!(SpoolLimits<T>: lag, drift, against_drift, difference, against);

/// The state of the spool and its command: openings (1).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct SpoolSums<T> {
    /// The valve model's opening after its first lag and after both.
    pub(super) first: T,
    pub(super) opening: T,
    /// Low-passed: the valve model's opening and the spool's, and their means.
    pub(super) commanded: T,
    pub(super) measured: T,
    pub(super) commanded_mean: T,
    pub(super) measured_mean: T,
    /// Envelope of the larger opening.
    pub(super) opening_envelope: T,
    /// Sums (s) of the difference, and of a motion against the command.
    pub(super) difference: Cusum<T>,
    pub(super) against: Cusum<T>,
}
integrity!(
    SpoolSums<T>: first, opening, commanded, measured, commanded_mean, measured_mean, opening_envelope, difference,
    against
);

impl<T: Real> SpoolSums<T> {
    /// The state of a spool at rest at an opening (1).
    pub(super) fn at(opening: T) -> Self {
        let [first, commanded, measured, commanded_mean, measured_mean] = [opening; 5];
        Self { first, opening, commanded, measured, commanded_mean, measured_mean, ..Self::default() }
    }
}

/// Coefficients of the followed motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Following<T> {
    /// Coefficient (1) of the low-pass of the velocity by the flow balance.
    pub(in crate::protection) low_gain: T,
    /// Share (1) of the step between two sources of the velocity that remains after a sample.
    pub(in crate::protection) fade: T,
    /// The brake's largest force (N), and the reciprocal of the velocity (s/m) from which on it has this force.
    pub(in crate::protection) brake: T,
    pub(in crate::protection) per_brake_velocity: T,
}
integrity!(Following<T>: low_gain, fade, brake, per_brake_velocity);

/// The followed motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct FollowedMotion<T> {
    /// The last velocity (m/s), and the remaining step from the previous source (m/s).
    pub(super) velocity: T,
    pub(super) step: T,
    /// The low-passed velocity (m/s) of the brake.
    pub(super) brake_velocity: T,
    /// The velocity's source.
    pub(super) source: u32,
}
integrity!(FollowedMotion<T>: velocity, step, brake_velocity, source);

/// The velocity by the flow balance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct FlowVelocity<T> {
    /// The low-passed velocities (m/s) by the flows of valve and oil.
    pub(super) valve: T,
    pub(super) oil: T,
    /// The last force (N), and whether there has been one.
    pub(super) force: T,
    pub(super) has_force: bool,
}
integrity!(FlowVelocity<T>: valve, oil, force, has_force);
