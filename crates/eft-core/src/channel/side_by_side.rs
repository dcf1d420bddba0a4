//! Channels side by side that learn: the tick in lanes, with sums for a learner of its own in every lane.

use crate::compensation::Calibration;
use crate::controller::{Controller, ControllerInput, ControllerOutput, ControllerState};
use crate::error::LARGEST;
use crate::learning::{Moment, Sums, Window};
use crate::number::{Mask, Real, Scalar};
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
    number: u32,
    ticks: u32,
    lost: S,
    lost_commands: S,
    sums: Sums<S>,
    start: Moment<S>,
    end: Moment<S>,
    supply: S,
}

impl<S: Scalar, const N: usize> ChannelLanes<S, N> {
    /// From controllers side by side, and the ticks of a window.
    pub fn new(controller: Controller<S, N>, window_ticks: u32) -> Self {
        Self { realization: controller.realization(), controller, window_ticks }
    }

    /// Rigs at rest, nothing learned yet.
    pub fn at_rest(&self) -> ChannelLanesState<S> {
        let zero = S::splat(0.0);
        ChannelLanesState {
            controller: ControllerState::default(),
            calibrations: [self.controller.nominal(); 2],
            number: 0,
            ticks: 0,
            // As of a window that nothing was measured before.
            lost: S::splat(1.0),
            lost_commands: zero,
            sums: Sums::default(),
            start: Moment::default(),
            end: Moment::default(),
            supply: S::splat(1.0),
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

        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let add = |sum: &mut S, at: S::Mask, value: S| *sum = *sum + S::select(at, value, zero);
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        add(&mut state.sums.velocity, good, velocity);
        add(&mut state.sums.force, good, force);
        add(&mut state.sums.spool, good, spool);
        add(&mut state.sums.command, good, command);
        state.end = Moment {
            force: S::select(good, force, state.end.force),
            command: S::select(good, command, state.end.command),
        };
        if self.controller.measures_supply.any() {
            let measured = good & self.controller.measures_supply;
            state.supply = S::select(measured, supply.ratio, state.supply);
        }
        match self.realization {
            Realization::Digital => add(&mut state.sums.valve_command, good, stood),
            Realization::Analog => {
                let known = valve_command.abs().le(S::splat(LARGEST));
                add(&mut state.sums.valve_command, good & known, valve_command);
                if !known.all() {
                    add(&mut state.sums.spool_without_command, good & !known, spool);
                    add(&mut state.lost_commands, good & !known, one);
                }
            }
        }
        if !good.all() {
            add(&mut state.lost, !good, one);
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
        state.number = state.number.wrapping_add(1);
        state.ticks = 0;
        (state.lost, state.lost_commands) = (S::default(), S::default());
        state.sums = Sums::default();
        state.start = state.end;
    }
}

impl<S: Scalar> ChannelLanesState<S> {
    /// One lane's window, as far as it has gone.
    pub fn window(&self, lane: usize) -> Window<S::Element> {
        let count = |ticks: S| ticks.lane(lane).to_f64() as u32;
        let of = |value: S| value.lane(lane);
        let moment = |at: &Moment<S>| Moment { force: of(at.force), command: of(at.command) };
        Window {
            number: self.number,
            lost: count(self.lost),
            lost_commands: count(self.lost_commands),
            sums: Sums {
                velocity: of(self.sums.velocity),
                force: of(self.sums.force),
                spool: of(self.sums.spool),
                command: of(self.sums.command),
                valve_command: of(self.sums.valve_command),
                spool_without_command: of(self.sums.spool_without_command),
            },
            start: moment(&self.start),
            end: moment(&self.end),
            supply: of(self.supply),
        }
    }
}
