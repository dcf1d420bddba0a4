//! Signals on their way into the controller: in its precision, and one rig's apart from those beside it.

use eft_core::{Input, Real, Scalar};

use crate::instruments::Signals;
use crate::lanes::Num;

impl<S: Num> Signals<S> {
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

impl Signals<f64> {
    /// A channel's input, with the command (N) now and at the next tick, and the valve command (V) that stands.
    pub(super) fn input(&self, command: f64, next_command: f64, valve_command: f64) -> Input<f64> {
        Input {
            command,
            next_command,
            valve_command,
            velocity: self.velocity,
            force: self.force,
            spool: self.spool,
            displacement: self.displacement,
            acceleration: self.acceleration,
            supply_pressure: self.supply_pressure,
        }
    }
}

/// The same numbers in another precision.
#[inline(always)]
pub(crate) fn convert<A: Scalar, B: Scalar>(from: A) -> B {
    B::from_lanes(|i| B::Element::from_f64(from.lane(i).to_f64()))
}
