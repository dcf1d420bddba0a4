//! The main spool, Eq. (3): `ẋ_v = q/(A_v·x_vmax)`, stopped at ±1.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::lanes::Num;

/// Main-stage spool.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spool<S> {
    opening_per_volume: S,
}

impl<S: Num> Spool<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let volume = |i: usize| rig(i).servovalve.spool_area * rig(i).servovalve.spool_stroke;
        Self { opening_per_volume: S::from_lanes(|i| 1.0 / volume(i)) }
    }

    /// Rate of the opening (1/s) for the pilot flow (m³/s); zero if the flow pushes against a stop.
    #[inline(always)]
    pub(crate) fn rate(&self, pilot_flow: S, opening: S) -> S {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let against_stop = (opening.ge(one) & pilot_flow.gt(zero)) | (opening.le(-one) & pilot_flow.lt(zero));
        S::select(against_stop, zero, pilot_flow * self.opening_per_volume)
    }

    /// The opening limited to its stops, because an integration step may exceed them.
    #[inline(always)]
    pub(crate) fn stop(opening: S) -> S {
        opening.limit(S::splat(-1.0), S::splat(1.0))
    }

    /// The same for the numbers of an [`ActuatorState`](crate::plant::ActuatorState).
    #[inline(always)]
    pub(crate) fn stop_in(state: &mut [S]) {
        if let [_, opening, ..] = state {
            *opening = Self::stop(*opening);
        }
    }

    /// Lanes with the spool at a stop.
    #[inline(always)]
    pub(crate) fn at_stop(opening: S) -> <S as Scalar>::Mask {
        opening.abs().ge(S::splat(1.0))
    }
}
