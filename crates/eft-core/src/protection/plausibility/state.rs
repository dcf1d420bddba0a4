//! The state of a plausibility watch, and what it says about the sensors.

use crate::cause::Cause;
use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::gate::Signal;
use crate::protection::plausibility::load_pressure::LoadPressureState;
use crate::protection::plausibility::null::MissingOpening;
use crate::protection::plausibility::reversal::Reversal;
use crate::protection::plausibility::sums::{Began, Evidence, Sum};
use crate::velocity::FilteredDerivativeState;

/// The state of a watch. `default()` is a rig at rest without a known null bias.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct PlausibilityState<T> {
    pub(super) signals: [Signal<T>; 4],
    pub(super) distrusted: [bool; 4],
    /// Command (N) and displacement (m) when force and velocity last changed.
    pub(super) marks: [T; 2],
    pub(super) derivative: FilteredDerivativeState<T>,
    pub(super) velocity: T,
    /// The sensor's velocity (m/s) after the same low-passes.
    pub(super) smooth: [T; 2],
    pub(super) flow: T,
    pub(super) last_velocity: T,
    /// Low-passed: flow of the valve, of piston and leakage, force, velocity, displacement.
    pub(super) lows: [T; 5],
    /// High-passes of residual, valve's flow and oil's flow.
    pub(super) highs: [[T; 2]; 3],
    /// The valve model's opening, the low-passed openings of the valve model and of the spool, and their further low-passes.
    pub(super) valve: [T; 6],
    pub(super) envelopes: [T; 6],
    /// Smallest recent distance of the spool from null (1).
    pub(super) near_null: T,
    /// Velocity, its difference from the displacement's, and the flow's residual, with a further low-pass.
    pub(super) fine: [T; 3],
    pub(super) sums: [Sum<T>; 7],
    /// The last displacement (m) of the motion's balance, and whether this sample follows it.
    pub(super) displacement: T,
    pub(super) goes_on: bool,
    /// For the sums of motion and ratio.
    pub(super) began: [Began<T>; 2],
    /// Average (m⁴/s²) of the squared flow residual with the velocity minus that with the displacement, over twice the
    /// piston area.
    pub(super) worse: T,
    /// The same average of the square of the faster one of velocity and displacement (m²/s²).
    pub(super) swept: T,
    /// Evidence about the motion since its sum began.
    pub(super) evidence: Evidence<T>,
    /// Set when the force is blamed for a flow balance that contains the velocity as well, or for a jump.
    pub(super) by_balance: bool,
    /// The last followed velocity (m/s), the remaining step from the previous source (m/s), and the source.
    pub(super) followed: T,
    pub(super) step: T,
    pub(super) source: u32,
    /// The low-passed velocity (m/s) of the brake.
    pub(super) braked: T,
    /// The low-passed velocities (m/s) by the flows of valve and oil, and the last force (N) in them.
    pub(super) by_flow: [T; 2],
    pub(super) last_force: T,
    pub(super) reversal: Reversal<T>,
    /// Whether there has been a force, and a displacement.
    pub(super) has_force: bool,
    pub(super) has_displacement: bool,
    pub(super) load_pressure: LoadPressureState<T>,
    /// Time (s) since the first sample with a flow balance, until the low-passes have settled.
    pub(super) age: T,
    /// Mean opening (1) by which the valve's flow exceeds that of the measured opening.
    pub(super) missing: MissingOpening<T>,
}
integrity!(PlausibilityState<T>: signals, distrusted, marks, derivative, velocity, smooth, flow, last_velocity, lows, highs, valve, envelopes, near_null, fine, sums, displacement, goes_on, began, worse, swept, evidence, by_balance, followed, step, source, braked, by_flow, last_force, reversal, has_force, has_displacement, load_pressure, age, missing);

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
    pub(crate) fn begun_anew(&self, null_bias: T) -> Self {
        let Self { distrusted, by_balance, missing, followed, step, source, braked, .. } = *self;
        let load_pressure = self.load_pressure.begun_anew();
        Self {
            distrusted,
            by_balance,
            missing,
            followed,
            step,
            source,
            braked,
            load_pressure,
            valve: [null_bias; 6],
            ..Self::default()
        }
    }

    /// The last accepted readings of force, displacement, velocity and spool; NaN before the first one.
    #[inline(always)]
    pub(crate) fn accepted(&self) -> [T; 4] {
        let last = |signal: &Signal<T>| if signal.seen { signal.last } else { T::splat(f64::NAN) };
        let [force, displacement, velocity, spool] = &self.signals;
        [last(force), last(displacement), last(velocity), last(spool)]
    }

    /// Whether the reading of the force jumped in this tick.
    #[inline(always)]
    pub(crate) fn force_jumped(&self) -> bool {
        let [force, ..] = &self.signals;
        force.lost > 0 && force.jumped
    }

    /// Whether the force is blamed for a flow balance that contains the velocity as well, or for a jump.
    #[inline(always)]
    pub(crate) fn is_by_balance(&self) -> bool {
        self.by_balance
    }

    /// Whether the flow agrees better with the displacement than with the velocity.
    #[inline(always)]
    pub(crate) fn contradicts_velocity(&self) -> bool {
        !self.evidence.is_of_displacement()
    }

    /// The distrusted sensors, in the order of [`FORCE`] and its siblings.
    #[inline(always)]
    pub(crate) fn distrusted(&self) -> [bool; 4] {
        self.distrusted
    }

    /// The null bias (1) beyond the known one.
    #[inline(always)]
    pub(crate) fn null_bias(&self) -> T {
        self.missing.null_bias()
    }

    /// The velocity (m/s) from the displacement.
    #[inline(always)]
    pub(crate) fn velocity(&self) -> T {
        self.velocity
    }

    /// The velocity (m/s) by the flow balance.
    #[inline(always)]
    pub(crate) fn velocity_by_flow(&self) -> T {
        let [valve, oil] = self.by_flow;
        valve - oil
    }

    /// The spool opening (1) from the valve command.
    #[inline(always)]
    pub(crate) fn spool(&self) -> T {
        let [_, opening, ..] = self.valve;
        opening
    }
}
