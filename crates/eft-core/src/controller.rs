//! The controller: compensation, feedforward, force loop and limits, for one rig or for several in lanes.

mod construction;
mod signals;
mod state;
mod steady_state;

use crate::compensation::{
    Calibration, Compensation, CompensationInput, CompensationState, Feedforward, FeedforwardState, Friction,
    OverlapStep,
};
use crate::error::{ConfigError, LARGEST, check};
use crate::force_loop::{Integral, Limiter, ServovalveController, ServovalveControllerState};
use crate::integrity::integrity;
use crate::number::{Flags, Mask, Scalar};
use crate::parameters::{Parameters, Realization};
use crate::protection::samples;
use crate::status;

pub use signals::{ControllerInput, ControllerOutput};
pub(crate) use signals::{Sample, Supply};
pub use state::ControllerState;

/// A controller's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Controller<S: Scalar, const N: usize> {
    /// Velocity feedback compensation.
    pub(crate) compensation: Compensation<S, N>,
    feedforward: Feedforward<S>,
    /// Friction of the seals.
    pub(crate) friction: Friction<S>,
    servovalve: ServovalveController<S>,
    limiter: Limiter<S>,
    /// 1 over the configured supply pressure (1/Pa).
    per_supply_pressure: S,
    /// Where the supply pressure is measured.
    pub(crate) measures_supply: S::Mask,
    /// Where the feedforward uses the next tick's command.
    looks_ahead: S::Mask,
    /// After more lost samples than this the tick resumes at the new operating point.
    gap: S::Flags,
    /// Whether any lane has a feedforward.
    feeds_forward: bool,
    realization: Realization,
    integral: Integral<S>,
    /// Overlap of the spool's lands.
    overlap: OverlapStep<S>,
}
integrity!(
    Controller<T, N>: compensation, feedforward, friction, servovalve, limiter, per_supply_pressure, measures_supply,
    looks_ahead, gap, feeds_forward, realization, integral, overlap
);

/// The tick resumes at the new operating point after this many lost samples, which last longer than the gap time.
pub(crate) const fn gap(p: &Parameters) -> Result<u32, ConfigError> {
    Ok(check!(samples("gap_time", p.gap_time, p.sample_rate)).saturating_add(1))
}

/// Share of a deviation below the configured supply pressure that remains after a tick without a valid measurement.
const RETURN: f64 = 1.0 - 1.0 / 2048.0;

impl<S: Scalar, const N: usize> Controller<S, N> {
    /// One tick with a calibration. The compensation signal (V) goes through `path` on its way to the force loop, for
    /// example through a computation delay.
    ///
    /// # NaN
    /// An invalid supply pressure (not finite, below 1/20 or beyond 4 times the configured one) is replaced by the last
    /// valid one, and [`status::STUCK_MEASUREMENT`] is raised. With another invalid measurement or an invalid command
    /// (not finite, or beyond [`LARGEST`]) the last valve command is held, the state stays and
    /// [`status::INVALID_COMMAND`] or [`status::INVALID_MEASUREMENT`] is raised. Only the supply pressure continues,
    /// and the feedforward with a valid command, so that the next one's rate is that of one tick. After more than
    /// [`gap_time`](Parameters::gap_time) of such samples the next good one resumes at the new operating point. The
    /// valve command stays within its rate.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut ControllerState<S>,
        input: &ControllerInput<S>,
        calibration: &Calibration<S>,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        let supply = self.supply(state, input.supply_pressure);
        let sample = self.sample(state, input, supply);
        if sample.valid.any() {
            self.step_valid(state, sample, calibration, path)
        } else {
            self.step_invalid(state, sample, path)
        }
    }

    /// An input with its checks and those of the supply.
    #[inline(always)]
    pub(crate) fn sample<'a>(
        &self,
        state: &ControllerState<S>,
        input: &'a ControllerInput<S>,
        supply: Supply<S>,
    ) -> Sample<'a, S> {
        let valid = self.accepts(input);
        let resumes = S::at_least(state.refused_samples, self.gap);
        let friction = self.friction(input.velocity);
        let (looks_ahead, integrates, has_overlap) =
            (self.looks_ahead.any(), self.integrates(), self.has_overlap());
        Sample { input, supply, valid, resumes, looks_ahead, integrates, has_overlap, friction }
    }

    /// The part of [`step`](Self::step) for a sample that is good in any lane.
    #[inline(always)]
    pub(crate) fn step_valid(
        &self,
        state: &mut ControllerState<S>,
        sample: Sample<'_, S>,
        calibration: &Calibration<S>,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        let Sample { input, supply, valid, resumes, looks_ahead, integrates, has_overlap, friction } = sample;
        let resumes = valid & resumes;
        let friction = friction.map(|friction| state.feedforward.friction_where(valid, friction));
        let last = self.limiter.within(state.valve_command);
        if self.feeds_forward && resumes.any() {
            // This tick's command replaces a lost next one.
            let mut resumed_state = self.feedforward.at_rest(input.command, friction);
            self.feedforward.step(&mut resumed_state, self.feedforward_command(input), friction);
            state.feedforward = FeedforwardState::select(resumes, resumed_state, state.feedforward);
        }
        let further_flow = self.further_flow(&mut state.feedforward, input, friction);
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        let oil_force = sample.oil_force(if looks_ahead { self.expected_force(state, force) } else { force });
        let measured =
            CompensationInput { velocity, force: oil_force, spool, supply: supply.ratio, further_flow };
        let (opening, flags) = self.compensation.required_opening(&measured, calibration);
        let opening = if has_overlap {
            let sum = self.overlap.combined_opening(opening, command - force, state.integral);
            let low_passed = S::select(resumes, sum, self.overlap.low_passed(state.low_passed, sum));
            state.low_passed = S::select(valid, low_passed, state.low_passed);
            self.overlap.add_step(state.low_passed, opening)
        } else {
            opening
        };
        if resumes.any() {
            state.compensation = state.compensation.resumed(resumes, opening);
            let resumed_state = self.servovalve.at_rest(command, force);
            state.servovalve = ServovalveControllerState::select(resumes, resumed_state, state.servovalve);
        }
        let next = self.compensation.advance(&state.compensation, opening, calibration);
        let next = CompensationState::select(valid, next, state.compensation);
        let compensation = path(next.output());
        let mut servovalve = state.servovalve;
        let (valve_command, limits) = match self.realization {
            Realization::Digital => {
                let mut raw = self.servovalve.step(&mut servovalve, command, force, compensation);
                if integrates {
                    raw = raw + self.integral.step(&mut state.integral, valid, command - force);
                }
                self.limiter.apply(raw, last)
            }
            Realization::Analog => (compensation, S::Flags::default()),
        };
        state.compensation = next;
        state.servovalve = ServovalveControllerState::select(valid, servovalve, state.servovalve);
        state.valve_command = S::select(valid, valve_command, state.valve_command);
        let mut status = flags | limits | supply.held_flag();
        if valid.all() {
            state.refused_samples = S::Flags::default();
        } else {
            state.count(valid);
            let faults = self.faults(command, velocity, force, spool) | supply.held_flag();
            status = S::select_flags(valid, status, faults);
        }
        ControllerOutput { valve_command: state.valve_command, compensation, status }
    }

    /// The part of [`step`](Self::step) for a sample that is good in no lane.
    #[inline(always)]
    pub(crate) fn step_invalid(
        &self,
        state: &mut ControllerState<S>,
        sample: Sample<'_, S>,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        let Sample { input, supply, .. } = sample;
        self.further_flow(&mut state.feedforward, input, None);
        state.count(S::Mask::splat(false));
        let ControllerInput { command, velocity, force, spool, .. } = *input;
        self.repeat_last(state, self.faults(command, velocity, force, spool) | supply.held_flag(), path)
    }

    /// The last output with these flags.
    #[inline(always)]
    pub(crate) fn repeat_last(
        &self,
        state: &ControllerState<S>,
        status: S::Flags,
        path: impl FnOnce(S) -> S,
    ) -> ControllerOutput<S> {
        let compensation = path(state.compensation.output());
        ControllerOutput { valve_command: state.valve_command, compensation, status }
    }

    /// Repeats the last valve command and raises [`status::HELD`]; the state stays.
    pub fn hold(&self, state: &ControllerState<S>) -> ControllerOutput<S> {
        self.repeat_last(state, S::flag(S::Mask::splat(true), status::HELD), |compensation| compensation)
    }

    /// Brings the last valve command of another configuration within the limit, for samples that repeat it.
    pub(crate) fn take_over(&self, state: &mut ControllerState<S>) {
        if self.realization == Realization::Digital {
            state.valve_command = self.limiter.within(state.valve_command);
        }
    }

    /// The calibration of the configuration, which is the paper's scheme.
    #[inline(always)]
    pub fn nominal(&self) -> Calibration<S> {
        self.compensation.nominal()
    }

    /// Whether any lane's calibration corrects the flow curve.
    pub(crate) fn corrects(&self) -> bool {
        self.compensation.corrects()
    }

    /// Whether any lane's force loop has an integral part.
    pub(crate) const fn integrates(&self) -> bool {
        self.integral.is_present()
    }

    /// Whether any lane has an overlap.
    pub(crate) const fn has_overlap(&self) -> bool {
        self.overlap.is_present()
    }

    /// How the force loop is closed.
    pub(crate) fn realization(&self) -> Realization {
        self.realization
    }

    /// Controllers of single rigs in lanes, all of one realization.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a Controller<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            compensation: Compensation::pack(&|i| &lane(i).compensation),
            feedforward: Feedforward::pack(&|i| &lane(i).feedforward),
            friction: Friction::pack(&|i| &lane(i).friction),
            overlap: OverlapStep::pack(&|i| &lane(i).overlap),
            servovalve: ServovalveController::pack(&|i| &lane(i).servovalve),
            integral: Integral::pack(&|i| &lane(i).integral),
            limiter: Limiter::pack(&|i| &lane(i).limiter),
            per_supply_pressure: S::from_lanes(|i| lane(i).per_supply_pressure),
            measures_supply: S::Mask::from_lanes(|i| lane(i).measures_supply),
            looks_ahead: S::Mask::from_lanes(|i| lane(i).looks_ahead),
            gap: S::Flags::from_lanes(|i| lane(i).gap),
            feeds_forward: (0..S::LANES).any(|i| lane(i).feeds_forward),
            realization: lane(0).realization,
        }
    }

    /// The supply from its measured pressure (Pa), or from the last valid one.
    // Value and validity are in one branch, so that a rig without the measurement pays for neither.
    #[inline(always)]
    pub(crate) fn supply(&self, state: &mut ControllerState<S>, pressure: S) -> Supply<S> {
        if !self.measures_supply.any() {
            return Supply::nominal();
        }
        let one = S::splat(1.0);
        let measured = S::select(self.measures_supply, pressure * self.per_supply_pressure, one);
        let valid = (measured - S::splat(2.025)).abs().le(S::splat(1.975));
        // A low ratio that no longer holds would overcompensate the motion, so it returns to the configured pressure.
        let held = S::select(state.supply.lt(S::splat(0.0)), S::splat(RETURN) * state.supply, state.supply);
        let ratio = S::select(valid, measured, one + held);
        state.supply = ratio - one;
        Supply { ratio, valid }
    }

    /// Where the input is valid. The last valid supply pressure replaces an invalid one.
    #[inline(always)]
    pub(crate) fn accepts(&self, i: &ControllerInput<S>) -> S::Mask {
        i.command.abs().le(S::splat(LARGEST)) & self.compensation.accepts(i.velocity, i.force, i.spool)
    }

    // By value and not inlined, so that a good tick does not pay for these checks.
    #[cold]
    #[inline(never)]
    fn faults(&self, command: S, velocity: S, force: S, spool: S) -> S::Flags {
        let commanded = command.abs().le(S::splat(LARGEST));
        let measured = self.compensation.accepts(velocity, force, spool);
        S::flag(!commanded, status::INVALID_COMMAND) | S::flag(!measured, status::INVALID_MEASUREMENT)
    }

    /// The flow (m³/s) that is demanded in addition to the piston's.
    #[inline(always)]
    fn further_flow(
        &self,
        feedforward: &mut FeedforwardState<S>,
        i: &ControllerInput<S>,
        friction: Option<S>,
    ) -> S {
        if !self.feeds_forward {
            return S::splat(0.0);
        }
        self.feedforward.step(feedforward, self.feedforward_command(i), friction)
    }

    /// The friction (N) at a velocity (m/s); `None` if no lane has any.
    #[inline(always)]
    fn friction(&self, velocity: S) -> Option<S> {
        self.friction.is_present().then(|| self.friction.against(velocity))
    }

    /// The force (N) of the load-pressure correction: the last valid command of the feedforward if it looks ahead,
    /// otherwise the measured force.
    ///
    /// A valve passes less flow against a larger load pressure, and this damps the oil column. To correct for the
    /// measured force removes the damping, and behind a late load cell adds energy.
    #[inline(always)]
    fn expected_force(&self, state: &ControllerState<S>, force: S) -> S {
        S::select(self.looks_ahead, state.feedforward.command(), force)
    }

    /// The command (N) that the feedforward uses.
    #[inline(always)]
    fn feedforward_command(&self, i: &ControllerInput<S>) -> S {
        S::select(self.looks_ahead, i.next_command, i.command)
    }
}
