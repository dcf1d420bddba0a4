//! The slow side of the adaptive controller: from means over a window of ticks to the next window's calibration.
//!
//! Each tick adds its measurements to the window's sums and does one slot of the work on the window before, so the
//! cost of a tick is bounded and even, whatever the estimators cost together.

use crate::band_filter::{BandFilter, BandState};
use crate::flow_gain::{FlowGainEstimator, FlowGainState};
use crate::flow_prediction::FlowPrediction;
use crate::guard::{Guard, GuardState};
use crate::lead::LeadNetwork;
use crate::scalar::{Mask, Scalar, pack_numbers};
use crate::status;
use crate::valve_estimator::{ValveEstimator, ValveState};

/// Ticks in which all slots are done once; a window is no shorter.
pub(crate) const SLOTS: u32 = 8;

/// What the controller measures at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurements<S> {
    /// Piston velocity (m/s).
    pub velocity: S,
    /// Force (N).
    pub force: S,
    /// Spool opening (1).
    pub spool: S,
    /// Valve command (V) that stood when the others were sampled.
    pub valve_command: S,
    /// Supply pressure (Pa); the configured one where there is no transducer.
    pub supply_pressure: S,
}

/// Estimators, guard and the schedule between them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Adaptation<S: Scalar, const N: usize> {
    /// Ticks of a window, a power of two.
    pub(crate) window: u32,
    pub(crate) per_window: S,
    /// Whether the calibration may move; otherwise it stays the configured one.
    pub(crate) adapting: S::Mask,
    pub(crate) guarding: S::Mask,
    pub(crate) piston_area: S,
    pub(crate) flow_per_force: S,
    /// Flow (m³/s) per change of force (N) over a window.
    pub(crate) flow_per_change: S,
    pub(crate) prediction: FlowPrediction<S, N>,
    pub(crate) filter: BandFilter<S>,
    pub(crate) flow_gain: FlowGainEstimator<S>,
    pub(crate) valve: ValveEstimator<S>,
    pub(crate) guard: Guard<S>,
    pub(crate) trust: Trust<S>,
}

/// When a window's evidence counts, and for how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Trust<S> {
    /// Openings (1) beyond which the valve is taken to be saturated.
    pub(crate) linear_range: S,
    /// Square of the opening (1) below which nothing is learned.
    pub(crate) excitation: S,
    /// Weight of a squared change per step in that comparison.
    pub(crate) change_weight: S,
    /// Square of the opening (1) per square of a flow (m³/s), for comparing the two models' errors.
    pub(crate) per_square_flow: S,
    /// Share of the way the errors' averages go in a step.
    pub(crate) average: S,
    /// Part of the signals' squares that the models' errors may have.
    pub(crate) error_share: S,
    /// Period of the estimators (s).
    pub(crate) period: S,
    /// Evidence (s, of squared opening × time) that is never forgotten.
    pub(crate) kept: S,
    /// Evidence (s) at which half of the shortest memory is reached.
    pub(crate) half: S,
    /// Share forgotten in a step at the most.
    pub(crate) forgotten: S,
    /// Windows without learning after a fault.
    pub(crate) quarantine: S,
}

pack_numbers!(Trust: linear_range, excitation, change_weight, per_square_flow, average, error_share, period, kept, half, forgotten, quarantine);

/// Everything the slow side remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct AdaptationState<S> {
    tick: u32,
    sums: Window<S>,
    means: Window<S>,
    last_force: S,
    last_command: S,
    force_change: S,
    command_change: S,
    evidence: S,
    keep: S,
    weight: S,
    quarantine: S,
    /// 1 where the filters have taken in the last window.
    started: S,
    signal: S,
    error: S,
    /// Share of the way that the filters' means go in this window.
    mean_share: S,
    asked: S,
    asked_change: S,
    spool: S,
    predicted: S,
    flow: S,
    asked_filter: BandState<S>,
    spool_filter: BandState<S>,
    predicted_filter: BandState<S>,
    flow_filter: BandState<S>,
    pub(crate) flow_gain: FlowGainState<S>,
    pub(crate) valve: ValveState<S>,
    pub(crate) guard: GuardState<S>,
    pub(crate) lead: LeadNetwork<S>,
    /// 1 where a bound holds an estimate.
    bounded: S,
}

/// Sums or means over a window.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
struct Window<S> {
    ticks: S,
    velocity: S,
    force: S,
    spool: S,
    valve_command: S,
    command: S,
}

impl<S: Scalar> AdaptationState<S> {
    pub(crate) fn new(delay: S, lead: LeadNetwork<S>) -> Self {
        let zero = S::splat(0.0);
        Self {
            tick: 0,
            sums: Window::default(),
            means: Window::default(),
            last_force: zero,
            last_command: zero,
            force_change: zero,
            command_change: zero,
            evidence: zero,
            keep: S::splat(1.0),
            weight: zero,
            quarantine: zero,
            started: zero,
            signal: zero,
            error: zero,
            mean_share: S::splat(1.0),
            asked: zero,
            asked_change: zero,
            spool: zero,
            predicted: zero,
            flow: zero,
            asked_filter: BandState::default(),
            spool_filter: BandState::default(),
            predicted_filter: BandState::default(),
            flow_filter: BandState::default(),
            flow_gain: FlowGainState::default(),
            valve: ValveState::new(delay),
            guard: GuardState::default(),
            lead,
            bounded: zero,
        }
    }
}

impl<S: Scalar, const N: usize> Adaptation<S, N> {
    /// One tick: the measurements and the command where they are valid, one slot of the window's work everywhere.
    #[inline(always)]
    pub(crate) fn step(
        &self,
        state: &mut AdaptationState<S>,
        command: S,
        measured: &Measurements<S>,
        supply_ratio: S,
        valid: S::Mask,
    ) -> S::Flags {
        let zero = S::splat(0.0);
        let add = |sum: &mut S, value: S| *sum = *sum + S::select(valid, value, zero);
        add(&mut state.sums.ticks, S::splat(1.0));
        add(&mut state.sums.velocity, measured.velocity);
        add(&mut state.sums.force, measured.force);
        add(&mut state.sums.spool, measured.spool);
        add(&mut state.sums.valve_command, measured.valve_command);
        add(&mut state.sums.command, command);
        let slot = state.tick & (self.window - 1);
        state.tick = state.tick.wrapping_add(1);
        match slot {
            0 => self.close(state, command, measured.force, valid),
            1 => self.asked(state),
            2 => self.spool(state),
            3 => self.predict(state, supply_ratio),
            4 => self.flow(state),
            5 => self.judge(state),
            6 => self.learn(state),
            7 => self.calibrate(state),
            _ => {}
        }
        self.flags(state)
    }

    #[inline(always)]
    fn flags(&self, state: &AdaptationState<S>) -> S::Flags {
        let zero = S::splat(0.0);
        S::flag(state.quarantine.gt(zero), status::ADAPTATION_FROZEN)
            | S::flag(state.bounded.gt(zero), status::ESTIMATE_BOUNDED)
            | S::flag(state.guard.level.lt(S::splat(1.0)), status::LEVEL_REDUCED)
    }

    /// Slot 0: the window's means, and whether every tick of it was good.
    #[inline(never)]
    fn close(&self, state: &mut AdaptationState<S>, command: S, force: S, valid: S::Mask) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let per = self.per_window;
        // The first window is one tick long: its sums say nothing.
        let whole = (state.sums.ticks * per).gt(S::splat(0.999)) & valid;
        let sums = state.sums;
        let mean = |sum: S, last: S| S::select(whole, sum * per, last);
        state.means = Window {
            ticks: S::select(whole, one, zero),
            velocity: mean(sums.velocity, state.means.velocity),
            force: mean(sums.force, state.means.force),
            spool: mean(sums.spool, state.means.spool),
            valve_command: mean(sums.valve_command, state.means.valve_command),
            command: mean(sums.command, state.means.command),
        };
        state.sums = Window::default();
        state.force_change = S::select(whole, force - state.last_force, zero);
        state.command_change = S::select(whole, command - state.last_command, zero);
        state.last_force = S::select(valid, force, state.last_force);
        state.last_command = S::select(valid, command, state.last_command);
        let left = state.quarantine - one;
        state.quarantine = S::select(left.gt(zero), left, zero);
    }

    #[inline(always)]
    fn restart(&self, state: &AdaptationState<S>) -> S::Mask {
        !state.started.gt(S::splat(0.0)) | !state.means.ticks.gt(S::splat(0.0))
    }

    #[inline(always)]
    fn filtered(&self, filter: &mut BandState<S>, input: S, share: S, restart: S::Mask) -> (S, S) {
        let mut next = BandState::select(restart, BandState::at_rest(input), *filter);
        let out = self.filter.step(&mut next, input, share);
        *filter = next;
        out
    }

    /// Slot 1: the opening that was asked of the valve.
    #[inline(never)]
    fn asked(&self, state: &mut AdaptationState<S>) {
        let restart = self.restart(state);
        state.mean_share = self.filter.next_share(state.mean_share, restart);
        let asked = self.valve.asked(&mut state.valve, state.means.valve_command, restart);
        let mut filter = state.asked_filter;
        (state.asked, state.asked_change) = self.filtered(&mut filter, asked, state.mean_share, restart);
        state.asked_filter = filter;
    }

    /// Slot 2: the opening it has, and the guard.
    #[inline(never)]
    fn spool(&self, state: &mut AdaptationState<S>) {
        let restart = self.restart(state);
        let mut filter = state.spool_filter;
        (state.spool, _) = self.filtered(&mut filter, state.means.spool, state.mean_share, restart);
        state.spool_filter = filter;
        let error = state.means.force - state.means.command;
        let undemanded = self.flow_per_force * state.means.force + self.flow_per_change * state.force_change
            - self.guard_demand(state);
        let on = self.guarding & !restart;
        self.guard.step(&mut state.guard, error, undemanded, state.means.velocity, on);
    }

    #[inline(always)]
    fn guard_demand(&self, state: &AdaptationState<S>) -> S {
        self.guard.fed_forward
            * (self.flow_per_force * state.means.command + self.flow_per_change * state.command_change)
    }

    /// Slot 3: the flow that the table predicts for it.
    #[inline(never)]
    fn predict(&self, state: &mut AdaptationState<S>, supply_ratio: S) {
        let restart = self.restart(state);
        let predicted = self.prediction.flow(state.means.spool, state.means.force, supply_ratio);
        let mut filter = state.predicted_filter;
        (state.predicted, _) = self.filtered(&mut filter, predicted, state.mean_share, restart);
        state.predicted_filter = filter;
    }

    /// Slot 4: the flow that the actuator took.
    #[inline(never)]
    fn flow(&self, state: &mut AdaptationState<S>) {
        let restart = self.restart(state);
        let flow = self.piston_area * state.means.velocity
            + self.flow_per_force * state.means.force
            + self.flow_per_change * state.force_change;
        let mut filter = state.flow_filter;
        (state.flow, _) = self.filtered(&mut filter, flow, state.mean_share, restart);
        state.flow_filter = filter;
        // A rig that starts at rest, or primed, needs no settling.
        let first = state.tick < 2 * self.window;
        let resettle = restart & !S::Mask::splat(first);
        state.quarantine = S::select(resettle, self.trust.quarantine, state.quarantine);
        state.started = state.means.ticks;
    }

    /// Slot 5: whether the window's evidence counts, and how much of the older evidence stays.
    #[inline(never)]
    fn judge(&self, state: &mut AdaptationState<S>) {
        let (zero, one, t) = (S::splat(0.0), S::splat(1.0), &self.trust);
        let flow_error = state.flow - state.flow_gain.gain * state.predicted;
        let spool_error = state.spool - state.asked;
        let error = t.per_square_flow * flow_error * flow_error + spool_error * spool_error;
        let signal = t.per_square_flow * (state.flow * state.flow + state.predicted * state.predicted)
            + state.spool * state.spool
            + state.asked * state.asked;
        state.error = state.error + t.average * (error - state.error);
        state.signal = state.signal + t.average * (signal - state.signal);
        let consistent = state.error.le(t.error_share * state.signal);
        let excited = (state.asked * state.asked + t.change_weight * state.asked_change * state.asked_change)
            .gt(t.excitation);
        let linear =
            state.means.spool.abs().lt(t.linear_range) & state.valve.opening().abs().lt(t.linear_range);
        let settled = !state.quarantine.gt(zero) & state.means.ticks.gt(zero);
        let suspicious = state.signal.gt(t.excitation) & !consistent;
        state.quarantine = S::select(suspicious & settled, t.quarantine, state.quarantine);
        let on = excited & consistent & linear & settled & self.adapting;
        state.weight = S::select(on, t.period, zero);
        let evidence = state.asked * state.asked * t.period;
        let above = state.evidence - t.kept;
        let share = S::select(above.gt(zero), t.forgotten * above / (state.evidence + t.half), zero);
        state.keep = S::select(on, one - share, one);
        state.evidence = S::select(on, state.keep * state.evidence + evidence, state.evidence);
    }

    /// Slot 6: both estimators take the window in.
    #[inline(never)]
    fn learn(&self, state: &mut AdaptationState<S>) {
        let on = state.weight.gt(S::splat(0.0));
        let bounded = self.flow_gain.step(
            &mut state.flow_gain,
            state.flow,
            state.predicted,
            state.weight * state.asked,
            state.keep,
            on,
        );
        state.bounded = S::select(on, S::select(bounded, S::splat(1.0), S::splat(0.0)), state.bounded);
        self.valve.take(
            &mut state.valve,
            state.asked,
            state.asked_change,
            state.spool,
            state.weight,
            state.keep,
        );
    }

    /// Slot 7: the lead network of the estimated valve.
    #[inline(never)]
    fn calibrate(&self, state: &mut AdaptationState<S>) {
        let on = state.weight.gt(S::splat(0.0));
        let bounded = self.valve.solve(&mut state.valve, on);
        state.bounded = S::select(bounded, S::splat(1.0), state.bounded);
        // Without estimates the configured network stays as it is, only its level moves.
        let lead = self.valve.lead(&state.valve, state.guard.level);
        state.lead = LeadNetwork::of(
            S::select(self.adapting, lead.pole(), state.lead.pole()),
            S::select(self.adapting, lead.rate(), state.lead.rate()),
            lead.gain(),
        );
    }
}

impl<S: Scalar, const N: usize> Adaptation<S, N> {
    /// Those of single rigs side by side, all sampled at one rate.
    pub(crate) fn pack<'a>(lane: impl Fn(usize) -> &'a Adaptation<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            window: lane(0).window,
            per_window: S::from_lanes(|i| lane(i).per_window),
            adapting: S::Mask::from_lanes(|i| lane(i).adapting),
            guarding: S::Mask::from_lanes(|i| lane(i).guarding),
            piston_area: S::from_lanes(|i| lane(i).piston_area),
            flow_per_force: S::from_lanes(|i| lane(i).flow_per_force),
            flow_per_change: S::from_lanes(|i| lane(i).flow_per_change),
            prediction: FlowPrediction::pack(|i| &lane(i).prediction),
            filter: BandFilter::pack(|i| &lane(i).filter),
            flow_gain: FlowGainEstimator::pack(|i| &lane(i).flow_gain),
            valve: ValveEstimator::pack(|i| &lane(i).valve),
            guard: Guard::pack(|i| &lane(i).guard),
            trust: Trust::pack(|i| &lane(i).trust),
        }
    }
}
