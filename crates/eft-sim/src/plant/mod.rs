//! The virtual rig: one file for each block of Fig. 1, combined in `Plant` for any number of actuators.
//!
//! Parts that a rig does not have are switched off by data. `fast` is the paper's rig only, and most tests
//! use it. Blocks are generic over `lanes::Num`, so the same plant runs one rig or several side by side.

mod actuator;
mod attachment;
mod bouc_wen;
mod bypass_valve;
mod drive;
mod end_stop;
mod energy;
mod fast;
mod friction;
mod general;
mod load_cell;
mod load_flow;
mod pilot_valve;
mod power_damper;
mod runge_kutta;
mod servo_actuator;
mod signals;
mod spool;
mod state;
mod story;
mod structure;
mod supply;
mod time_grid;
mod torque_motor;
mod valve_leakage;

pub(crate) use actuator::Actuator;
pub(crate) use drive::{Analog, AnalogWithCell, AnyDrive, Drive, DriveKind, Held};
pub use energy::EnergyBalance;
pub(crate) use energy::POWERS;
pub(crate) use fast::{Exponential, FastState, Prediction};
pub(crate) use general::{Plant, needs_detail};
pub(crate) use load_flow::LoadFlow;
pub(crate) use pilot_valve::PilotValve;
pub(crate) use runge_kutta::{Equations, Stages, runge_kutta};
pub(crate) use servo_actuator::ServoActuator;
pub use signals::Signals;
pub(crate) use spool::Spool;
pub(crate) use state::{ActuatorState, STATES};
pub(crate) use story::Story;
pub(crate) use structure::{Motion, Structure, linear_up_to};
pub(crate) use supply::Supply;
pub(crate) use time_grid::{TimeGrid, longest_step};

#[cfg(test)]
fn changed(changes: &[(&str, toml::Value)]) -> crate::RigConfig {
    crate::RigConfig::zhao2005().replace(changes).unwrap()
}
