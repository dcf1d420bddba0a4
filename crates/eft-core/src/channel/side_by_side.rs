//! Channels side by side that learn: the tick in lanes, with sums for a learner of its own in every lane.
//!
//! Controller and windows are the text of [`Channel`](crate::Channel). Only their order stands here again, without the
//! parts between them. A channel branches on its protection, on its estimate of the velocity and on the slot of its
//! calibration. In one generic text every lane would go through both sides of each branch, in counts, flags and
//! protections that hold one word a lane, and the firmware's tick would be written in masks.

use crate::compensation::Calibration;
use crate::controller::{Controller, ControllerInput, ControllerOutput, ControllerState};
use crate::learning::{Moment, Window};
use crate::number::{Mask, Scalar};
use crate::parameters::Realization;

/// Channels of single rigs side by side that learn, without a protection and with a sensor of the velocity. A lane has the
/// bits of its [`Channel`](crate::Channel) alone whose learner publishes before the tick behind each window.
#[derive(Debug, Clone, Copy)]
pub struct ChannelLanes<S: Scalar, const N: usize> {
    controller: Controller<S, N>,
    realization: Realization,
    window_ticks: u32,
}

/// What they remember.
#[derive(Debug, Clone, Copy)]
pub struct ChannelLanesState<S: Scalar> {
    controller: ControllerState<S>,
    /// In use, and what takes effect at the next window's start.
    calibrations: [Calibration<S>; 2],
    ticks: u32,
    window: Window<S>,
}

impl<S: Scalar, const N: usize> ChannelLanes<S, N> {
    /// From controllers side by side, and the ticks of a window.
    pub fn new(controller: Controller<S, N>, window_ticks: u32) -> Self {
        Self { realization: controller.realization(), controller, window_ticks }
    }

    /// Rigs at rest, nothing learned yet.
    pub fn at_rest(&self) -> ChannelLanesState<S> {
        ChannelLanesState {
            controller: ControllerState::default(),
            calibrations: [self.controller.nominal(); 2],
            ticks: 0,
            window: Window::first(0),
        }
    }

    /// One tick, and whether a window closes with it. `valve_command` (V) stood when the others were sampled; it is looked
    /// at where an analog controller closes the force loop. `path` as in [`Controller::step`].
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut ChannelLanesState<S>,
        input: &ControllerInput<S>,
        valve_command: S,
        path: impl FnOnce(S) -> S,
    ) -> (ControllerOutput<S>, bool) {
        let stood = state.controller.valve_command();
        let supply = self.controller.supply(input);
        let sample = self.controller.sample(&state.controller, input, supply);
        let good = sample.good;
        let [calibration, _] = &state.calibrations;
        let mut out = if good.any() {
            self.controller.follow(&mut state.controller, sample, calibration, path)
        } else {
            self.controller.refuse(&mut state.controller, sample, path)
        };
        out.status = out.status | calibration.status;

        let (window, measures_supply) = (&mut state.window, self.controller.measures_supply);
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        window.add(good, velocity, spool, Moment { force, command });
        if measures_supply.any() {
            window.supply = S::select(good & measures_supply, supply.ratio, window.supply);
        }
        match self.realization {
            Realization::Digital => window.add_command(good, stood),
            Realization::Analog => window.add_sampled_command(good, valve_command, spool),
        }
        if !good.all() {
            window.lose(!good);
        }
        state.ticks += 1;
        (out, state.ticks == self.window_ticks)
    }

    /// Begins the window behind one that has closed, with what its learners made of it, between two ticks: it takes effect
    /// a window later.
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
    /// One lane's window, as far as it has gone.
    pub fn window(&self, lane: usize) -> Window<S::Element> {
        self.window.lane(lane)
    }
}
