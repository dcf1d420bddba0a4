//! The adaptive controller in the closed loop, and what it believes of its rig.

use eft_core::{AdaptiveControllerState, Real, Scalar};

use crate::closed_loop::controller::RigAdaptiveController;
use crate::closed_loop::signals::convert;
use crate::rig::{Driver, Num};

/// What the controller believes of its rig.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Calibration<S> {
    /// True flow over the table's (1).
    pub(crate) flow_gain: S,
    /// Delay that the lead network makes up for (s).
    pub(crate) response_delay: S,
    /// The spool's gain over the configured one (1).
    pub(crate) valve_gain: S,
    /// The guard's factor on the compensation level (1).
    pub(crate) level: S,
}

/// The controller of a rig that adapts, and what it remembers.
pub(crate) struct Adaptive<S: Num, C: Scalar> {
    pub(crate) controller: RigAdaptiveController<C>,
    pub(crate) state: AdaptiveControllerState<C>,
    /// What drove the valve since the last tick.
    pub(crate) before: Option<Driver<S>>,
}

impl<S: Num, C: Scalar> Adaptive<S, C> {
    /// What it believes now.
    pub(crate) fn calibration(&self) -> Calibration<S> {
        let state = &self.state.compensation;
        Calibration {
            flow_gain: convert(state.flow_gain()),
            response_delay: convert(state.response_delay()),
            valve_gain: convert(state.valve_gain()),
            level: convert(state.level()),
        }
    }

    /// No-load flows (m³/s) that the valve of a lane was found to pass at these openings.
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Vec<f64> {
        let (controller, state) = (&self.controller.compensation, &self.state.compensation);
        let flow =
            |opening: &f64| controller.found_flow(state, convert(S::splat(*opening))).lane(lane).to_f64();
        openings.iter().map(flow).collect()
    }
}
