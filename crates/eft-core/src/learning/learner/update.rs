//! One update of a learner, in its steps.

use super::state::Means;
use super::{Learner, LearnerState};
use crate::compensation::Calibration;
use crate::learning::deviation::Deviation;
use crate::learning::gate::{Signals, Verdict};
use crate::learning::least_squares::Weight;
use crate::learning::window::{Sums, Window};
use crate::number::Real;

/// Number of windows at the start in which lost samples need no settling, because a rig starts at rest or primed.
const START: u32 = 3;

/// A window's measurements beside the models of valve and flow.
struct Comparison<T> {
    signals: Signals<T>,
    /// The actuator's and the table's flow (m³/s), both at no load and at one instant.
    flows: [T; 2],
    /// Commanded minus measured opening (1), both from the valve's null.
    ahead: T,
    /// Slope of the table (m³/s per unit opening) at the measured opening.
    slope: T,
}

impl<T: Real, const N: usize> Learner<T, N> {
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
        let restart = self.measure(state, window);
        let found = self.compare(state, window.supply, restart);
        if self.guards && !restart {
            self.act_on_force_error(state);
        }
        let weight = self.judge(state, window, &found.signals, restart);
        if self.adapts {
            self.estimate(state, &found, weight);
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

    /// Takes the means of a whole window. Returns whether the filters start anew, because this window or the last one is
    /// missing or not whole.
    fn measure(&self, state: &mut LearnerState<T>, window: &Window<T>) -> bool {
        let found = self.means(window, state.valve.found.gain.value);
        let whole = window.lost == 0 && self.is_possible(&found);
        if whole {
            state.means = found;
        }
        let restart = !(whole && state.filtered && window.number == state.number);
        state.number = window.number.wrapping_add(1);
        state.filtered = whole;
        state.mean_share = self.filter.next_share(state.mean_share, restart);
        restart
    }

    /// The means of a whole window, with the spool's opening from the known null. A lost valve command (V) is
    /// replaced by that for the measured opening. With any other value the filters' means would contradict each other
    /// for seconds.
    pub(super) fn means(&self, window: &Window<T>, valve_gain: T) -> Means<T> {
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

    /// Compares spool and flow with their models, in the estimators' band.
    fn compare(&self, state: &mut LearnerState<T>, supply: T, restart: bool) -> Comparison<T> {
        let (means, share, filter, filters) = (state.means, state.share, &self.filter, &mut state.filters);

        // The commanded and the measured opening.
        let asked = self.valve.valve_gain * means.valve_command - self.curve.known_null;
        self.valve.invert_lead(&mut state.valve, asked, restart);
        let (commanded, commanded_change) =
            filter.step(&mut filters.asked, state.valve.opening(), share, restart);
        let (spool, _) = filter.step(&mut filters.spool, means.spool, share, restart);

        // Both from the valve's null. The commanded one has no sensor offset.
        let valve_gain = state.valve.found.gain.value;
        let (mut measured_opening, mut commanded_opening) = (means.spool, state.valve.opening());
        if self.corrects {
            let null = state.evidence.curve.null;
            let sensor = state.evidence.curve.sensor;
            (measured_opening, commanded_opening) =
                (measured_opening - sensor - valve_gain * null, commanded_opening - null);
        }

        // The actuator's flow, and the flow that the table predicts.
        let measured_flow = self.piston_area * means.velocity + means.compressed;
        let model = self.model.flow(measured_opening, commanded_opening, means.force, supply);
        let (mut predicted, mut straightened) = (model.at_no_load * model.root, measured_flow);
        let mut flows = [T::splat(0.0); 2];
        let flow_gain = state.flow.gain.value;
        if self.corrects {
            // The constant part of the flow stays, so that a new null offset does not change the flow.
            predicted = predicted + self.flow_gain * (means.spool - measured_opening);
            let at_no_load = measured_flow / model.root;
            let flow = self.curve.straightened(&state.evidence.curve, at_no_load / flow_gain);
            straightened = flow_gain * model.root * flow;
            let now = [at_no_load, model.at_no_load];
            let lagged = if restart { now } else { state.flows };
            let square = self.valve.mean_square_frequency(&state.evidence.valve);
            (state.flows, flows) = self.flow.synchronize(&state.flow, lagged, now, square);
        }
        let predicted = filter.step(&mut filters.predicted, predicted, share, restart);
        let flow = filter.step(&mut filters.flow, straightened, share, restart);
        let flow = self.flow.sample(&state.flow, flow.into(), predicted.into());
        Comparison {
            signals: Signals { flow, spool, commanded, commanded_change },
            flows,
            ahead: valve_gain * commanded_opening - measured_opening,
            // The null offset is one of the command, so the slope is per commanded opening.
            slope: valve_gain * model.slope,
        }
    }

    /// The guard uses the part of the flow that was not demanded.
    fn act_on_force_error(&self, state: &mut LearnerState<T>) {
        let means = &state.means;
        let error = means.force - means.command;
        let fed = self.flow_per_force * means.command + self.flow_per_change * means.command_change;
        let undemanded = means.compressed - self.guard.fed_forward * fed;
        self.guard.observe(&mut state.guard, error, undemanded, means.velocity);
        self.guard.act(&mut state.guard);
    }

    /// Decides whether the models explain the window, and how much it counts.
    fn judge(
        &self,
        state: &mut LearnerState<T>,
        window: &Window<T>,
        signals: &Signals<T>,
        restart: bool,
    ) -> Weight<T> {
        self.save_checkpoint(state);
        let settling = restart && state.since_start >= START || window.lost_commands > 0 && self.adapts;
        self.gate.wait(&mut state.gate, if settling { self.gate.settling } else { 0 });
        if state.since_start < START {
            state.since_start += 1;
        }
        let usable = state.filtered && self.adapts;
        let verdict = self.gate.judge(&mut state.gate, signals, usable);
        if let Verdict::Rejected { learned } = verdict {
            state.checkpoints.restore(&mut state.evidence);
            state.curve.nodes.reset_variances();
            // If nothing was learned since the last rejection, the means may be wrong.
            state.means_go_on = !learned;
        }
        // Distrusted measurements do not enter the means either.
        let stopped = state.gate.is_held_off() && !state.means_go_on;
        state.share = if stopped { T::splat(0.0) } else { state.mean_share };
        self.guard.follow_offset(&mut state.guard, state.share);
        if verdict != Verdict::Accepted {
            return Weight { time: T::splat(0.0), forgetting: T::splat(0.0) };
        }
        let openings = [state.means.spool, state.valve.opening()];
        self.gate.weight(&mut state.gate, &mut state.evidence.amount, openings, signals)
    }

    /// Makes a checkpoint if one is due.
    pub(super) fn save_checkpoint(&self, state: &mut LearnerState<T>) {
        state.since_checkpoint += 1;
        if state.since_checkpoint >= self.checkpoint_windows {
            state.since_checkpoint = 0;
            state.checkpoints.save(&state.evidence);
        }
    }

    /// Adds the window to the evidence if it has a weight, and solves for flow gain, valve gain and both delays.
    fn estimate(&self, state: &mut LearnerState<T>, found: &Comparison<T>, weight: Weight<T>) {
        let evidence = &mut state.evidence;
        if weight.time > T::splat(0.0) {
            let Signals { flow, spool, commanded, commanded_change } = found.signals;
            let instruments = [commanded, -commanded_change];
            let residual = [flow.residual, self.valve.residual(&state.valve, instruments, spool)];
            self.flow.add(&mut evidence.flow, &flow, instruments, weight);
            self.valve.add(&state.valve, &mut evidence.valve, instruments, spool, weight);
            self.deviation.add(evidence, [commanded, state.means.compressed], residual, weight);
            if self.corrects {
                let flow_gain = state.flow.gain.value;
                let [measured, passed] = found.flows;
                let openings = [found.ahead, evidence.curve.sensor - found.ahead];
                let curve = &mut evidence.curve;
                let sample = self.curve.sample(curve, measured / flow_gain, [passed, found.slope], openings);
                self.curve.learn(&mut state.curve, curve, &sample, flow_gain, weight.forgetting);
            }
        }
        self.flow.priors.solve(&mut state.flow, &evidence.flow);
        self.valve.priors.solve(&mut state.valve.found, &evidence.valve);
    }
}
