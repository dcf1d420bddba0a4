//! The learner: one function from a window to a calibration.

mod state;
#[cfg(test)]
mod tests;
mod update;

use crate::checksum::word;
use crate::compensation::{Calibration, Deviations, LeadNetwork};
use crate::integrity::integrity;
use crate::learning::band_filter::BandFilter;
use crate::learning::checkpoint::{Checkpoints, Evidence};
use crate::learning::curve_nodes::inverse_at;
use crate::learning::deviation::{Deviation, gain_change};
use crate::learning::flow::FlowEstimator;
use crate::learning::flow_curve::{CurveState, FlowCurve};
use crate::learning::flow_model::FlowModel;
use crate::learning::gate::{Gate, GateState};
use crate::learning::guard::{Guard, GuardState};
use crate::learning::valve::ValveEstimator;
use crate::number::Real;
use crate::status;

pub(super) use state::Largest;
pub use state::LearnerState;
use state::{Filters, Means};

/// A learner's immutable configuration; one serves any number of channels of the same parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Learner<T: Real, const N: usize> {
    /// Whether flow and valve are estimated; otherwise the configured values stay.
    pub(super) adapts: bool,
    /// Whether the table is corrected by direction and band of flow as well.
    pub(super) corrects: bool,
    pub(super) guards: bool,
    /// 1 over the ticks of a window.
    pub(super) per_window: T,
    /// Windows from one checkpoint to the next.
    pub(super) checkpoint_windows: u32,
    pub(super) largest: Largest<T>,
    pub(super) piston_area: T,
    /// Configured flow gain (m³/s).
    pub(super) flow_gain: T,
    /// Flow (m³/s) per force (N).
    pub(super) flow_per_force: T,
    /// Flow (m³/s) per change of force (N) over a window.
    pub(super) flow_per_change: T,
    pub(super) model: FlowModel<T, N>,
    pub(super) filter: BandFilter<T>,
    pub(super) gate: Gate<T>,
    pub(super) flow: FlowEstimator<T>,
    pub(super) valve: ValveEstimator<T>,
    pub(super) curve: FlowCurve<T>,
    pub(super) deviation: Deviation<T>,
    pub(super) guard: Guard<T>,
    /// The configured lead network, and the response delay (s) for which it compensates.
    pub(super) lead: LeadNetwork<T>,
    pub(super) response_delay: T,
    /// Compensation signal (V) per null offset (1). It is 0 with an integral part, which supplies the offset itself: near
    /// null, overlap and friction look like an offset, and to add them moves the piston further.
    pub(super) null_gain: T,
    /// Compensation signal (V) for the known null bias.
    pub(super) known_signal: T,
}
integrity!(Learner<T, N>: adapts, corrects, guards, per_window, checkpoint_windows, largest, piston_area, flow_gain, flow_per_force, flow_per_change, model, filter, gate, flow, valve, curve, deviation, guard, lead, response_delay, null_gain, known_signal);

impl<T: Real, const N: usize> Learner<T, N> {
    /// An integrity word over every number of the configuration, as [`Channel::integrity`](crate::Channel::integrity).
    ///
    /// # Cost
    /// As there.
    pub fn integrity(&self) -> u32 {
        word(self)
    }

    /// Nothing learned yet.
    pub fn at_rest(&self) -> LearnerState<T> {
        let one = T::splat(1.0);
        LearnerState {
            number: 0,
            since_checkpoint: 0,
            since_start: 0,
            filtered: false,
            means_go_on: false,
            means: Means::default(),
            mean_share: one,
            share: one,
            filters: Filters::default(),
            flows: [T::splat(0.0); 2],
            gate: GateState::default(),
            flow: self.flow.priors.at_rest(),
            valve: self.valve.at_rest(),
            guard: GuardState::default(),
            evidence: Evidence::default(),
            checkpoints: Checkpoints::default(),
            curve: CurveState::default(),
            deviations: Deviations::unknown(),
        }
    }

    /// The calibration of the present estimates, for [`Channel::at_rest_with`](crate::Channel::at_rest_with) after
    /// [`start_from`](Self::start_from). Without evidence it has the configured lead network: that of a learner at
    /// rest is the [nominal](Calibration::nominal) one, bit for bit. The known delay of the velocity then counts
    /// from the first [`update`](Self::update) on.
    pub fn first_calibration(&self, state: &LearnerState<T>) -> Calibration<T> {
        let zero = T::splat(0.0);
        let square = self.valve.mean_square_frequency(&state.evidence.valve);
        let found = self.calibration(state, u32::MAX, square);
        if state.evidence.amount > zero {
            return found;
        }
        let lead = self.configured_lead(found.lead.gain());
        Calibration { lead, response_delay: self.response_delay, velocity_delay: zero, ..found }
    }

    /// The configured lead network with this DC gain (V per unit opening).
    fn configured_lead(&self, gain: T) -> LeadNetwork<T> {
        LeadNetwork::of(self.lead.pole(), self.lead.rate(), gain)
    }

    /// No-load flow (m³/s) that a calibration's valve passes at a spool opening (1): the table's, corrected and times `θ`.
    ///
    /// # NaN
    /// NaN for an opening that is NaN; beyond the table's ends the flow is that of the end.
    ///
    /// # Cost
    /// Call it after a test, not in a tick, because it searches the correction.
    pub fn found_flow(&self, calibration: &Calibration<T>, opening: T) -> T {
        if !(opening.abs() >= T::splat(0.0)) {
            return opening;
        }
        inverse_at(&calibration.curve, self.curve.grid.step, self.model.at_no_load(opening))
            * calibration.flow_gain
    }

    /// Standard deviations at the motion's mean-square frequency (1/s²), with the valve's
    /// [increase](ValveEstimator::gain_increase) of gain up to it (1).
    pub(super) fn deviations(&self, state: &LearnerState<T>, square: T, gain_increase: T) -> Deviations<T> {
        let (flow, valve) = ((&self.flow.priors, &state.flow), (&self.valve.priors, &state.valve.found));
        let share = FlowCurve::share(&state.evidence.curve);
        let mut deviations = self.deviation.deviations(&state.evidence, square, flow, valve, share);
        if self.corrects && deviations.valve_gain < T::splat(f64::INFINITY) {
            let null = self.curve.null_errors(&state.curve, &state.evidence.curve, self.flow_gain);
            let change = gain_change(deviations.valve_gain, gain_increase, &state.valve.found);
            deviations.null_offset = Deviation::null_offset(&state.evidence, null, change);
        }
        deviations
    }

    /// The calibration of a window, at the motion's mean-square frequency (1/s²).
    pub(super) fn calibration(&self, state: &LearnerState<T>, window: u32, square: T) -> Calibration<T> {
        let (zero, one) = (T::splat(0.0), T::splat(1.0));
        let (flow, valve) = (&state.flow, &state.valve.found);
        let (level, null) = (state.guard.level, state.evidence.curve.null);
        let lead = self.valve.lead(valve, square, flow.delay.value, level);
        // Without estimates the configured network stays as it is, and only its level changes.
        let lead = if self.adapts { lead } else { self.configured_lead(lead.gain()) };
        let estimates = [&flow.gain, &flow.delay, &valve.gain, &valve.delay];
        let bounded = estimates.iter().any(|estimate| estimate.beyond > zero) || state.curve.beyond > zero;
        let flag = |raised: bool, bit: u32| if raised { bit } else { 0 };
        Calibration {
            window,
            status: flag(self.adapts && state.gate.is_held_off(), status::ADAPTATION_FROZEN)
                | flag(bounded, status::ESTIMATE_BOUNDED)
                | flag(level < one, status::LEVEL_REDUCED),
            flow_gain: flow.gain.value,
            per_flow_gain: one / flow.gain.value,
            lead,
            response_delay: valve.delay.value,
            velocity_delay: if self.adapts { flow.delay.value } else { zero },
            valve_gain: valve.gain.value,
            level,
            deviations: state.deviations,
            test_ratio: state.gate.test_ratio(&self.gate),
            curve: state.curve.nodes.pieces,
            null_offset: null + self.curve.known_null,
            null_signal: null * self.null_gain + self.known_signal,
        }
    }
}
