//! Input and output of a controller's tick.

use crate::number::{Mask, Scalar};
use crate::status;

/// One tick's command and measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerInput<S> {
    /// Force command (N).
    pub command: S,
    /// Force command (N) of the next tick; used by feedforward and load-pressure correction if they look ahead.
    pub next_command: S,
    /// Piston velocity (m/s).
    pub velocity: S,
    /// Force (N).
    pub force: S,
    /// Spool opening (1).
    pub spool: S,
    /// Supply pressure (Pa); used if it is measured. The last valid one replaces an invalid one; if it is below the
    /// configured one, it returns to that, and a 1/e of the difference is left after 2,048 ticks.
    pub supply_pressure: S,
}

/// The supply pressure.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Supply<S: Scalar> {
    /// The last valid ratio to the configured pressure (1); 1 where it is not measured.
    pub(crate) ratio: S,
    /// Where this is the present one: it lies between 1/20 and 4.
    pub(crate) valid: S::Mask,
}

impl<S: Scalar> Supply<S> {
    /// Where it is not measured.
    #[inline(always)]
    pub(crate) fn nominal() -> Self {
        Self { ratio: S::splat(1.0), valid: S::Mask::splat(true) }
    }

    /// The flag of a last valid pressure in place of the present one.
    #[inline(always)]
    pub(super) fn held_flag(&self) -> S::Flags {
        S::flag(!self.valid, status::STUCK_MEASUREMENT)
    }
}

/// A tick's input, with the results of its checks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a, S: Scalar> {
    pub(crate) input: &'a ControllerInput<S>,
    pub(crate) supply: Supply<S>,
    /// Where command and measurements are valid.
    pub(crate) valid: S::Mask,
    /// Where it follows a gap: a good sample then resumes.
    pub(crate) resumes: S::Mask,
    /// Whether any lane looks ahead.
    pub(crate) looks_ahead: bool,
    /// Whether any lane's force loop has an integral part.
    pub(crate) integrates: bool,
    /// Whether any lane has an overlap.
    pub(crate) has_overlap: bool,
    /// Friction (N) of the seals; `None` if no lane has any.
    pub(crate) friction: Option<S>,
}

impl<S: Scalar> Sample<'_, S> {
    /// The force (N) that the oil carries if this one (N) acts on the specimen.
    #[inline(always)]
    pub(crate) fn oil_force(&self, force: S) -> S {
        self.friction.map_or(force, |friction| force + friction)
    }
}

/// One tick's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerOutput<S: Scalar> {
    /// The valve command `v` (V), or the compensation signal if an analog controller closes the force loop.
    pub valve_command: S,
    /// The compensation signal `v_c` (V) in it.
    pub compensation: S,
    /// Bits of [`status`].
    pub status: S::Flags,
}
