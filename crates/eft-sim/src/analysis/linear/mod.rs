//! The rig linearised about rest: poles, transfer functions, stability.
//!
//! There are two models of the same loop. One is in continuous time, as in the paper. The other is exactly
//! sampled, with the hold, the computation delay and the realization of the force loop of the simulator.

mod about_rest;
mod chain;
mod continuous;
mod delay_budget;
mod disturbance;
mod gains;
mod inverse_dynamics;
mod map;
mod margin;
mod plant;
mod sampled;
mod velocity;
mod velocity_signal;

pub(crate) use about_rest::{AboutRest, about_rest};
pub(crate) use delay_budget::sampling_delays;
pub use delay_budget::{DelayBudget, delay_budget};
pub(crate) use disturbance::{Disturbance, deviation};
pub use gains::FlowGain;
pub(crate) use gains::compensated_share;
pub use inverse_dynamics::{lead_response, valve_response};
pub use map::{MapAxis, MapQuantity, stability_map};
pub use margin::{Margins, Reach, margins_within, stability_margin, stability_margins};
pub(crate) use margin::{designed_for, largest_stable_level, stability_margin_up_to};

pub use crate::design::phase_delay;
pub use crate::state_space::{Mode, StateSpace};
pub use nalgebra::{Complex, DMatrix};

use crate::{Result, RigConfig, interruption};

/// Continuous or sampled time of a linear model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Time {
    /// Continuous time, without hold and computation delay.
    Continuous,
    /// Exactly sampled at a rate (Hz).
    Sampled(f64),
}

/// The rig's closed loop linearised about rest, from one force command (N) per actuator to the outputs of
/// [`StateSpace`].
///
/// # Errors
/// An invalid sample rate; a building with too many stories for a sampled model.
pub fn linearize(rig: &RigConfig, gain: FlowGain, time: Time) -> Result<StateSpace> {
    interruption::check()?;
    match time {
        Time::Continuous => continuous::continuous(rig, gain),
        Time::Sampled(rate) => sampled::sampled(&*rig.at_rate(rate)?, gain, rate),
    }
}

/// The sampled loop with the mean flow gain and the [`Disturbance`]s of each actuator as inputs after the commands.
///
/// # Errors
/// As [`linearize`].
pub(crate) fn disturbed(rig: &RigConfig, sample_rate: f64) -> Result<StateSpace> {
    interruption::check()?;
    sampled::disturbed(&*rig.at_rate(sample_rate)?, sample_rate)
}
