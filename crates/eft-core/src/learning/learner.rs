//! The learner: one function from a window to a calibration.

mod state;
#[cfg(test)]
mod tests;

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
use crate::learning::gate::{Gate, GateState, Signals, Verdict};
use crate::learning::guard::{Guard, GuardState};
use crate::learning::least_squares::Weight;
use crate::learning::valve::ValveEstimator;
use crate::learning::window::{Sums, Window};
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

/// Number of windows at the start in which lost samples need no settling, because a rig starts at rest or primed.
const START: u32 = 3;

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

    /// Makes the calibration to [publish](crate::Channel::publish) from a window.
    ///
    /// # NaN
    /// A missing window counts as one with lost samples. So does one whose means are NaN or far beyond what a rig can
    /// reach.
    ///
    /// # Cost
    /// It alternates from window to window, and is larger for those of a checkpoint.
    #[inline(never)]
    pub fn update(&self, state: &mut LearnerState<T>, window: &Window<T>) -> Calibration<T> {
        let zero = T::splat(0.0);

        // The measurements.
        let found = self.means(window, state.valve.found.gain.value);
        let whole = window.lost == 0 && self.is_possible(&found);
        if whole {
            state.means = found;
        }
        let means = state.means;
        let restart = !(whole && state.filtered && window.number == state.number);
        state.number = window.number.wrapping_add(1);
        state.filtered = whole;
        state.mean_share = self.filter.next_share(state.mean_share, restart);

        // The commanded and the measured opening in the estimators' band.
        let commanded = self.valve.valve_gain * means.valve_command - self.curve.known_null;
        self.valve.invert_lead(&mut state.valve, commanded, restart);
        let (filter, filters, share) = (&self.filter, &mut state.filters, state.share);
        let (opening, change) = filter.step(&mut filters.asked, state.valve.opening(), share, restart);
        let commanded = [opening, -change];
        let (spool, _) = filter.step(&mut filters.spool, means.spool, share, restart);

        // The actuator's flow, and the flow that the table predicts.
        let measured_flow = self.piston_area * means.velocity + means.compressed;
        // Both openings are relative to the valve's null. The commanded one has no sensor offset.
        let valve_gain = state.valve.found.gain.value;
        let (mut measured_opening, mut commanded_opening) = (means.spool, state.valve.opening());
        if self.corrects {
            let null = state.evidence.curve.null;
            let sensor = state.evidence.curve.sensor;
            (measured_opening, commanded_opening) =
                (measured_opening - sensor - valve_gain * null, commanded_opening - null);
        }
        let model = self.model.flow(measured_opening, commanded_opening, means.force, window.supply);
        let mut predicted = model.at_no_load * model.root;
        let flow_gain = state.flow.gain.value;
        let mut straightened = measured_flow;
        let mut flows = [zero; 2];
        if self.corrects {
            // The constant part of the flow stays, so that a new null offset does not change the flow.
            predicted = predicted + self.flow_gain * (means.spool - measured_opening);
            let now = [measured_flow / model.root, model.at_no_load];
            let [at_no_load, _] = now;
            let flow = self.curve.straightened(&state.evidence.curve, at_no_load / flow_gain);
            straightened = flow_gain * model.root * flow;
            let lagged = if restart { now } else { state.flows };
            let square = self.valve.mean_square_frequency(&state.evidence.valve);
            (state.flows, flows) = self.flow.synchronize(&state.flow, lagged, now, square);
        }
        let predicted = filter.step(&mut filters.predicted, predicted, share, restart);
        let flow = filter.step(&mut filters.flow, straightened, share, restart);
        let flow = self.flow.sample(&state.flow, flow.into(), predicted.into());

        // The guard uses the part of the flow that was not demanded.
        if self.guards && !restart {
            let error = means.force - means.command;
            let fed = self.flow_per_force * means.command + self.flow_per_change * means.command_change;
            self.guard.observe(
                &mut state.guard,
                error,
                means.compressed - self.guard.fed_forward * fed,
                means.velocity,
            );
            self.guard.act(&mut state.guard);
        }

        // Whether the models explain the window.
        self.save_checkpoint(state);
        let settling = restart && state.since_start >= START || window.lost_commands > 0 && self.adapts;
        self.gate.wait(&mut state.gate, if settling { self.gate.settling } else { 0 });
        if state.since_start < START {
            state.since_start += 1;
        }
        let signals = Signals { flow, spool, commanded: opening, commanded_change: change };
        let usable = whole && self.adapts;
        let verdict = self.gate.judge(&mut state.gate, &signals, usable);
        if let Verdict::Rejected { learned } = verdict {
            state.checkpoints.restore(&mut state.evidence);
            state.curve.nodes.reset_variances();
            // If nothing was learned since the last rejection, the means may be wrong.
            state.means_go_on = !learned;
        }
        // Distrusted measurements do not enter the means either.
        let stopped = state.gate.is_held_off() && !state.means_go_on;
        state.share = if stopped { zero } else { state.mean_share };
        self.guard.follow_offset(&mut state.guard, state.share);

        // The estimates from this window.
        let mut weight = Weight { time: zero, forgetting: zero };
        if verdict == Verdict::Accepted {
            let openings = [state.means.spool, state.valve.opening()];
            weight = self.gate.weight(&mut state.gate, &mut state.evidence.amount, openings, &signals);
        }
        if self.adapts {
            if weight.time > zero {
                let evidence = &mut state.evidence;
                self.flow.add(&mut evidence.flow, &flow, commanded, weight);
                self.valve.add(&state.valve, &mut evidence.valve, commanded, spool, weight);
                let residual = [flow.residual, self.valve.residual(&state.valve, commanded, spool)];
                self.deviation.add(evidence, [opening, state.means.compressed], residual, weight);
                if self.corrects {
                    let [measured_flow, passed] = flows;
                    // The null offset is one of the command, so the slope is per commanded opening.
                    let (ahead, passed) = (
                        valve_gain * commanded_opening - measured_opening,
                        [passed, valve_gain * model.slope],
                    );
                    let ahead = [ahead, evidence.curve.sensor - ahead];
                    let sample = self.curve.sample(&evidence.curve, measured_flow / flow_gain, passed, ahead);
                    self.curve.learn(
                        &mut state.curve,
                        &mut evidence.curve,
                        &sample,
                        flow_gain,
                        weight.forgetting,
                    );
                }
            }
            self.flow.priors.solve(&mut state.flow, &state.evidence.flow);
            self.valve.priors.solve(&mut state.valve.found, &state.evidence.valve);
        }
        let square = self.valve.mean_square_frequency(&state.evidence.valve);
        // Curve and standard deviations change slowly, so each is updated in every other window.
        if window.number.is_multiple_of(2) {
            let gain_increase = self.valve.gain_increase(&state.valve.found, square);
            state.deviations = self.deviations(state, square, gain_increase);
            state.curve.disturbance = Deviation::disturbance(&state.evidence, gain_increase);
        } else if self.corrects {
            self.curve.update(&mut state.curve, &mut state.evidence.curve);
        }
        if self.corrects {
            self.curve.refresh(&mut state.curve, &state.evidence.curve);
        }
        self.calibration(state, window.number, square)
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

    /// The means of a whole window, with the spool's opening from the known null. A lost valve command (V) is
    /// replaced by that for the measured opening. With any other value the filters' means would contradict each other
    /// for seconds.
    fn means(&self, window: &Window<T>, valve_gain: T) -> Means<T> {
        let Sums { velocity, force, spool, valve_command, command, spool_without_command } = window.sums;
        let stand_in = spool_without_command / (self.valve.valve_gain * valve_gain);
        let per_window = self.per_window;
        let force = force * per_window;
        let force_change = window.end.force - window.start.force;
        Means {
            velocity: velocity * per_window,
            force,
            spool: spool * per_window - self.curve.known_null,
            valve_command: (valve_command + stand_in) * per_window,
            command: command * per_window,
            command_change: window.end.command - window.start.command,
            compressed: self.flow_per_force * force + self.flow_per_change * force_change,
        }
    }

    /// Whether a rig can reach these means. A wrong sample of 1e12 would be in the filters for seconds.
    fn is_possible(&self, means: &Means<T>) -> bool {
        let Means { velocity, force, spool, valve_command, command, command_change, compressed } = *means;
        let largest = &self.largest;
        (self.piston_area * velocity).abs() + compressed.abs() <= largest.flow
            && force.abs() + command.abs() + command_change.abs() <= largest.force
            && spool.abs() + (self.valve.valve_gain * valve_command).abs() <= largest.opening
    }

    /// Makes a checkpoint if one is due.
    fn save_checkpoint(&self, state: &mut LearnerState<T>) {
        state.since_checkpoint += 1;
        if state.since_checkpoint >= self.checkpoint_windows {
            state.since_checkpoint = 0;
            state.checkpoints.save(&state.evidence);
        }
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
