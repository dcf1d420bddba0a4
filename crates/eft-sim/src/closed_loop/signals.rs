//! Signals on their way into the controller: in its precision, and one rig's apart from those beside it.

use eft_core::{Measurements, Real, Scalar};

use crate::rig::Num;
use crate::sensors::Signals;

impl<S: Num> Signals<S> {
    /// What the controller reads, in its precision: velocity, force and spool opening.
    #[inline(always)]
    pub(super) fn rounded<C: Scalar>(&self) -> (C, C, C) {
        (convert(self.velocity), convert(self.force), convert(self.spool))
    }

    /// What the adaptive controller reads besides, with the valve command (V), and the supply pressure (Pa) that it
    /// takes for granted where none is measured.
    #[inline(always)]
    pub(super) fn measurements<C: Scalar>(&self, valve_command: S, unmeasured: Option<S>) -> Measurements<C> {
        Measurements {
            velocity: convert(self.velocity),
            force: convert(self.force),
            spool: convert(self.spool),
            valve_command: convert(valve_command),
            supply_pressure: convert(unmeasured.unwrap_or(self.supply_pressure)),
        }
    }

    /// One lane.
    pub(super) fn lane(&self, lane: usize) -> Signals<f64> {
        Signals {
            displacement: self.displacement.lane(lane),
            velocity: self.velocity.lane(lane),
            force: self.force.lane(lane),
            spool: self.spool.lane(lane),
            supply_pressure: self.supply_pressure.lane(lane),
            acceleration: self.acceleration.lane(lane),
        }
    }

    /// Lanes put side by side.
    pub(super) fn from_lanes(f: impl Fn(usize) -> Signals<f64>) -> Self {
        Self {
            displacement: S::from_lanes(|i| f(i).displacement),
            velocity: S::from_lanes(|i| f(i).velocity),
            force: S::from_lanes(|i| f(i).force),
            spool: S::from_lanes(|i| f(i).spool),
            supply_pressure: S::from_lanes(|i| f(i).supply_pressure),
            acceleration: S::from_lanes(|i| f(i).acceleration),
        }
    }
}

/// The same numbers in another precision.
#[inline(always)]
pub(crate) fn convert<A: Scalar, B: Scalar>(from: A) -> B {
    B::from_lanes(|i| B::Element::from_f64(from.lane(i).to_f64()))
}
