//! Channels in lanes that learn: the tick of several rigs at once, with a learner for each lane.
//!
//! Controller and windows are the code that [`Channel`](crate::Channel) uses. Only their order is repeated here,
//! without the optional parts. A channel has branches for its protection, its velocity estimate and its calibration.
//! With one generic source every lane would run both sides of each branch, and the firmware's tick would consist of
//! masks.

use crate::compensation::Calibration;
use crate::controller::{Controller, ControllerInput, ControllerOutput, ControllerState};
use crate::learning::{Moment, Window};
use crate::number::{Mask, Scalar};
use crate::parameters::Realization;

/// Channels of single rigs in lanes that learn, with a velocity sensor and without a protection. A lane has the bits of
/// its own [`Channel`](crate::Channel) whose learner publishes before the first tick after each window.
#[derive(Debug, Clone, Copy)]
pub struct ChannelLanes<S: Scalar, const N: usize> {
    controller: Controller<S, N>,
    realization: Realization,
    window_ticks: u32,
}

/// The state of the channels.
#[derive(Debug, Clone, Copy)]
pub struct ChannelLanesState<S: Scalar> {
    controller: ControllerState<S>,
    /// The calibration in use, and the one that takes effect at the start of the next window.
    calibrations: [Calibration<S>; 2],
    ticks: u32,
    window: Window<S>,
}

impl<S: Scalar, const N: usize> ChannelLanes<S, N> {
    /// From controllers in lanes and the number of ticks of a window.
    pub fn new(controller: Controller<S, N>, window_ticks: u32) -> Self {
        Self { realization: controller.realization(), controller, window_ticks }
    }

    /// As [`Channel::at_rest_with`](crate::Channel::at_rest_with).
    pub fn at_rest_with(&self, calibration: &Calibration<S>) -> ChannelLanesState<S> {
        ChannelLanesState {
            controller: self.controller.at_rest_with(calibration),
            calibrations: [*calibration; 2],
            ticks: 0,
            window: Window::first(0),
        }
    }

    /// One tick, and whether a window closes with it. `valve_command` (V) is that of the same sample. It is used if an
    /// analog controller closes the force loop. `path` is that of [`Controller::step`].
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut ChannelLanesState<S>,
        input: &ControllerInput<S>,
        valve_command: S,
        path: impl FnOnce(S) -> S,
    ) -> (ControllerOutput<S>, bool) {
        let last_valve_command = state.controller.valve_command();
        let supply = self.controller.supply(&mut state.controller, input.supply_pressure);
        let sample = self.controller.sample(&state.controller, input, supply);
        let valid = sample.valid;
        let [calibration, _] = &state.calibrations;
        let mut out = if valid.any() {
            self.controller.step_valid(&mut state.controller, sample, calibration, path)
        } else {
            self.controller.step_invalid(&mut state.controller, sample, path)
        };
        out.status = out.status | calibration.status;

        let (window, measures_supply) = (&mut state.window, self.controller.measures_supply);
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        let now = Moment { force: sample.oil_force(force), command: sample.oil_force(command) };
        window.add(valid, velocity, spool, now);
        if measures_supply.any() {
            window.supply = S::select(valid & measures_supply, supply.ratio, window.supply);
        }
        match self.realization {
            Realization::Digital => window.add_command(valid, last_valve_command),
            Realization::Analog => window.add_sampled_command(valid, valve_command, spool),
        }
        if !valid.all() {
            window.lose(!valid);
        }
        state.ticks += 1;
        (out, state.ticks == self.window_ticks)
    }

    /// Begins the next window, with the calibrations that the learners made from the closed one. Call it between two
    /// ticks. The calibrations take effect one window later.
    #[inline(always)]
    pub fn publish<'a>(
        &self,
        state: &mut ChannelLanesState<S>,
        lane: impl Fn(usize) -> &'a Calibration<S::Element>,
    ) where
        S::Element: 'a,
    {
        let [_, next] = state.calibrations;
        state.calibrations = [next, Calibration::pack(lane)];
        state.ticks = 0;
        state.window.go_on();
    }
}

impl<S: Scalar> ChannelLanesState<S> {
    /// One lane's window so far.
    pub fn window(&self, lane: usize) -> Window<S::Element> {
        self.window.lane(lane)
    }
}

#[cfg(test)]
mod tests;
