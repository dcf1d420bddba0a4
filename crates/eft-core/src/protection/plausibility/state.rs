//! The state of a plausibility watch, and what it says about the sensors.

use crate::cause::Cause;
use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::gate::Signal;
use crate::protection::plausibility::comparisons::{
    FlowBalance, FlowVelocity, FollowedMotion, MotionSums, SpoolSums,
};
use crate::protection::plausibility::load_pressure::LoadPressureState;
use crate::protection::plausibility::opening_offset::OpeningOffset;
use crate::protection::plausibility::reversal::SignSums;
use crate::protection::plausibility::zero_force::ZeroForce;
use crate::velocity::FilteredDerivativeState;

/// The state of a watch. `default()` is a rig at rest without a known null bias.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct PlausibilityState<T> {
    pub(super) signals: [Signal<T>; 4],
    /// The distrusted sensors, in the order of [`FORCE`](crate::protection::gate::FORCE) and its siblings.
    pub(crate) distrusted: [bool; 4],
    /// Set when the force is blamed for a flow balance that contains the velocity as well, or for a jump.
    pub(crate) balance_blame: bool,
    /// Ticks since the last displacement; 0 before the first.
    pub(super) displacement_ticks: u32,
    /// Command (N) and displacement (m) when force and velocity last changed.
    pub(super) last_changes: [T; 2],
    /// The velocity (m/s) from the displacement.
    pub(super) derivative: FilteredDerivativeState<T>,
    pub(crate) velocity: T,
    /// The sensor's velocity (m/s) after the same low-passes.
    pub(super) filtered_velocity: [T; 2],
    pub(super) balance: FlowBalance<T>,
    pub(super) motion: MotionSums<T>,
    pub(super) stroke: SpoolSums<T>,
    pub(super) followed: FollowedMotion<T>,
    pub(super) flow_velocity: FlowVelocity<T>,
    pub(super) reversal: SignSums<T>,
    pub(super) zero_force: ZeroForce<T>,
    pub(super) load_pressure: LoadPressureState<T>,
    /// Mean opening (1) by which the valve's flow exceeds that of the measured opening.
    pub(super) opening_offset: OpeningOffset<T>,
}
integrity!(
    PlausibilityState<T>: signals, distrusted, balance_blame, displacement_ticks, last_changes, derivative, velocity,
    filtered_velocity, balance, motion, stroke, followed, flow_velocity, reversal, zero_force, load_pressure, opening_offset
);

impl<T: Real> PlausibilityState<T> {
    /// Distrusts a sensor from now on.
    #[inline(always)]
    pub(crate) fn distrust(&mut self, cause: Cause) {
        let [force, displacement, velocity, spool] = &mut self.distrusted;
        match cause {
            Cause::ForceLost | Cause::ForceImplausible => *force = true,
            Cause::DisplacementLost | Cause::DisplacementImplausible => *displacement = true,
            Cause::VelocityLost | Cause::VelocityImplausible => *velocity = true,
            Cause::SpoolLost | Cause::SpoolImplausible => *spool = true,
            _ => {}
        }
    }

    /// The state before the first sample, with what is known of sensors and valve. The spool is at the known null (1).
    pub(crate) fn restarted(&self, null_bias: T) -> Self {
        let Self { distrusted, balance_blame, opening_offset, followed, .. } = *self;
        let (load_pressure, stroke) = (self.load_pressure.restarted(), SpoolSums::at(null_bias));
        Self { distrusted, balance_blame, opening_offset, followed, load_pressure, stroke, ..Self::default() }
    }

    /// The last accepted readings of force, displacement, velocity and spool; NaN before the first one.
    #[inline(always)]
    pub(crate) fn accepted(&self) -> [T; 4] {
        let last = |signal: &Signal<T>| if signal.has_reading { signal.last } else { T::splat(f64::NAN) };
        let [force, displacement, velocity, spool] = &self.signals;
        [last(force), last(displacement), last(velocity), last(spool)]
    }

    /// Whether the reading of the force jumped in this tick.
    #[inline(always)]
    pub(crate) fn force_jumped(&self) -> bool {
        let [force, ..] = &self.signals;
        force.lost > 0 && force.jumped
    }

    /// Whether the flow agrees better with the displacement than with the velocity.
    #[inline(always)]
    pub(crate) fn contradicts_velocity(&self) -> bool {
        !self.motion.evidence.is_of_displacement()
    }

    /// The null bias (1) beyond the known one.
    #[inline(always)]
    pub(crate) fn null_bias(&self) -> T {
        self.opening_offset.null_bias()
    }

    /// The velocity (m/s) by the flow balance.
    #[inline(always)]
    pub(crate) fn velocity_by_flow(&self) -> T {
        self.flow_velocity.valve - self.flow_velocity.oil
    }

    /// The spool opening (1) from the valve command.
    #[inline(always)]
    pub(crate) fn spool(&self) -> T {
        self.stroke.opening
    }
}
