//! Operations on a state between two ticks.

use core::borrow::Borrow;

use crate::channel::state::{CalibrationChoice, CalibrationHistory};
use crate::channel::{Channel, ChannelState, is_valid, resume};
use crate::compensation::Calibration;
use crate::controller::ControllerInput;
use crate::learning::Window;
use crate::number::Real;
use crate::parameters::Realization;
use crate::protection::{NEVER, PlausibilityState, ProtectionState, StuckWatchState};
use crate::signals::{Input, Output};
use crate::status;
use crate::velocity::{Velocity, VelocityState};

impl<T: Real, const N: usize> Channel<T, N> {
    /// A rig at rest with the valve at its known null, nothing learned yet. An estimated velocity starts at zero from
    /// the first displacement.
    pub fn at_rest(&self) -> ChannelState<T> {
        self.at_rest_with(&self.controller.nominal())
    }

    /// A rig at rest with the valve at the null of a calibration, which is in use from the first tick. For a test that
    /// starts from what an earlier one has taught, see
    /// [`Learner::first_calibration`](crate::Learner::first_calibration).
    pub fn at_rest_with(&self, calibration: &Calibration<T>) -> ChannelState<T> {
        let known = CalibrationChoice { flags: calibration.status, ..CalibrationChoice::default() };
        let plausibility = PlausibilityState::default();
        ChannelState {
            controller: self.controller.at_rest_with(calibration),
            velocity: VelocityState::default(),
            protection: ProtectionState::default(),
            plausibility: plausibility.restarted(self.controller.null_opening(calibration)),
            velocity_gap: NEVER,
            ticks_left: self.window_ticks,
            window: Window::first(0),
            in_use: known,
            next: known,
            windows_left: self.age_limit,
            calibrations: [*calibration; 2],
            history: CalibrationHistory::new(*calibration),
            stuck: StuckWatchState::default(),
        }
    }

    /// Gives a calibration to the tick. Call it in the tick's context, between two ticks. The calibration of window k
    /// takes effect at the first tick of window k + 2. A later one takes effect at the start of the next window. Until
    /// the learner has caught up every tick raises [`status::CALIBRATION_LATE`]. A calibration of a window that has not
    /// begun is of another test, and has no effect.
    ///
    /// # Cost
    /// A copy of the calibration. With a plausibility watch there is a second copy each half second.
    #[inline(always)]
    pub fn publish(&self, state: &mut ChannelState<T>, calibration: impl Borrow<Calibration<T>>) {
        let calibration: &Calibration<T> = calibration.borrow();
        let mut age = state.window.number.wrapping_sub(calibration.window);
        // The numbers wrap, so half of them are behind the present one.
        if age > u32::MAX / 2 {
            return;
        }
        // This calibration is from the window that has just closed. An earlier unused one takes effect now.
        if state.ticks_left == 0 && age == 0 {
            state.begin_window(self.window_ticks);
            age = 1;
        }
        let slot = state.in_use.slot.other();
        let late = if age > 1 { status::CALIBRATION_LATE } else { 0 };
        state.next = CalibrationChoice { slot, flags: calibration.status | late };
        state.windows_left = self.age_limit.saturating_sub(age);
        slot.put(&mut state.calibrations, calibration);
        if self.plausibility.is_some() {
            state.history.record(calibration);
        }
    }

    /// Repeats the last output and raises [`status::HELD`]; the state stays. For several ticks call
    /// [`step`](Self::step) with a measurement that is NaN instead, so that nothing is learned from the gap. Velocity
    /// and permitted command are NaN; an analog controller keeps its last command.
    pub fn hold(&self, state: &ChannelState<T>) -> Output<T> {
        let out = self.controller.hold(&state.controller);
        let authority = match &self.protection {
            Some(p) => p.authority(&state.protection),
            None => T::splat(1.0),
        };
        let digital = self.realization == Realization::Digital;
        Output {
            voltage: if digital {
                self.closing(state, out.valve_command, authority)
            } else {
                out.valve_command
            },
            compensation: out.compensation,
            velocity: T::splat(f64::NAN),
            permitted_command: T::splat(f64::NAN),
            authority,
            status: out.status,
            window: None,
        }
    }

    /// Sets the state to that of a rig that has long been at this operating point. The next [`step`](Self::step) with
    /// the same input has no bump. The calibration, the force loop's integral and the protection keep their state. A
    /// window begins, and the plausibility watch begins anew, apart from the sensors that it distrusts. An estimated
    /// velocity is that of a displacement at rest. An invalid input gives a rig at rest.
    pub fn prime(&self, state: &mut ChannelState<T>, input: &Input<T>) {
        let velocity = if matches!(self.velocity, Velocity::Sensor) { input.velocity } else { T::splat(0.0) };
        let controller_input = ControllerInput {
            command: input.command,
            next_command: input.next_command,
            velocity,
            force: input.force,
            spool: input.spool,
            supply_pressure: input.supply_pressure,
        };
        state.controller = self.controller.prime(&state.controller, &controller_input, state.calibration());
        state.plausibility = state.plausibility.restarted(self.controller.null_opening(state.calibration()));
        state.stuck = StuckWatchState::default();
        state.velocity_gap = NEVER;
        if is_valid(input.displacement) {
            resume(&self.velocity, state, input);
        }
        if state.ticks_left == 0 {
            state.begin_window(self.window_ticks);
        }
        (state.ticks_left, state.window) = (self.window_ticks, Window::first(state.window.number));
    }

    /// Continues a state under another configuration of the same sample rate, without a bump unless the last valve
    /// command is beyond the new limit. Another level, mode or flow table is a step of the compensation, which the lead
    /// network enlarges up to `1/α` times, so change these at rest. An estimate of the velocity from another source
    /// starts at rest from the next displacement, so change the source at rest. Only an observer keeps its drift from
    /// the one before it, with or without an accelerometer. If this configuration learns nothing, its calibration is
    /// used at once. Otherwise the one in use stays until the new learner publishes. The lead network of a learned
    /// calibration contains `1/(G_p·K_s)` of its own configuration. If this product changes, the compensation is too
    /// large or too small by the ratio until then. Change these gains at rest, or while nothing is learned. A trip
    /// stays in the state, but a configuration without a protection follows the command again.
    pub fn take_over(&self, state: &mut ChannelState<T>) {
        self.controller.take_over(&mut state.controller);
        if !self.velocity.take_over(&mut state.velocity) {
            state.velocity_gap = NEVER;
        }
        if !self.learns {
            let ChannelState { controller, velocity, velocity_gap, protection, plausibility, stuck, .. } =
                *state;
            let at_rest = self.at_rest();
            *state = ChannelState {
                controller,
                velocity,
                velocity_gap,
                protection,
                plausibility,
                stuck,
                ..at_rest
            };
        } else if state.windows_left > self.age_limit {
            state.windows_left = self.age_limit;
        }
    }
}
