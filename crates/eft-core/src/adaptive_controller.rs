//! The whole adaptive tick: compensation, servovalve controller, limits.

use crate::adaptive::{AdaptiveCompensation, AdaptiveCompensationState};
use crate::compensation::CompensationState;
use crate::controller::ControllerOutput;
use crate::limiter::Limiter;
use crate::scalar::{Mask, Scalar};
use crate::servovalve_controller::{ServovalveController, ServovalveControllerState};
use crate::status;
use crate::window::Measurements;

/// An adaptive controller's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveController<S: Scalar, const N: usize> {
    /// Compensation with feedforward and estimators.
    pub compensation: AdaptiveCompensation<S, N>,
    /// Eq. (1).
    pub servovalve: ServovalveController<S>,
    /// Limits of the valve command.
    pub limiter: Limiter<S>,
}

/// What the adaptive controller remembers; made by [`AdaptiveController::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct AdaptiveControllerState<S: Scalar> {
    servovalve: ServovalveControllerState<S>,
    valve_command: S,
    // Last: it is long, and what lies beyond a kilobyte takes an instruction more to reach.
    /// The compensation's part: all there is where an analog controller follows it.
    pub compensation: AdaptiveCompensationState<S>,
}

impl<S: Scalar, const N: usize> AdaptiveController<S, N> {
    /// A rig at rest, nothing learned yet.
    pub fn at_rest(&self) -> AdaptiveControllerState<S> {
        AdaptiveControllerState {
            compensation: self.compensation.at_rest(),
            servovalve: ServovalveControllerState::default(),
            valve_command: S::splat(0.0),
        }
    }

    /// Controllers of single rigs side by side, all sampled at one rate.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a AdaptiveController<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            compensation: AdaptiveCompensation::pack(|i| &lane(i).compensation),
            servovalve: ServovalveController::pack(|i| &lane(i).servovalve),
            limiter: Limiter::pack(|i| &lane(i).limiter),
        }
    }

    /// One tick: the valve command (V) for the force command (N) and the measurements, of which the valve command is
    /// replaced by the controller's own last one.
    ///
    /// # NaN
    /// With an invalid command or measurement the last valve command is held, and
    /// [`status::INVALID_COMMAND`] or [`status::INVALID_MEASUREMENT`] is raised.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut AdaptiveControllerState<S>,
        command: S,
        measured: &Measurements<S>,
    ) -> ControllerOutput<S> {
        self.step_ahead(state, command, command, measured)
    }

    /// As [`step`](Self::step), where the next sample's command (N) is known, as of a ground motion: the flow that is
    /// fed forward is then that of the time until the next sample, not of the time since the last.
    ///
    /// # NaN
    /// A next command that is not finite or beyond its range counts as the last one.
    #[inline(always)]
    pub fn step_ahead(
        &self,
        state: &mut AdaptiveControllerState<S>,
        command: S,
        next_command: S,
        measured: &Measurements<S>,
    ) -> ControllerOutput<S> {
        self.step_via(state, command, next_command, measured, |compensation| compensation)
    }

    /// As [`step_ahead`](Self::step_ahead), with the compensation signal (V) passed through `path` on its way to the
    /// servovalve controller.
    #[inline(always)]
    pub fn step_via(
        &self,
        state: &mut AdaptiveControllerState<S>,
        command: S,
        next_command: S,
        measured: &Measurements<S>,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        self.compensation.adaptation.work(&mut state.compensation.adaptation);
        let measured = Measurements { valve_command: state.valve_command, ..*measured };
        let supply = measured.supply_pressure / self.compensation.supply_pressure;
        let good = self.compensation.valid(command, &measured, supply);
        if !good.any() {
            let status = self.compensation.idle(&mut state.compensation, command, next_command);
            let compensation = path(state.compensation.output());
            return ControllerOutput { valve_command: state.valve_command, compensation, status };
        }
        let (next, flags) =
            self.compensation.advance(&mut state.compensation, next_command, &measured, supply);
        let next = CompensationState::select(good, next, state.compensation.compensation);
        state.compensation.compensation = next;
        let compensation = path(next.output());
        let mut servovalve = state.servovalve;
        let raw = self.servovalve.step(&mut servovalve, command, measured.force, compensation);
        let (valve_command, limits) = self.limiter.apply(raw, state.valve_command);
        state.servovalve = ServovalveControllerState::select(good, servovalve, state.servovalve);
        state.valve_command = S::select(good, valve_command, state.valve_command);
        let learner = &mut state.compensation.adaptation;
        learner.window.collect(command, &measured, supply, good);
        let status = S::select_flags(good, flags | limits, self.compensation.faults(command));
        ControllerOutput { valve_command: state.valve_command, compensation, status: status | learner.flags }
    }

    /// Repeats the last valve command and raises [`status::HELD`]; the state stays. Behind a protection the command has
    /// to pass it as any other; for several ticks give [`step`](Self::step) a measurement that is NaN instead, so that
    /// nothing is learned of the gap.
    pub fn hold(&self, state: &AdaptiveControllerState<S>) -> ControllerOutput<S> {
        ControllerOutput {
            valve_command: state.valve_command,
            compensation: state.compensation.output(),
            status: S::flag(S::Mask::splat(true), status::HELD),
        }
    }

    /// The state of a rig that has long been at this operating point, nothing learned yet: the next
    /// [`step`](Self::step) with the same arguments gives this state's output, without a bump. Invalid arguments give
    /// the state of a rig at rest; the measured valve command plays no part.
    pub fn prime(&self, command: S, measured: &Measurements<S>) -> AdaptiveControllerState<S> {
        let measured = Measurements { valve_command: S::splat(0.0), ..*measured };
        let supply = measured.supply_pressure / self.compensation.supply_pressure;
        let good = self.compensation.valid(command, &measured, supply);
        let zero = S::splat(0.0);
        let or_zero = |value| S::select(good, value, zero);
        let command = or_zero(command);
        let measured = Measurements {
            velocity: or_zero(measured.velocity),
            force: or_zero(measured.force),
            spool: or_zero(measured.spool),
            ..measured
        };
        let compensation = self.compensation.prime(command, &measured);
        let mut servovalve = self.servovalve.at_rest(command, measured.force);
        let raw = self.servovalve.step(&mut servovalve, command, measured.force, compensation.output());
        AdaptiveControllerState { compensation, servovalve, valve_command: self.limiter.settled(raw) }
    }
}
