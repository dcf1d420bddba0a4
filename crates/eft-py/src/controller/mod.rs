//! `eft.Compensator` and `eft.Controller`: the core's own steps.

mod channel;
mod compensator;
mod shared;
mod whole;

pub(crate) use compensator::Compensator;
pub(crate) use whole::Controller;
