//! Velocity feedback compensation (Fig. 5 of the paper): one call a sample.

use crate::error::{ConfigError, LARGEST, check, positive, range};
use crate::flow_table::FlowTable;
use crate::inverse_flow::{Inverse, InverseFlow, InverseFlowParameters, SignFrom};
use crate::lead::{LeadNetwork, LeadState};
use crate::scalar::{Mask, Scalar};
use crate::status;

/// The compensation scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// The piston's motion is not compensated.
    Off = 0,
    /// Through the initial flow gain `K_v`.
    Linear = 1,
    /// Through the inverse flow table and the load-pressure correction.
    Nonlinear = 2,
}

/// What a compensation is made from, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompensationParameters {
    /// The scheme.
    pub mode: Mode,
    /// Compensation level (1).
    pub level: f64,
    /// Piston area `A` (m²).
    pub piston_area: f64,
    /// Supply pressure `P_s` (Pa).
    pub supply_pressure: f64,
    /// Flow gain `K_v` (m³/s per unit opening) of the linear scheme.
    pub flow_gain: f64,
    /// Valve gain `K_s` (unit opening per V).
    pub valve_gain: f64,
    /// Proportional gain `G_p` (V/V) of the servovalve controller behind the compensation.
    pub proportional_gain: f64,
    /// Response delay `T_d` (s).
    pub response_delay: f64,
    /// The lead network's `α` (1).
    pub lead_alpha: f64,
    /// Sample rate (Hz).
    pub sample_rate: f64,
    /// Where the sign in the load-pressure correction comes from.
    pub sign_from: SignFrom,
    /// Opening (1) beyond which [`status::SPOOL_WARNING`] is raised.
    pub spool_warning: f64,
    /// Velocity (m/s) beyond which a measurement is invalid; none beyond [`LARGEST`] is ever valid.
    pub velocity_range: f64,
    /// Force (N) beyond which a measurement is invalid.
    pub force_range: f64,
    /// Spool opening (1) beyond which a measurement is invalid.
    pub spool_range: f64,
}

/// The compensation's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Compensation<S: Scalar, const N: usize> {
    inverse: InverseFlow<S, N>,
    pub(crate) lead: LeadNetwork<S>,
    velocity_to_flow: S,
    velocity_range: S,
    force_range: S,
    spool_range: S,
    spool_warning: S,
}

/// What the compensation remembers from sample to sample. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct CompensationState<S> {
    lead: LeadState<S>,
    output: S,
}

impl<S: Copy> CompensationState<S> {
    /// The last output (V).
    pub const fn output(&self) -> S {
        self.output
    }
}

impl<S: Scalar> CompensationState<S> {
    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            lead: LeadState::select(mask, yes.lead, no.lead),
            output: S::select(mask, yes.output, no.output),
        }
    }
}

/// What an adaptive controller finds out about the rig while it runs.
#[derive(Clone, Copy)]
pub(crate) struct Calibration<S, F> {
    /// The table's flow over the true one (1).
    pub(crate) per_flow_gain: S,
    /// Supply pressure over the configured one (1).
    pub(crate) supply: S,
    /// The inverse of the valve as it is.
    pub(crate) lead: LeadNetwork<S>,
    /// From the no-load flow (m³/s) that is demanded to the one that the table has for the opening that passes it.
    pub(crate) corrected: F,
}

/// One sample's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output<S: Scalar> {
    /// Volt.
    pub value: S,
    /// Bits of [`status`].
    pub status: S::Flags,
}

impl<S: Scalar, const N: usize> Compensation<S, N> {
    /// One sample: the compensation signal `v_c` (V) for the measured piston velocity (m/s), force (N) and spool
    /// opening (1), and a further flow (m³/s) that is wanted on top of the piston's.
    ///
    /// # NaN
    /// A measurement that is not finite or beyond its range, or such a flow, leaves the state as it was, repeats the last output
    /// and raises [`status::INVALID_MEASUREMENT`]; the next good one continues.
    ///
    /// # Cost
    /// Independent of mode and history.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut CompensationState<S>,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
    ) -> Output<S> {
        let valid = self.accepts(velocity, force, spool) & further_flow.abs().le(S::splat(LARGEST));
        let invalid = S::flag(!valid, status::INVALID_MEASUREMENT);
        if !valid.any() {
            return Output { value: state.output, status: invalid };
        }
        let (next, regular) = self.advance(state, velocity, force, spool, further_flow);
        *state = CompensationState::select(valid, next, *state);
        Output { value: state.output, status: S::select_flags(valid, regular, invalid) }
    }

    /// What [`step`](Self::step) makes of valid measurements.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &CompensationState<S>,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
    ) -> (CompensationState<S>, S::Flags) {
        self.advance_calibrated(state, velocity, force, spool, further_flow, &self.nominal())
    }

    /// As [`advance`](Self::advance), by a calibration that was found while running.
    #[inline(always)]
    pub(crate) fn advance_calibrated(
        &self,
        state: &CompensationState<S>,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
        calibration: &Calibration<S, impl Fn(S) -> S>,
    ) -> (CompensationState<S>, S::Flags) {
        let (opening, flags) = self.required_opening(velocity, force, spool, further_flow, calibration);
        let mut lead = state.lead;
        let output = calibration.lead.step(&mut lead, opening);
        (CompensationState { lead, output }, flags)
    }

    /// The calibration by the configuration.
    #[inline(always)]
    pub(crate) fn nominal(&self) -> Calibration<S, impl Fn(S) -> S> {
        let one = S::splat(1.0);
        Calibration { per_flow_gain: one, supply: one, lead: self.lead, corrected: |demand| demand }
    }

    /// Repeats the last output and raises [`status::HELD`]; the state stays.
    pub fn hold(&self, state: &CompensationState<S>) -> Output<S> {
        Output { value: state.output, status: S::flag(S::Mask::splat(true), status::HELD) }
    }

    /// The state of a rig that has long been at this operating point: the next [`step`](Self::step) with the same
    /// measurements gives the same output, without a bump. Invalid measurements give the state of a rig at rest.
    pub fn prime(&self, velocity: S, force: S, spool: S, further_flow: S) -> CompensationState<S> {
        self.prime_calibrated(velocity, force, spool, further_flow, &self.nominal())
    }

    /// As [`prime`](Self::prime), by a calibration that was found while running.
    pub(crate) fn prime_calibrated(
        &self,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
        calibration: &Calibration<S, impl Fn(S) -> S>,
    ) -> CompensationState<S> {
        let valid = self.accepts(velocity, force, spool) & further_flow.abs().le(S::splat(LARGEST));
        let (opening, _) = self.required_opening(velocity, force, spool, further_flow, calibration);
        let opening = S::select(valid, opening, S::splat(0.0));
        let mut lead = LeadNetwork::at_rest(opening);
        let output = calibration.lead.step(&mut lead, opening);
        CompensationState { lead, output }
    }

    /// Compensations of single rigs side by side.
    pub fn pack<'a>(lane: impl Fn(usize) -> &'a Compensation<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            velocity_to_flow: S::from_lanes(|i| lane(i).velocity_to_flow),
            velocity_range: S::from_lanes(|i| lane(i).velocity_range),
            force_range: S::from_lanes(|i| lane(i).force_range),
            spool_range: S::from_lanes(|i| lane(i).spool_range),
            spool_warning: S::from_lanes(|i| lane(i).spool_warning),
            inverse: InverseFlow::pack(|i| &lane(i).inverse),
            lead: LeadNetwork::pack(|i| &lane(i).lead),
        }
    }

    /// Where the measurements are finite and within their ranges.
    // Comparisons with NaN are false, so NaN, infinities and implausible values go at once.
    #[inline(always)]
    pub fn accepts(&self, velocity: S, force: S, spool: S) -> S::Mask {
        velocity.abs().le(self.velocity_range)
            & force.abs().le(self.force_range)
            & spool.abs().le(self.spool_range)
    }

    #[inline(always)]
    fn required_opening(
        &self,
        velocity: S,
        force: S,
        spool: S,
        further_flow: S,
        calibration: &Calibration<S, impl Fn(S) -> S>,
    ) -> (S, S::Flags) {
        let flow = (self.velocity_to_flow * velocity + further_flow) * calibration.per_flow_gain;
        let (opening, flags) =
            self.inverse.required_opening_at(flow, force, spool, calibration.supply, &calibration.corrected);
        let (required, measured) = (opening.abs(), spool.abs());
        let wider = S::select(required.gt(measured), required, measured);
        (opening, flags | S::flag(wider.gt(self.spool_warning), status::SPOOL_WARNING))
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Compensation<$t, N> {
            /// From its parameters and the flow table.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name.
            pub const fn new(
                p: &CompensationParameters,
                table: &FlowTable<$t, N>,
            ) -> Result<Self, ConfigError> {
                let inverse = InverseFlowParameters {
                    inverse: if matches!(p.mode, Mode::Linear) {
                        Inverse::Linear
                    } else {
                        Inverse::Nonlinear
                    },
                    level: p.level,
                    flow_gain: p.flow_gain,
                    piston_area: p.piston_area,
                    supply_pressure: p.supply_pressure,
                    sign_from: p.sign_from,
                };
                let valve_gain = check!(positive("valve_gain", p.valve_gain));
                let gain = 1.0 / (check!(positive("proportional_gain", p.proportional_gain)) * valve_gain);
                let area = if matches!(p.mode, Mode::Off) { 0.0 } else { p.piston_area };
                Ok(Self {
                    velocity_to_flow: area as $t,
                    velocity_range: check!(range("velocity_range", p.velocity_range)) as $t,
                    force_range: check!(range("force_range", p.force_range)) as $t,
                    spool_range: check!(range("spool_range", p.spool_range)) as $t,
                    spool_warning: check!(range("spool_warning", p.spool_warning)) as $t,
                    inverse: check!(InverseFlow::<$t, N>::new(&inverse, table)),
                    lead: check!(LeadNetwork::<$t>::new(gain, p.response_delay, p.lead_alpha, p.sample_rate)),
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
