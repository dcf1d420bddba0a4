//! The virtual rig: each block of Fig. 1 a file, put together in [`Plant`].
//!
//! Blocks are written over [`Scalar`], so the same plant runs one rig or several side by side.

mod actuator;
mod bouc_wen;
mod drive;
mod end_stop;
mod energy;
mod friction;
mod integrator;
mod load_cell;
mod load_flow;
mod pace;
mod pilot_valve;
mod plain;
mod plant;
mod power_damper;
mod propagator;
mod runge_kutta;
mod servo_actuator;
mod spool;
mod state;
mod story;
mod structure;
mod supply;
mod valve_leakage;

use eft_core::{Lanes, Scalar};

pub(crate) use drive::{Analog, Driver, DriverKind};
pub use energy::EnergyBalance;
pub(crate) use integrator::{Ahead, Carried, Exponential};
pub(crate) use pace::{Pace, longest_step};
pub(crate) use plant::{Plant, needs_detail};
pub(crate) use runge_kutta::{Equations, Stages, runge_kutta};
pub(crate) use servo_actuator::ServoActuator;
pub(crate) use spool::Spool;
pub(crate) use state::ActuatorState;
pub(crate) use structure::{Motion, Structure};
pub(crate) use supply::Supply;

#[cfg(test)]
fn changed(changes: &[(&str, toml::Value)]) -> crate::RigConfig {
    crate::RigConfig::zhao2005().replace(changes).unwrap()
}

/// Most points a flow curve may have.
pub const TABLE_CAPACITY: usize = 64;

/// The plant's numbers: double precision, one or several side by side.
pub trait Num: Scalar<Element = f64> + 'static {
    /// `self + factor·other`, rounded once.
    ///
    /// # Cost
    /// One instruction where the processor has it; without it, many times as long for the same bits.
    fn plus(self, factor: Self, other: Self) -> Self;
}

impl Num for f64 {
    #[inline(always)]
    fn plus(self, factor: f64, other: f64) -> f64 {
        factor.mul_add(other, self)
    }
}

impl<const N: usize> Num for Lanes<f64, N> {
    #[inline(always)]
    fn plus(self, factor: Self, other: Self) -> Self {
        Self::from_lanes(|i| self.lane(i).plus(factor.lane(i), other.lane(i)))
    }
}
