//! The whole tick: compensation, servovalve controller, limits.

use crate::compensation::{Compensation, CompensationState};
use crate::error::LARGEST;
use crate::limiter::Limiter;
use crate::scalar::{Mask, Scalar};
use crate::servovalve_controller::{ServovalveController, ServovalveControllerState};
use crate::status;

/// A controller's immutable configuration; one drives any number of channels.
// The compensation comes first: its address is then the controller's own.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Controller<S: Scalar, const N: usize> {
    /// Velocity feedback compensation.
    pub compensation: Compensation<S, N>,
    /// Eq. (1).
    pub servovalve: ServovalveController<S>,
    /// Limits of the valve command.
    pub limiter: Limiter<S>,
}

/// What the controller remembers. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct ControllerState<S> {
    /// The compensation's part: all there is where an analog controller follows it.
    pub compensation: CompensationState<S>,
    servovalve: ServovalveControllerState<S>,
    valve_command: S,
}

/// One tick's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerOutput<S: Scalar> {
    /// The valve command `v` (V).
    pub valve_command: S,
    /// The compensation signal `v_c` (V) in it.
    pub compensation: S,
    /// Bits of [`status`].
    pub status: S::Flags,
}

impl<S: Scalar, const N: usize> Controller<S, N> {
    /// One tick: the valve command (V) for the force command (N) and the measured piston velocity (m/s), force (N)
    /// and spool opening (1).
    ///
    /// # NaN
    /// With an invalid measurement or command (not finite, or beyond [`LARGEST`]) the last valve
    /// command is held, the state stays and [`status::INVALID_COMMAND`] or [`status::INVALID_MEASUREMENT`] is
    /// raised.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut ControllerState<S>,
        command: S,
        velocity: S,
        force: S,
        spool: S,
    ) -> ControllerOutput<S> {
        self.step_via(state, command, velocity, force, spool, S::splat(0.0), |compensation| compensation)
    }

    /// As [`step`](Self::step), with a further flow (m³/s) wanted on top of the piston's (of a
    /// [`Feedforward`](crate::Feedforward), for example), and with the compensation signal (V) passed through `path`
    /// on its way to the servovalve controller (a computation delay, for example).
    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // one per wire
    pub fn step_via(
        &self,
        state: &mut ControllerState<S>,
        command: S,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        let measured =
            self.compensation.accepts(velocity, force, spool) & further_flow.abs().le(S::splat(LARGEST));
        let commanded = command.abs().le(S::splat(LARGEST));
        let good = commanded & measured;
        let faults =
            S::flag(!commanded, status::INVALID_COMMAND) | S::flag(!measured, status::INVALID_MEASUREMENT);
        if !good.any() {
            let compensation = path(state.compensation.output());
            return ControllerOutput { valve_command: state.valve_command, compensation, status: faults };
        }
        let (next, flags) =
            self.compensation.advance(&state.compensation, velocity, force, spool, further_flow);
        let next = CompensationState::select(good, next, state.compensation);
        let compensation = path(next.output());
        let mut servovalve = state.servovalve;
        let raw = self.servovalve.step(&mut servovalve, command, force, compensation);
        let (valve_command, limits) = self.limiter.apply(raw, state.valve_command);
        *state = ControllerState::select(
            good,
            ControllerState { compensation: next, servovalve, valve_command },
            *state,
        );
        ControllerOutput {
            valve_command: state.valve_command,
            compensation,
            status: S::select_flags(good, flags | limits, faults),
        }
    }

    /// Repeats the last valve command and raises [`status::HELD`]; the state stays.
    pub fn hold(&self, state: &ControllerState<S>) -> ControllerOutput<S> {
        ControllerOutput {
            valve_command: state.valve_command,
            compensation: state.compensation.output(),
            status: S::flag(S::Mask::splat(true), status::HELD),
        }
    }

    /// The state of a rig that has long been at this operating point: the next [`step`](Self::step) (or
    /// [`step_via`](Self::step_via), with the same further flow in m³/s) with the same arguments gives this state's
    /// output, without a bump. Invalid arguments give the state of a rig at rest.
    pub fn prime(&self, command: S, velocity: S, force: S, spool: S, further_flow: S) -> ControllerState<S> {
        let compensation = self.compensation.prime(velocity, force, spool, further_flow);
        let mut servovalve = self.servovalve.at_rest(command, force);
        let raw = self.servovalve.step(&mut servovalve, command, force, compensation.output());
        let valve_command = self.limiter.settled(raw);
        let good = command.abs().le(S::splat(LARGEST))
            & self.compensation.accepts(velocity, force, spool)
            & further_flow.abs().le(S::splat(LARGEST));
        ControllerState::select(
            good,
            ControllerState { compensation, servovalve, valve_command },
            ControllerState::default(),
        )
    }

    /// Controllers of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a Controller<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            compensation: Compensation::pack(|i| &lane(i).compensation),
            servovalve: ServovalveController::pack(|i| &lane(i).servovalve),
            limiter: Limiter::pack(|i| &lane(i).limiter),
        }
    }
}

impl<S: Scalar> ControllerState<S> {
    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            compensation: CompensationState::select(mask, yes.compensation, no.compensation),
            servovalve: ServovalveControllerState::select(mask, yes.servovalve, no.servovalve),
            valve_command: S::select(mask, yes.valve_command, no.valve_command),
        }
    }
}
