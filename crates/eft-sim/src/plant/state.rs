//! The continuous state of one valve and its actuator.

use crate::lanes::Num;

/// The state of valve, oil and piston; `default()` is at rest.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ActuatorState<S> {
    /// Pilot flow `q` (m³/s).
    pub(crate) pilot_flow: S,
    /// Spool opening `x_v` (1).
    pub(crate) spool: S,
    /// Load pressure `P_L` (Pa).
    pub(crate) load_pressure: S,
    /// Piston and structure displacement `x` (m).
    pub(crate) displacement: S,
    /// Piston and structure velocity `ẋ` (m/s).
    pub(crate) velocity: S,
}

/// Limit of each number, in its unit, at which a test is stopped. Gains, rates and squares of it are still
/// finite.
const LARGEST_STATE: f64 = 1e100;

/// Number of values of the state.
pub(crate) const STATES: usize = 5;

impl<S: Num> ActuatorState<S> {
    #[inline(always)]
    pub(crate) fn to_array(self) -> [S; STATES] {
        [self.pilot_flow, self.spool, self.load_pressure, self.displacement, self.velocity]
    }

    #[inline(always)]
    pub(crate) fn from_array(
        [pilot_flow, spool, load_pressure, displacement, velocity]: [S; STATES],
    ) -> Self {
        Self { pilot_flow, spool, load_pressure, displacement, velocity }
    }

    /// The state from the first numbers of a slice.
    #[inline(always)]
    pub(crate) fn from_slice(numbers: &[S]) -> Self {
        Self::from_array(numbers.first_chunk().copied().unwrap_or_default())
    }

    /// `yes` in lanes where the mask is true, `no` in the others.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        yes.zip(no, |yes, no| S::select(mask, yes, no))
    }

    /// `self + rate·step`, each rounded once.
    #[inline(always)]
    pub(crate) fn plus(self, rate: Self, step: S) -> Self {
        self.zip(rate, |x, r| x.plus(r, step))
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

    /// Lanes in which a test can continue: no number is NaN or beyond [`LARGEST_STATE`].
    // One sum costs less than a check of each number. Numbers of that size that cancel exactly do not occur.
    #[inline(always)]
    pub(crate) fn is_bounded(self) -> S::Mask {
        let sum = (self.pilot_flow + self.spool) + (self.load_pressure + self.displacement) + self.velocity;
        sum.abs().le(S::splat(LARGEST_STATE))
    }
}
