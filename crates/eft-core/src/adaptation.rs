//! The slow side of the adaptive controller: from means over a window of ticks to the next window's calibration.
//!
//! Each tick adds its measurements to the window's sums and does one slot of the work on the window before, so the
//! cost of a tick is bounded and even, whatever the estimators cost together.

use crate::band_filter::{BandFilter, BandState};
use crate::evidence::{Evidence, Proof};
use crate::flow_correction::{FlowCorrection, FlowCorrectionState};
use crate::flow_gain::{FlowGainEstimator, FlowGainState};
use crate::flow_prediction::FlowPrediction;
use crate::guard::{Guard, GuardState};
use crate::lead::LeadNetwork;
use crate::scalar::{Mask, Scalar};
use crate::status;
use crate::trust::{Trust, TrustState};
use crate::valve_estimator::{ValveEstimator, ValveState};
use crate::window::WindowState;

/// Slots of a window's work.
pub(crate) const SLOTS: u32 = 16;
/// Marks a tick that does two of them; above the ticks of any window.
pub(crate) const CROWDED: u32 = 1 << 16;

/// The schedule: the slots by their number, and by the tick that does two of them at a low sample rate.
macro_rules! slots {
    ($($tick:literal: $first:literal $one:ident, $second:literal $other:ident;)+) => {
        /// Does a slot's work, and gives whether there is one of this number: the rest of a long window has none.
        #[inline(always)]
        fn slot(&self, state: &mut AdaptationState<S>, slot: u32) -> bool {
            match slot {
                $($first => self.$one(state), $second => self.$other(state),)+
                _ => return false,
            }
            true
        }

        /// Does the work of two slots.
        // One call behind the other, not one function of all: their stack is then not added up.
        #[inline(never)]
        fn pair(&self, state: &mut AdaptationState<S>, tick: u32) {
            match tick {
                $($tick => {
                    self.$one(state);
                    self.$other(state);
                })+
                _ => {}
            }
        }
    };
}

/// Estimators, guard and the schedule between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Adaptation<S: Scalar, const N: usize> {
    /// Ticks of a window, a power of two, less one.
    pub(crate) last_tick: u32,
    /// [`CROWDED`] where a window has half as many ticks as there are slots, otherwise 0.
    pub(crate) crowded: u32,
    pub(crate) per_window: S,
    /// Ticks from one time that evidence is put by to the next, a power of two, less one.
    pub(crate) last_of_proof: u32,
    /// Whether the calibration may move; otherwise it stays the configured one.
    pub(crate) adapting: S::Mask,
    pub(crate) guarding: S::Mask,
    /// Whether the table is corrected by direction and band of opening as well.
    pub(crate) correcting: S::Mask,
    pub(crate) piston_area: S,
    pub(crate) flow_per_force: S,
    /// Flow (m³/s) per change of force (N) over a window.
    pub(crate) flow_per_change: S,
    pub(crate) prediction: FlowPrediction<S, N>,
    pub(crate) filter: BandFilter<S>,
    pub(crate) flow_gain: FlowGainEstimator<S>,
    pub(crate) curve: FlowCorrection<S>,
    pub(crate) valve: ValveEstimator<S>,
    pub(crate) guard: Guard<S>,
    pub(crate) trust: Trust<S>,
    /// The lead network by the configuration.
    pub(crate) lead: LeadNetwork<S>,
}

/// Everything the slow side remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct AdaptationState<S: Scalar> {
    tick: u32,
    pub(crate) flags: S::Flags,
    pub(crate) window: WindowState<S>,
    /// 1 where the filters have taken in the window before; 1 where they start anew with this one.
    started: S,
    restart: S,
    /// Share of the way that the filters' means go in this window.
    mean_share: S,
    share: S,
    /// 1 where the means go on although nothing is believed.
    released: S,
    asked: S,
    asked_change: S,
    spool: S,
    predicted: S,
    flow: S,
    asked_filter: BandState<S>,
    spool_filter: BandState<S>,
    predicted_filter: BandState<S>,
    flow_filter: BandState<S>,
    trust: TrustState<S>,
    pub(crate) flow_gain: FlowGainState<S>,
    pub(crate) valve: ValveState<S>,
    pub(crate) guard: GuardState<S>,
    evidence: Evidence<S>,
    proof: Proof<Evidence<S>>,
    pub(crate) lead: LeadNetwork<S>,
    // Last: what is off lies out of the way.
    pub(crate) curve: FlowCorrectionState<S>,
}

impl<S: Scalar> AdaptationState<S> {
    pub(crate) fn new(delay: S, lead: LeadNetwork<S>) -> Self {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        Self {
            tick: 0,
            flags: S::Flags::default(),
            window: WindowState::default(),
            started: zero,
            restart: one,
            mean_share: one,
            share: one,
            released: zero,
            asked: zero,
            asked_change: zero,
            spool: zero,
            predicted: zero,
            flow: zero,
            asked_filter: BandState::default(),
            spool_filter: BandState::default(),
            predicted_filter: BandState::default(),
            flow_filter: BandState::default(),
            trust: TrustState::default(),
            flow_gain: FlowGainState::default(),
            valve: ValveState::new(delay),
            guard: GuardState::default(),
            evidence: Evidence::default(),
            proof: Proof::default(),
            lead,
            curve: FlowCorrectionState::at_rest(),
        }
    }

    #[inline(always)]
    fn restart(&self) -> S::Mask {
        self.restart.gt(S::splat(0.0))
    }

    #[inline(always)]
    fn learning(&self) -> S::Mask {
        self.trust.weight.gt(S::splat(0.0))
    }
}

impl<S: Scalar, const N: usize> Adaptation<S, N> {
    /// A demanded no-load flow (m³/s) as the table, which is not corrected in place, has it.
    #[inline(always)]
    pub(crate) fn corrected(&self, state: &AdaptationState<S>, demand: S) -> S {
        if !self.correcting.any() {
            return demand;
        }
        S::select(self.correcting, self.curve.apply(&state.curve, demand), demand)
    }

    /// No-load flow (m³/s) that the valve was found to pass at a spool opening (1); NaN at NaN.
    pub(crate) fn found_flow(&self, state: &AdaptationState<S>, opening: S) -> S {
        let flow = self.curve.undo(&state.curve, self.prediction.curve.eval(opening)) * state.flow_gain.gain;
        S::select(opening.abs().ge(S::splat(0.0)), flow, opening)
    }

    /// Where a tick was collected without its valve command: adds the one that would have asked for the measured spool
    /// opening (1), since with any other the filters' means would contradict each other for seconds. Nothing is learned
    /// until the low-passes have forgotten it.
    #[inline(never)]
    pub(crate) fn stand_in(&self, state: &mut AdaptationState<S>, spool: S, missing: S::Mask) {
        self.trust.doubt(&mut state.trust, missing & self.adapting);
        let valve_command = spool / (self.valve.valve_gain * state.valve.gain);
        state.window.add_valve_command(valve_command, missing);
    }

    /// One tick's part of the work.
    // First in a tick: across the slot's call nothing has to be kept then.
    #[inline(always)]
    pub(crate) fn work(&self, state: &mut AdaptationState<S>) {
        let slot = state.tick & self.last_tick | self.crowded;
        state.tick = state.tick.wrapping_add(1);
        if !self.slot(state, slot) && slot >= CROWDED {
            self.pair(state, slot - CROWDED);
        }
    }

    slots! {
        0: 0 close, 1 asked;
        1: 2 openings, 3 flow;
        2: 4 predict, 5 predicted;
        3: 6 level, 7 filter_flow;
        4: 8 compare, 9 judge;
        5: 10 weigh, 11 flow_gain;
        6: 12 valve, 13 solve;
        7: 14 correct, 15 calibrate;
    }

    #[inline(never)]
    fn close(&self, state: &mut AdaptationState<S>) {
        state.window.close(self.per_window);
        if self.correcting.any() {
            self.keep_curve(state);
        }
    }

    /// What was learned of the curve is put by, or taken back.
    // Apart: only who corrects the curve pays for its registers.
    #[inline(never)]
    fn keep_curve(&self, state: &mut AdaptationState<S>) {
        let doubtful = state.trust.quarantine.gt(self.trust.just_now);
        self.curve.keep(&mut state.curve, doubtful);
    }

    /// The opening that was asked of the valve.
    #[inline(never)]
    fn asked(&self, state: &mut AdaptationState<S>) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let restart = !state.started.gt(zero) | !state.window.whole.gt(zero);
        state.restart = S::select(restart, one, zero);
        state.mean_share = self.filter.next_share(state.mean_share, restart);
        self.valve.asked(&mut state.valve, state.window.means.valve_command, restart);
    }

    /// The opening that was asked, and the one there is, in the estimators' band.
    // In line like `flow_gain`: what costs most is spared the call.
    #[inline(always)]
    fn openings(&self, state: &mut AdaptationState<S>) {
        let (restart, share) = (state.restart(), state.share);
        (state.asked, state.asked_change) =
            self.filter.step(&mut state.asked_filter, state.valve.opening(), share, restart);
        (state.spool, _) =
            self.filter.step(&mut state.spool_filter, state.window.means.spool, share, restart);
    }

    /// The flow that the actuator took, and the part of it that nobody demanded, for the guard.
    #[inline(never)]
    fn flow(&self, state: &mut AdaptationState<S>) {
        let w = &state.window;
        let (force, command) = (w.means.force, w.means.command);
        if self.correcting.any() {
            self.curve.follow(&mut state.curve);
        }
        let compressed = self.flow_per_force * force + self.flow_per_change * w.force_change;
        let fed = self.flow_per_force * command + self.flow_per_change * w.command_change;
        state.flow = self.piston_area * w.means.velocity + compressed;
        let undemanded = compressed - self.guard.fed_forward * fed;
        let on = self.guarding & !state.restart();
        self.guard.observe(&mut state.guard, force - command, undemanded, w.means.velocity, on);
    }

    /// What the guard does about what it sees.
    #[inline(never)]
    fn level(&self, state: &mut AdaptationState<S>) {
        let on = self.guarding & !state.restart();
        self.guard.act(&mut state.guard, on);
        if self.correcting.any() {
            self.curve.bend(&mut state.curve, 1);
        }
    }

    /// The flow that the table predicts.
    #[inline(never)]
    fn predict(&self, state: &mut AdaptationState<S>) {
        let w = &state.window;
        let (passed, slope, root) = self.prediction.parts(w.means.spool, w.means.force, w.supply);
        state.predicted = passed * root;
        if self.correcting.any() {
            self.curve.note(&mut state.curve, passed, slope, root);
        }
    }

    /// The same in the estimators' band; and what the guard sees pumped into the structure.
    #[inline(never)]
    fn predicted(&self, state: &mut AdaptationState<S>) {
        let restart = state.restart();
        (state.predicted, _) =
            self.filter.step(&mut state.predicted_filter, state.predicted, state.share, restart);
        self.guard.average(&mut state.guard, self.guarding & !restart);
    }

    #[inline(never)]
    fn filter_flow(&self, state: &mut AdaptationState<S>) {
        let restart = state.restart();
        if self.correcting.any() {
            let (gain, per_gain) = (state.flow_gain.gain, state.flow_gain.per_gain);
            let flow = self.curve.straighten(&mut state.curve, state.flow, gain, per_gain);
            state.flow = S::select(self.correcting, flow, state.flow);
        }
        (state.flow, _) = self.filter.step(&mut state.flow_filter, state.flow, state.share, restart);
        // A rig that starts at rest, or primed, needs no settling.
        let first = state.tick <= 3 * self.last_tick;
        self.trust.settle(&mut state.trust, restart & !S::Mask::splat(first));
        state.started = state.window.whole;
    }

    #[inline(never)]
    fn compare(&self, state: &mut AdaptationState<S>) {
        let (flow, predicted, gain) = (state.flow, state.predicted, state.flow_gain.gain);
        self.trust.compare(&mut state.trust, flow, predicted, gain, state.spool, state.asked);
        let just_now = state.trust.quarantine.gt(self.trust.just_now);
        if just_now.any() {
            state.proof.go_back(&mut state.evidence, just_now);
            // Where nothing was learned since the last time it may be the means that are wrong.
            let again = S::splat(1.0) - state.trust.learned;
            state.released = S::select(just_now, again, state.released);
            state.trust.learned = S::select(just_now, S::splat(0.0), state.trust.learned);
        }
        if state.tick & self.last_of_proof <= self.last_tick {
            // While nothing is learned it is what it was.
            state.proof.put_by(&state.evidence, !just_now);
        }
        if self.correcting.any() {
            self.curve.offset(&mut state.curve);
        }
    }

    /// Whether the models explain the window.
    #[inline(never)]
    fn judge(&self, state: &mut AdaptationState<S>) {
        let fresh = state.window.whole.gt(S::splat(0.0));
        self.trust.judge(&mut state.trust, fresh & self.adapting);
        // What is not believed is no part of the means either.
        let frozen = state.trust.quarantine.gt(S::splat(0.0));
        state.share = S::select(frozen, state.released * state.mean_share, state.mean_share);
        if self.correcting.any() {
            self.curve.gains(&mut state.curve);
        }
    }

    /// Whether its evidence counts, and how much of the older evidence stays.
    #[inline(never)]
    fn weigh(&self, state: &mut AdaptationState<S>) {
        let openings = [state.window.means.spool, state.valve.opening()];
        let asked = [state.asked, state.asked_change];
        self.trust.weigh(&mut state.trust, &mut state.evidence.amount, openings, asked);
    }

    #[inline(always)]
    fn flow_gain(&self, state: &mut AdaptationState<S>) {
        let on = self.adapting;
        if !on.any() {
            return;
        }
        let instrument = state.trust.weight * state.asked;
        let (flow, predicted, weights) = (state.flow, state.predicted, [instrument, state.trust.keep]);
        self.flow_gain.step(&mut state.flow_gain, &mut state.evidence, flow, predicted, weights, on);
    }

    #[inline(never)]
    fn valve(&self, state: &mut AdaptationState<S>) {
        if self.correcting.any() {
            let believed = state.learning() & self.correcting;
            self.curve.believe(&mut state.curve, believed);
            self.curve.depart(&mut state.curve, 0);
        }
        self.guard.level_out(&mut state.guard, state.share);
        let t = state.trust;
        if t.weight.gt(S::splat(0.0)).any() {
            let (asked, weights) = ([state.asked, state.asked_change], [t.weight, t.keep]);
            self.valve.take(&state.valve, &mut state.evidence, asked, state.spool, weights);
        }
    }

    #[inline(never)]
    fn solve(&self, state: &mut AdaptationState<S>) {
        if self.correcting.any() {
            self.curve.depart(&mut state.curve, 1);
        }
        if self.adapting.any() {
            self.valve.solve(&mut state.valve, &state.evidence);
        }
    }

    #[inline(never)]
    fn correct(&self, state: &mut AdaptationState<S>) {
        let on = self.adapting;
        if self.correcting.any() {
            self.curve.gather(&mut state.curve);
        }
        if on.any() {
            self.valve.correct(&mut state.valve, on);
        }
    }

    /// The lead network of the estimated valve, and what there is to report.
    #[inline(never)]
    fn calibrate(&self, state: &mut AdaptationState<S>) {
        state.flow_gain.invert();
        if self.correcting.any() {
            self.curve.bend(&mut state.curve, 0);
        }
        // Without estimates the configured network stays as it is, only its level moves.
        let lead = self.valve.lead(&state.valve, state.guard.level);
        state.lead = LeadNetwork::of(
            S::select(self.adapting, lead.pole(), self.lead.pole()),
            S::select(self.adapting, lead.rate(), self.lead.rate()),
            lead.gain(),
        );
        let zero = S::splat(0.0);
        state.flags = S::flag(state.trust.quarantine.gt(zero) & self.adapting, status::ADAPTATION_FROZEN)
            | S::flag(
                (state.flow_gain.beyond + state.valve.beyond + state.curve.beyond).gt(zero),
                status::ESTIMATE_BOUNDED,
            )
            | S::flag(state.guard.level.lt(S::splat(1.0)), status::LEVEL_REDUCED);
    }
}

impl<S: Scalar, const N: usize> Adaptation<S, N> {
    /// Those of single rigs side by side, all sampled at one rate.
    pub(crate) fn pack<'a>(lane: impl Fn(usize) -> &'a Adaptation<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            last_tick: lane(0).last_tick,
            crowded: lane(0).crowded,
            per_window: S::from_lanes(|i| lane(i).per_window),
            adapting: S::Mask::from_lanes(|i| lane(i).adapting),
            guarding: S::Mask::from_lanes(|i| lane(i).guarding),
            correcting: S::Mask::from_lanes(|i| lane(i).correcting),
            piston_area: S::from_lanes(|i| lane(i).piston_area),
            flow_per_force: S::from_lanes(|i| lane(i).flow_per_force),
            flow_per_change: S::from_lanes(|i| lane(i).flow_per_change),
            prediction: FlowPrediction::pack(|i| &lane(i).prediction),
            filter: BandFilter::pack(|i| &lane(i).filter),
            flow_gain: FlowGainEstimator::pack(|i| &lane(i).flow_gain),
            curve: FlowCorrection::pack(|i| &lane(i).curve),
            valve: ValveEstimator::pack(|i| &lane(i).valve),
            guard: Guard::pack(|i| &lane(i).guard),
            trust: Trust::pack(|i| &lane(i).trust),
            last_of_proof: lane(0).last_of_proof,
            lead: LeadNetwork::pack(|i| &lane(i).lead),
        }
    }
}
