//! The state of a controller.

use crate::compensation::{CompensationState, FeedforwardState};
use crate::force_loop::ServovalveControllerState;
use crate::integrity::integrity;
use crate::number::{Flags, Mask, Scalar};

/// The state of the controller. `default()` is a rig at rest without a known null bias.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ControllerState<S: Scalar> {
    pub(super) compensation: CompensationState<S>,
    pub(super) feedforward: FeedforwardState<S>,
    pub(super) servovalve: ServovalveControllerState<S>,
    pub(super) valve_command: S,
    /// Samples in a row that were refused.
    pub(crate) refused_samples: S::Flags,
    /// The force loop's integral (V).
    pub(super) integral: S,
    /// The last valid ratio of the measured supply pressure to the configured one, less 1 (1).
    pub(super) supply: S,
    /// The low-passed opening (1) of a valve without overlap.
    pub(super) low_passed: S,
}
integrity!(
    ControllerState<T>: compensation, feedforward, servovalve, valve_command, refused_samples, integral, supply,
    low_passed
);

impl<S: Scalar> ControllerState<S> {
    /// The last valve command (V).
    pub const fn valve_command(&self) -> S {
        self.valve_command
    }

    /// Forgets the force errors, so that the derivative has no kick.
    #[inline(always)]
    pub(crate) fn forget(&mut self) {
        self.integral = S::splat(0.0);
        self.servovalve = ServovalveControllerState::default();
    }

    /// Counts a sample as `good` or refused.
    #[inline(always)]
    pub(super) fn count(&mut self, valid: S::Mask) {
        let counted = |i| if valid.lane(i) { 0 } else { self.refused_samples.lane(i).saturating_add(1) };
        self.refused_samples = S::Flags::from_lanes(counted);
    }

    #[inline(always)]
    pub(super) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            compensation: CompensationState::select(mask, yes.compensation, no.compensation),
            feedforward: FeedforwardState::select(mask, yes.feedforward, no.feedforward),
            low_passed: S::select(mask, yes.low_passed, no.low_passed),
            servovalve: ServovalveControllerState::select(mask, yes.servovalve, no.servovalve),
            integral: S::select(mask, yes.integral, no.integral),
            valve_command: S::select(mask, yes.valve_command, no.valve_command),
            refused_samples: S::select_flags(mask, yes.refused_samples, no.refused_samples),
            supply: S::select(mask, yes.supply, no.supply),
        }
    }
}
