//! The controller at rest and at a steady operating point.

use crate::compensation::{Calibration, CompensationInput, CompensationState};
use crate::controller::{Controller, ControllerInput, ControllerState};
use crate::number::{Mask, Scalar};
use crate::parameters::Realization;

impl<S: Scalar, const N: usize> Controller<S, N> {
    /// The state of a rig that has long been at this operating point, with the force loop's integral of an earlier
    /// state. The next [`step`](Self::step) with the same arguments gives this state's output, without a bump. An
    /// invalid input gives the state of a rig at rest.
    pub fn prime(
        &self,
        before: &ControllerState<S>,
        input: &ControllerInput<S>,
        calibration: &Calibration<S>,
    ) -> ControllerState<S> {
        // After long at one command, the next one is the same.
        let input = &ControllerInput { next_command: input.command, ..*input };
        let valid = self.accepts(input);
        ControllerState::select(
            valid,
            self.steady_state(before, input, calibration),
            self.at_rest_with(calibration),
        )
    }

    /// The steady state at a valid input.
    fn steady_state(
        &self,
        before: &ControllerState<S>,
        input: &ControllerInput<S>,
        calibration: &Calibration<S>,
    ) -> ControllerState<S> {
        let friction = self.friction(input.velocity);
        let feedforward = self.feedforward.at_rest(self.feedforward_command(input), friction);
        let mut measured = *before;
        let supply = self.supply(&mut measured, input.supply_pressure);
        let further_flow = self.further_flow(&mut { feedforward }, input, friction);
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        let expected = S::select(self.looks_ahead, command, force);
        let oil_force = friction.map_or(expected, |friction| expected + friction);
        let sample =
            CompensationInput { velocity, force: oil_force, spool, supply: supply.ratio, further_flow };
        let (opening, _) = self.compensation.required_opening(&sample, calibration);
        let low_passed = self.overlap.combined_opening(opening, command - force, before.integral);
        let opening = if self.has_overlap() { self.overlap.add_step(low_passed, opening) } else { opening };
        let resumed_state = CompensationState::default().resumed(S::Mask::splat(true), opening);
        let compensation = self.compensation.advance(&resumed_state, opening, calibration);
        let (mut servovalve, integral) = (self.servovalve.at_rest(command, force), before.integral);
        let mut raw = self.servovalve.step(&mut servovalve, command, force, compensation.output());
        if self.integrates() {
            raw = raw + integral;
        }
        let valve_command = match self.realization {
            Realization::Digital => self.limiter.settled(raw),
            Realization::Analog => compensation.output(),
        };
        let refused_samples = S::Flags::default();
        let supply = measured.supply;
        ControllerState {
            compensation,
            feedforward,
            low_passed,
            servovalve,
            integral,
            valve_command,
            refused_samples,
            supply,
        }
    }

    /// The state of a rig at rest, with the valve at its known null.
    pub fn at_rest(&self) -> ControllerState<S> {
        self.at_rest_with(&self.nominal())
    }

    /// The state of a rig at rest, with the valve at the null of a calibration. An integral part holds what the
    /// compensation does not supply.
    pub fn at_rest_with(&self, calibration: &Calibration<S>) -> ControllerState<S> {
        let signal = self.compensation.null_signal(calibration);
        let residual_signal = self.compensation.residual_null_signal(calibration);
        let integral = self.integral.limited(self.servovalve.proportional_gain * residual_signal);
        ControllerState {
            compensation: CompensationState::holding(signal),
            valve_command: self.command_at_rest(signal, integral),
            integral,
            ..ControllerState::default()
        }
    }

    /// The compensation signal (V) that holds the valve at the null of a calibration.
    pub fn null_signal(&self, calibration: &Calibration<S>) -> S {
        self.compensation.null_signal(calibration)
    }

    /// The spool's opening (1) at the null of a calibration.
    pub(crate) fn null_opening(&self, calibration: &Calibration<S>) -> S {
        self.compensation.null_opening(calibration)
    }

    /// The valve command (V) at rest; for an analog controller the compensation signal.
    fn command_at_rest(&self, signal: S, integral: S) -> S {
        match self.realization {
            Realization::Digital => {
                self.limiter.settled(self.servovalve.proportional_gain * signal + integral)
            }
            Realization::Analog => signal,
        }
    }

    /// A share (1) of a valve command (V), and for the rest the command of a closed valve: that of the known null and
    /// an opening (1) beyond it.
    #[inline(always)]
    pub(crate) fn closing(&self, valve_command: S, share: S, beyond: S) -> S {
        let closed = self.command_at_rest(self.compensation.null_signal_beyond(beyond), S::splat(0.0));
        share * valve_command + (S::splat(1.0) - share) * closed
    }
}
