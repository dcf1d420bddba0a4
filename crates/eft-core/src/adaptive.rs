//! The adaptive compensation: the paper's, with flow feedforward, and with flow gain, valve and supply pressure as
//! they are found to be while the test runs.

use crate::adaptation::{Adaptation, AdaptationState};
use crate::compensation::{Calibration, Compensation, CompensationState, Output};
use crate::error::LARGEST;
use crate::feedforward::{Feedforward, FeedforwardState};
use crate::scalar::{Mask, Scalar};
use crate::status;
use crate::window::Measurements;

/// An adaptive compensation's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveCompensation<S: Scalar, const N: usize> {
    pub(crate) compensation: Compensation<S, N>,
    pub(crate) feedforward: Feedforward<S>,
    pub(crate) adaptation: Adaptation<S, N>,
    /// Configured supply pressure (Pa).
    pub(crate) supply_pressure: S,
    pub(crate) middle_supply: S,
    pub(crate) supply_range: S,
}

/// What an adaptive compensation remembers; made by [`AdaptiveCompensation::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct AdaptiveCompensationState<S: Scalar> {
    pub(crate) compensation: CompensationState<S>,
    feedforward: FeedforwardState<S>,
    pub(crate) adaptation: AdaptationState<S>,
}

impl<S: Scalar> AdaptiveCompensationState<S> {
    /// The last output (V).
    pub const fn output(&self) -> S {
        self.compensation.output()
    }
    /// The true flow over the configured table's, `θ` (1).
    pub const fn flow_gain(&self) -> S {
        self.adaptation.flow_gain.gain
    }
    /// The spool's gain over the configured one (1).
    pub const fn valve_gain(&self) -> S {
        self.adaptation.valve.gain
    }
    /// Delay (s) that the lead network makes up for: the valve's, half a sample of hold and any computation.
    pub const fn response_delay(&self) -> S {
        self.adaptation.valve.delay
    }
    /// The guard's factor on the compensation level (1).
    pub const fn level(&self) -> S {
        self.adaptation.guard.level
    }
}

impl<S: Scalar, const N: usize> AdaptiveCompensation<S, N> {
    /// A rig at rest, nothing learned yet.
    pub fn at_rest(&self) -> AdaptiveCompensationState<S> {
        let delay = self.adaptation.valve.nominal_delay;
        AdaptiveCompensationState {
            compensation: CompensationState::default(),
            feedforward: FeedforwardState::default(),
            adaptation: AdaptationState::new(delay, self.compensation.nominal().lead),
        }
    }

    /// No-load flow (m³/s) that the valve was found to pass at a spool opening (1): the table's, corrected and times `θ`.
    ///
    /// # NaN
    /// NaN for an opening that is NaN; beyond the table's ends the flow is that of the end.
    ///
    /// # Cost
    /// For after a test, not for a tick: the correction is searched.
    pub fn found_flow(&self, state: &AdaptiveCompensationState<S>, opening: S) -> S {
        self.adaptation.found_flow(&state.adaptation, opening)
    }

    /// One sample: the compensation signal `v_c` (V) for the force command (N) and the measurements.
    ///
    /// # NaN
    /// A measurement or command that is not finite or beyond its range repeats the last output and raises
    /// [`status::INVALID_MEASUREMENT`] or [`status::INVALID_COMMAND`]; nothing is learned for a
    /// tenth of a second after it. A valve command that is not finite keeps from learning only
    /// ([`status::ADAPTATION_FROZEN`]), and does nothing where nothing is estimated.
    ///
    /// # Cost
    /// Bounded: each tick does one slot of sixteen of the estimators' work, two below 3200 Hz.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut AdaptiveCompensationState<S>,
        command: S,
        measured: &Measurements<S>,
    ) -> Output<S> {
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
        state: &mut AdaptiveCompensationState<S>,
        command: S,
        next_command: S,
        measured: &Measurements<S>,
    ) -> Output<S> {
        self.adaptation.work(&mut state.adaptation);
        let supply = measured.supply_pressure / self.supply_pressure;
        let good = self.valid(command, measured, supply);
        if !good.any() {
            let status = self.idle(state, command, next_command);
            return Output { value: state.output(), status };
        }
        let (next, flags) = self.advance(state, next_command, measured, supply);
        state.compensation = CompensationState::select(good, next, state.compensation);
        let known = measured.valve_command.abs().le(S::splat(LARGEST));
        let valve_command = S::select(known, measured.valve_command, S::splat(0.0));
        let collected = Measurements { valve_command, ..*measured };
        state.adaptation.window.collect(command, &collected, supply, good);
        if !known.all() {
            // Only the estimators look at it: they wait, and all else goes on.
            self.adaptation.stand_in(&mut state.adaptation, measured.spool, good & !known);
        }
        let status = S::select_flags(good, flags, self.faults(command)) | state.adaptation.flags;
        Output { value: state.compensation.output(), status }
    }

    /// Why a sample was refused.
    #[inline(always)]
    pub(crate) fn faults(&self, command: S) -> S::Flags {
        let commanded = command.abs().le(S::splat(LARGEST));
        S::select_flags(
            commanded,
            S::flag(S::Mask::splat(true), status::INVALID_MEASUREMENT),
            S::flag(S::Mask::splat(true), status::INVALID_COMMAND),
        )
    }

    /// Where command (N) and measurements are finite and within their ranges; `supply` is the pressure over the
    /// configured one (1). The valve command is the caller's to judge.
    #[inline(always)]
    pub(crate) fn valid(&self, command: S, measured: &Measurements<S>, supply: S) -> S::Mask {
        command.abs().le(S::splat(LARGEST))
            & self.compensation.accepts(measured.velocity, measured.force, measured.spool)
            & (supply - self.middle_supply).abs().le(self.supply_range)
    }

    /// A sample of which nothing is valid: flags.
    #[inline(always)]
    pub(crate) fn idle(
        &self,
        state: &mut AdaptiveCompensationState<S>,
        command: S,
        next_command: S,
    ) -> S::Flags {
        // A valid command counts, so that the next one's rate is that of one sample.
        self.feedforward.step(&mut state.feedforward, next_command);
        state.adaptation.window.spoil(S::Mask::splat(true));
        self.faults(command) | state.adaptation.flags
    }

    /// The compensation's next state where all is valid.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &mut AdaptiveCompensationState<S>,
        next_command: S,
        measured: &Measurements<S>,
        supply: S,
    ) -> (CompensationState<S>, S::Flags) {
        let further_flow = self.feedforward.step(&mut state.feedforward, next_command);
        let calibration = Calibration {
            per_flow_gain: state.adaptation.flow_gain.per_gain,
            supply,
            lead: state.adaptation.lead,
            corrected: |demand| self.adaptation.corrected(&state.adaptation, demand),
        };
        self.compensation.advance_calibrated(
            &state.compensation,
            measured.velocity,
            measured.force,
            measured.spool,
            further_flow,
            &calibration,
        )
    }

    /// Repeats the last output and raises [`status::HELD`]; the state stays.
    pub fn hold(&self, state: &AdaptiveCompensationState<S>) -> Output<S> {
        Output { value: state.output(), status: S::flag(S::Mask::splat(true), status::HELD) }
    }

    /// The state of a rig that has long been at this operating point, nothing learned yet: the next
    /// [`step`](Self::step) with the same arguments repeats this state's output, without a bump.
    pub fn prime(&self, command: S, measured: &Measurements<S>) -> AdaptiveCompensationState<S> {
        let mut state = self.at_rest();
        state.feedforward = self.feedforward.at_rest(command);
        let mut feedforward = state.feedforward;
        let further_flow = self.feedforward.step(&mut feedforward, command);
        let m = measured;
        let supply = m.supply_pressure / self.supply_pressure;
        let nominal = self.compensation.nominal();
        let calibration = Calibration {
            per_flow_gain: nominal.per_flow_gain,
            supply,
            lead: nominal.lead,
            // The same arithmetic as in a step, to the last bit.
            corrected: |demand| self.adaptation.corrected(&state.adaptation, demand),
        };
        state.compensation =
            self.compensation.prime_calibrated(m.velocity, m.force, m.spool, further_flow, &calibration);
        state
    }
}

impl<S: Scalar, const N: usize> AdaptiveCompensation<S, N> {
    /// Those of single rigs side by side, all sampled at one rate.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a AdaptiveCompensation<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            compensation: Compensation::pack(|i| &lane(i).compensation),
            feedforward: Feedforward::pack(|i| &lane(i).feedforward),
            adaptation: Adaptation::pack(|i| &lane(i).adaptation),
            supply_pressure: S::from_lanes(|i| lane(i).supply_pressure),
            middle_supply: S::from_lanes(|i| lane(i).middle_supply),
            supply_range: S::from_lanes(|i| lane(i).supply_range),
        }
    }
}
