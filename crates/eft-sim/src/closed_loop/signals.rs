//! Conversion of the controller's input signals to its precision, and selection of one lane.

use std::any::Any;

use eft_core::{Flags, Input, Real, Scalar};

use crate::lanes::Num;
use crate::plant::Signals;

impl<S: Num> Signals<S> {
    /// One lane.
    pub(super) fn lane(&self, lane: usize) -> Signals<f64> {
        // Not by `map` of an array, which test builds do not inline.
        Signals {
            displacement: self.displacement.lane(lane),
            velocity: self.velocity.lane(lane),
            force: self.force.lane(lane),
            spool: self.spool.lane(lane),
            supply_pressure: self.supply_pressure.lane(lane),
            acceleration: self.acceleration.lane(lane),
            load_pressure: self.load_pressure.lane(lane),
        }
    }
}

impl Signals<f64> {
    /// A channel's input, with the commands (N) of this tick and the next, and the present valve command (V).
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
            load_pressure: self.load_pressure,
            ..Input::default()
        }
    }
}

/// The same flags for another number type.
#[inline(always)]
pub(crate) fn convert_flags<A: Flags, B: Flags>(from: A) -> B {
    match (&from as &dyn Any).downcast_ref() {
        Some(same) => *same,
        None => B::from_lanes(|i| from.lane(i)),
    }
}

/// The same numbers in another precision.
#[inline(always)]
pub(crate) fn convert<A: Scalar, B: Scalar>(from: A) -> B {
    B::from_lanes(|i| B::Element::from_f64(from.lane(i).to_f64()))
}
