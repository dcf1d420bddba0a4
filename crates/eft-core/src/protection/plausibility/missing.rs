//! Learns the missing opening from the flow balance, and the motion that it makes.

use crate::number::Real;
use crate::protection::plausibility::stroke::VALVE;
use crate::protection::plausibility::sums::larger;
use crate::protection::plausibility::{Known, Plausibility, PlausibilityState};
use crate::signals::Input;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds the opening by a residual of the flow (m³/s), at this slope of the flow curve (m³/s) and spool opening (1), to the
    /// missing opening. A spool that is not where its command leads says nothing about the valve.
    #[inline(always)]
    pub(super) fn average(
        &self,
        state: &mut PlausibilityState<T>,
        [residual, slope]: [T; 2],
        spool: T,
        known: &Known<T>,
    ) {
        let led = state.stroke.opening;
        let widest = larger(spool.abs(), led.abs());
        let follows = (spool - led).abs() <= T::splat(VALVE) * widest + self.stroke.drift;
        // Beyond the table the flow has no slope.
        if slope > T::splat(0.0) && (follows | !known.valve_command.is_finite()) {
            state.missing.add(residual / slope, spool - self.null_bias, self.period);
        }
    }

    /// The missing opening while the force is distrusted. The mean of the oil's flow over a few swings is nearly zero.
    #[inline(always)]
    pub(super) fn learn_null_without_force(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        known: &Known<T>,
    ) {
        let [force, others @ ..] = state.distrusted;
        let opened = input.spool - self.null_bias;
        let model = self.model.flow(opened, opened, T::splat(0.0), known.supply);
        let slope = known.flow_gain * model.root;
        let residual = self.area * state.velocity - slope * model.at_no_load;
        if force & !others.contains(&true) & input.spool.is_finite() {
            self.average(state, [residual, slope * model.slope], input.spool, known);
        }
    }

    /// The velocity (m/s) of the piston by the missing opening and an opening (1) that a calibration adds, at this spool
    /// opening (1). A calibration that corrects the flow curve corrects its asymmetry as well.
    #[inline(always)]
    pub(crate) fn velocity_of_missing(
        &self,
        state: &PlausibilityState<T>,
        added: T,
        spool: T,
        corrects: bool,
    ) -> T {
        let opening = spool - self.null_bias;
        let excess = added + if corrects { state.missing.null_bias() } else { state.missing.at(opening) };
        let slope = self.model.flow(opening, opening, T::splat(0.0), T::splat(1.0)).slope;
        slope * excess / self.area
    }
}
