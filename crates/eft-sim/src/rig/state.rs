//! The plant's continuous state.

use crate::rig::Num;

/// Everything the plant remembers; `default()` is at rest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlantState<S> {
    /// Pilot flow `q` (m³/s).
    pub pilot_flow: S,
    /// Spool opening `x_v` (1).
    pub spool: S,
    /// Load pressure `P_L` (Pa).
    pub load_pressure: S,
    /// Piston and structure displacement `x` (m).
    pub displacement: S,
    /// Piston and structure velocity `ẋ` (m/s).
    pub velocity: S,
}

impl<S: Num> PlantState<S> {
    /// `self + rate·step`.
    #[inline(always)]
    pub(crate) fn after(self, rate: Self, step: S) -> Self {
        self.zip(rate, |x, r| x + r * step)
    }

    #[inline(always)]
    pub(crate) fn zip(self, other: Self, f: impl Fn(S, S) -> S) -> Self {
        Self {
            pilot_flow: f(self.pilot_flow, other.pilot_flow),
            spool: f(self.spool, other.spool),
            load_pressure: f(self.load_pressure, other.load_pressure),
            displacement: f(self.displacement, other.displacement),
            velocity: f(self.velocity, other.velocity),
        }
    }

    /// A number that is finite where the whole state is.
    #[inline(always)]
    pub(crate) fn magnitude(self) -> S {
        self.pilot_flow.abs()
            + self.spool.abs()
            + self.load_pressure.abs()
            + self.displacement.abs()
            + self.velocity.abs()
    }
}
