//! The adaptive compensation: the paper's, with flow feedforward, and with flow gain, valve and supply pressure as
//! they are found to be while the test runs.

use crate::adaptation::{Adaptation, AdaptationState, Measurements};
use crate::compensation::{Calibration, Compensation, CompensationState, Output};
use crate::error::LARGEST;
use crate::feedforward::{Feedforward, FeedforwardState};
use crate::scalar::{Mask, Scalar};
use crate::status;

/// An adaptive compensation's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy)]
pub struct AdaptiveCompensation<S: Scalar, const N: usize> {
    pub(crate) compensation: Compensation<S, N>,
    pub(crate) feedforward: Feedforward<S>,
    pub(crate) adaptation: Adaptation<S, N>,
    pub(crate) per_supply_pressure: S,
    pub(crate) lowest_supply: S,
    pub(crate) highest_supply: S,
}

/// What an adaptive compensation remembers; made by [`AdaptiveCompensation::at_rest`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct AdaptiveCompensationState<S> {
    pub(crate) compensation: CompensationState<S>,
    feedforward: FeedforwardState<S>,
    adaptation: AdaptationState<S>,
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

    /// One sample: the compensation signal `v_c` (V) for the force command (N) and the measurements.
    ///
    /// # NaN
    /// A measurement or command that is not finite or beyond its range repeats the last output and raises
    /// [`status::INVALID_MEASUREMENT`] or [`status::INVALID_COMMAND`]; nothing is learned until the window after it.
    ///
    /// # Cost
    /// Bounded: each tick does one of eight slots of the estimators' work.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut AdaptiveCompensationState<S>,
        command: S,
        measured: &Measurements<S>,
    ) -> Output<S> {
        let (next, flags, good) = self.advance(state, command, measured);
        state.compensation = next;
        Output {
            value: state.compensation.output(),
            status: S::select_flags(good, flags, self.faults(command) | flags),
        }
    }

    #[inline(always)]
    pub(crate) fn faults(&self, command: S) -> S::Flags {
        let commanded = command.abs().le(S::splat(LARGEST));
        S::select_flags(
            commanded,
            S::flag(S::Mask::splat(true), status::INVALID_MEASUREMENT),
            S::flag(S::Mask::splat(true), status::INVALID_COMMAND),
        )
    }

    /// Where command and measurements are finite and within their ranges.
    #[inline(always)]
    pub(crate) fn valid(&self, command: S, measured: &Measurements<S>) -> S::Mask {
        let largest = S::splat(LARGEST);
        let supply = measured.supply_pressure * self.per_supply_pressure;
        command.abs().le(largest)
            & self.compensation.accepts(measured.velocity, measured.force, measured.spool)
            & measured.valve_command.abs().le(largest)
            & supply.ge(self.lowest_supply)
            & supply.le(self.highest_supply)
    }

    /// Everything but the output's state; the returned one is the next where all was valid, the old elsewhere.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &mut AdaptiveCompensationState<S>,
        command: S,
        measured: &Measurements<S>,
    ) -> (CompensationState<S>, S::Flags, S::Mask) {
        let supply = measured.supply_pressure * self.per_supply_pressure;
        let good = self.valid(command, measured);
        let further_flow = self.feedforward.step(&mut state.feedforward, command);
        let good = good & further_flow.abs().le(S::splat(LARGEST));
        let calibration = Calibration {
            per_flow_gain: state.adaptation.flow_gain.per_gain,
            supply,
            lead: state.adaptation.lead,
        };
        let (next, flags) = self.compensation.advance_calibrated(
            &state.compensation,
            measured.velocity,
            measured.force,
            measured.spool,
            further_flow,
            &calibration,
        );
        let learned = self.adaptation.step(&mut state.adaptation, command, measured, supply, good);
        let next = CompensationState::select(good, next, state.compensation);
        let zero = S::flag(S::Mask::splat(false), 0);
        (next, S::select_flags(good, flags, zero) | learned, good)
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
        let supply = m.supply_pressure * self.per_supply_pressure;
        let calibration = Calibration { supply, ..self.compensation.nominal() };
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
            per_supply_pressure: S::from_lanes(|i| lane(i).per_supply_pressure),
            lowest_supply: S::from_lanes(|i| lane(i).lowest_supply),
            highest_supply: S::from_lanes(|i| lane(i).highest_supply),
        }
    }
}
