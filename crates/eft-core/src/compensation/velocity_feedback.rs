//! Velocity feedback compensation (Fig. 5 of the paper): one call a sample.

use crate::compensation::{Calibration, CurveGrid, InverseFlow, LeadNetwork, LeadState, null_bias};
use crate::error::{ConfigError, LARGEST, check, range};
use crate::integrity::integrity;
use crate::number::{Mask, Scalar};
use crate::parameters::{Mode, Parameters};
use crate::status;

/// The compensation's immutable configuration; one drives any number of channels.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Compensation<S: Scalar, const N: usize> {
    inverse: InverseFlow<S, N>,
    lead: LeadNetwork<S>,
    response_delay: S,
    velocity_to_flow: S,
    velocity_range: S,
    force_range: S,
    spool_range: S,
    spool_warning: S,
    /// Known null bias (1).
    null_bias: S,
    /// Where the calibration's null offset is added.
    adds_null: S::Mask,
    /// Where the flow table is corrected, and the distance of the correction's nodes.
    corrects: S::Mask,
    grid: CurveGrid<S>,
}
integrity!(
    Compensation<T, N>: inverse, lead, response_delay, velocity_to_flow, velocity_range, force_range, spool_range,
    spool_warning, null_bias, adds_null, corrects, grid
);

/// One sample's measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompensationInput<S> {
    /// Piston velocity (m/s).
    pub velocity: S,
    /// Force (N).
    pub force: S,
    /// Spool opening (1).
    pub spool: S,
    /// Supply pressure over the configured one (1).
    pub supply: S,
    /// Flow (m³/s) that is required in addition to the piston's.
    pub further_flow: S,
}

/// The state of the compensation. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct CompensationState<S> {
    lead: LeadState<S>,
    output: S,
}
integrity!(CompensationState<T>: lead, output);

impl<S: Copy + Default> CompensationState<S> {
    /// At rest with this output (V).
    pub(crate) fn holding(output: S) -> Self {
        Self { output, ..Self::default() }
    }
}

impl<S: Copy> CompensationState<S> {
    /// The last output (V).
    pub const fn output(&self) -> S {
        self.output
    }
}

impl<S: Scalar> CompensationState<S> {
    /// The state after a sample that requires this opening (1), without the null offset.
    #[inline(always)]
    pub(crate) fn advance(&self, opening: S, calibration: &Calibration<S>) -> Self {
        let mut lead = self.lead;
        let output = calibration.lead.step(&mut lead, opening);
        Self { lead, output }
    }

    /// Where the mask is true, the state with this opening (1) as its last one: the opening then has the rate from
    /// before a gap.
    #[inline(always)]
    pub(crate) fn resumed(&self, resumes: S::Mask, opening: S) -> Self {
        Self { lead: LeadState::select(resumes, self.lead.resumed(opening), self.lead), ..*self }
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self {
            lead: LeadState::select(mask, yes.lead, no.lead),
            output: S::select(mask, yes.output, no.output),
        }
    }
}

/// One sample's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompensationOutput<S: Scalar> {
    /// The compensation signal (V).
    pub value: S,
    /// Bits of [`status`].
    pub status: S::Flags,
}

impl<S: Scalar, const N: usize> Compensation<S, N> {
    /// One sample: the compensation signal `v_c` (V). A [`Controller`](crate::Controller) adds the signal of the null
    /// offset.
    ///
    /// # NaN
    /// A measurement that is not finite or beyond its range, or such a flow, leaves the state as it was, repeats the
    /// last output and raises [`status::INVALID_MEASUREMENT`]; the next good one continues.
    ///
    /// # Cost
    /// Independent of mode and history.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut CompensationState<S>,
        input: &CompensationInput<S>,
        calibration: &Calibration<S>,
    ) -> CompensationOutput<S> {
        let valid = self.accepts(input.velocity, input.force, input.spool)
            & input.further_flow.abs().le(S::splat(LARGEST));
        if !valid.any() {
            return self.repeat(state);
        }
        let (opening, flags) = self.required_opening(input, calibration);
        let next = state.advance(opening, calibration);
        *state = CompensationState::select(valid, next, *state);
        let invalid = S::flag(!valid, status::INVALID_MEASUREMENT);
        CompensationOutput { value: state.output, status: S::select_flags(valid, flags, invalid) }
    }

    /// As [`CompensationState::advance`], with the null offset in the output.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &CompensationState<S>,
        opening: S,
        calibration: &Calibration<S>,
    ) -> CompensationState<S> {
        let mut next = state.advance(opening, calibration);
        if self.adds_null.any() {
            next.output = S::select(self.adds_null, next.output + calibration.null_signal, next.output);
        }
        next
    }

    #[cold]
    fn repeat(&self, state: &CompensationState<S>) -> CompensationOutput<S> {
        let status = S::flag(S::Mask::splat(true), status::INVALID_MEASUREMENT);
        CompensationOutput { value: state.output, status }
    }

    /// Whether any lane's calibration corrects the flow curve.
    #[inline(always)]
    pub(crate) fn corrects(&self) -> bool {
        self.corrects.any()
    }

    /// The calibration of the configuration, which is the paper's scheme.
    #[inline(always)]
    pub fn nominal(&self) -> Calibration<S> {
        Calibration::of(self.lead, self.response_delay, self.null_bias)
    }

    /// The compensation signal (V) that holds the valve at an opening (1) beyond its known null.
    pub(crate) fn null_signal_beyond(&self, opening: S) -> S {
        (self.null_bias + opening) * self.lead.gain()
    }

    /// The compensation signal (V) for the null of a calibration.
    pub(crate) fn null_signal(&self, calibration: &Calibration<S>) -> S {
        S::select(self.adds_null, calibration.null_signal, S::splat(0.0))
    }

    /// The commanded opening (1) at the null of a calibration.
    pub(crate) fn null_opening(&self, calibration: &Calibration<S>) -> S {
        S::select(self.adds_null, calibration.null_offset, S::splat(0.0))
    }

    /// The compensation signal (V) that the null of a calibration needs beyond [`null_signal`](Self::null_signal).
    pub(crate) fn residual_null_signal(&self, calibration: &Calibration<S>) -> S {
        self.null_opening(calibration) * self.lead.gain() - self.null_signal(calibration)
    }

    /// The state of a rig that has long been at this operating point. The next [`step`](Self::step) with the same
    /// input gives the same output, without a bump. An invalid input gives the state of a rig at rest.
    pub fn prime(&self, input: &CompensationInput<S>, calibration: &Calibration<S>) -> CompensationState<S> {
        let (opening, _) = self.required_opening(input, calibration);
        let valid = self.accepts(input.velocity, input.force, input.spool);
        let opening = S::select(valid, opening, S::splat(0.0));
        CompensationState::default().resumed(S::Mask::splat(true), opening).advance(opening, calibration)
    }

    /// Compensations of single rigs in lanes.
    pub fn pack<'a>(lane: &dyn Fn(usize) -> &'a Compensation<S::Element, N>) -> Self
    where
        S::Element: 'a,
    {
        Self {
            response_delay: S::from_lanes(|i| lane(i).response_delay),
            velocity_to_flow: S::from_lanes(|i| lane(i).velocity_to_flow),
            velocity_range: S::from_lanes(|i| lane(i).velocity_range),
            force_range: S::from_lanes(|i| lane(i).force_range),
            spool_range: S::from_lanes(|i| lane(i).spool_range),
            spool_warning: S::from_lanes(|i| lane(i).spool_warning),
            null_bias: S::from_lanes(|i| lane(i).null_bias),
            adds_null: S::Mask::from_lanes(|i| lane(i).adds_null),
            corrects: S::Mask::from_lanes(|i| lane(i).corrects),
            grid: CurveGrid::pack(&|i| &lane(i).grid),
            inverse: InverseFlow::pack(&|i| &lane(i).inverse),
            lead: LeadNetwork::pack(&|i| &lane(i).lead),
        }
    }

    /// Where velocity (m/s), force (N) and spool opening (1) are finite and within their ranges.
    // Comparisons with NaN are false, so one test finds NaN, infinities and implausible values.
    #[inline(always)]
    pub fn accepts(&self, velocity: S, force: S, spool: S) -> S::Mask {
        velocity.abs().le(self.velocity_range)
            & force.abs().le(self.force_range)
            & spool.abs().le(self.spool_range)
    }

    /// The required opening (1) of a valve without overlap, for valid measurements.
    #[inline(always)]
    pub(crate) fn required_opening(
        &self,
        i: &CompensationInput<S>,
        calibration: &Calibration<S>,
    ) -> (S, S::Flags) {
        let flow = (self.velocity_to_flow * i.velocity + i.further_flow) * calibration.per_flow_gain;
        let (mut demand, floored) = self.inverse.demand(flow, i.force, i.spool, i.supply);
        if self.corrects.any() {
            demand = S::select(self.corrects, self.grid.apply(&calibration.curve, demand), demand);
        }
        let (opening, saturated) = self.inverse.opening(demand);
        let wider = opening.abs().larger(i.spool.abs());
        let flags = S::flag(floored, status::LOAD_PRESSURE_FLOORED)
            | S::flag(saturated, status::DEMAND_SATURATED)
            | S::flag(wider.gt(self.spool_warning), status::SPOOL_WARNING);
        (opening, flags)
    }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Compensation<$t, N> {
            /// From the rig's parameters.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                let mut compensation = Self::EMPTY;
                check!(compensation.fill(p));
                Ok(compensation)
            }

            pub(crate) const EMPTY: Self = Self {
                inverse: InverseFlow::<$t, N>::EMPTY,
                lead: LeadNetwork::<$t>::NONE,
                response_delay: 0.0,
                velocity_to_flow: 0.0,
                velocity_range: 0.0,
                force_range: 0.0,
                spool_range: 0.0,
                spool_warning: 0.0,
                null_bias: 0.0,
                adds_null: false,
                corrects: false,
                grid: CurveGrid { per_flow: 0.0, step: 0.0 },
            };

            /// As [`new`](Self::new), in place.
            pub(crate) const fn fill(&mut self, p: &Parameters) -> Result<(), ConfigError> {
                check!(self.inverse.fill(p));
                let grid = CurveGrid::over(p.greatest_flow());
                self.velocity_to_flow = if matches!(p.mode, Mode::Off) { 0.0 } else { p.piston_area as $t };
                self.velocity_range = check!(range("velocity_range", p.velocity_range)) as $t;
                self.force_range = check!(range("force_range", p.force_range)) as $t;
                self.spool_range = check!(range("spool_range", p.spool_range)) as $t;
                self.spool_warning = check!(range("spool_warning", p.spool_warning)) as $t;
                self.corrects = p.learning.adaptive && p.learning.curve_correction;
                self.null_bias = check!(null_bias(p)) as $t;
                self.adds_null = self.corrects || self.null_bias != 0.0;
                self.grid = CurveGrid { per_flow: grid.per_flow as $t, step: grid.step as $t };
                self.lead = check!(LeadNetwork::<$t>::by(p));
                self.response_delay = p.response_delay as $t;
                Ok(())
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Learning;

    #[test]
    fn an_invalid_measurement_primes_a_rig_at_rest() {
        let compensation = Compensation::<f64, 21>::new(&Parameters::ZHAO2005).unwrap();
        let sound =
            CompensationInput { velocity: 0.2, force: 0.0, spool: 0.1, supply: 1.0, further_flow: 0.0 };
        let primed = |input| compensation.prime(&input, &compensation.nominal());
        assert_ne!(primed(sound), CompensationState::default());
        for lost in [
            CompensationInput { velocity: f64::NAN, ..sound },
            CompensationInput { force: f64::INFINITY, ..sound },
            CompensationInput { spool: -2.0 * LARGEST, ..sound },
        ] {
            assert_eq!(primed(lost), CompensationState::default());
        }
    }

    #[test]
    fn only_a_learner_that_adapts_and_corrects_has_its_curve_and_null_offset_used() {
        for (adaptive, curve_correction) in [(false, false), (true, false), (false, true), (true, true)] {
            let learning = Learning { adaptive, curve_correction, ..Learning::OFF };
            let p = Parameters { learning, ..Parameters::ZHAO2005 };
            let compensation = Compensation::<f64, 21>::new(&p).unwrap();
            let nominal = compensation.nominal();
            let output = |calibration: &Calibration<f64>| {
                let state = CompensationState::default().resumed(true, 0.1);
                let velocity = 0.2;
                let input =
                    CompensationInput { velocity, force: 0.0, spool: 0.1, supply: 1.0, further_flow: 0.0 };
                let (opening, _) = compensation.required_opening(&input, calibration);
                [opening, compensation.advance(&state, 0.1, calibration).output()]
            };
            let mut curve = nominal.curve;
            for piece in &mut curve {
                piece.slope = 1.1;
            }
            let [opening, voltage] = output(&nominal);
            let [corrected, added] = output(&Calibration { curve, null_signal: 0.5, ..nominal });
            assert!((added - voltage - if adaptive && curve_correction { 0.5 } else { 0.0 }).abs() < 1e-12);
            assert_eq!(corrected > 1.05 * opening, adaptive && curve_correction, "{opening} {corrected}");
        }
    }
}
