//! Learns the opening offset from the flow balance, and the motion that it makes.

use crate::number::Real;
use crate::protection::plausibility::spool::VALVE_TOLERANCE;
use crate::protection::plausibility::sums::larger;
use crate::protection::plausibility::{Control, Plausibility, PlausibilityState};
use crate::signals::Input;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds the opening by a residual of the flow (m³/s), at this slope of the flow curve (m³/s) and spool opening (1),
    /// to the opening offset. A spool that is not where its command leads says nothing about the valve.
    #[inline(always)]
    pub(super) fn average_offset(
        &self,
        state: &mut PlausibilityState<T>,
        [residual, slope]: [T; 2],
        spool: T,
        control: &Control<T>,
    ) {
        let modelled = state.stroke.opening;
        let opening_envelope = larger(spool.abs(), modelled.abs());
        let follows =
            (spool - modelled).abs() <= T::splat(VALVE_TOLERANCE) * opening_envelope + self.stroke.drift;
        // Beyond the table the flow has no slope.
        if slope > T::splat(0.0) && (follows | !control.valve_command.is_finite()) {
            state.opening_offset.add(residual / slope, spool - self.null_bias, self.period);
        }
    }

    /// The opening offset while the force is distrusted. The mean of the oil's flow over a few swings is nearly zero.
    #[inline(always)]
    pub(super) fn learn_null_without_force(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        control: &Control<T>,
    ) {
        let [force, others @ ..] = state.distrusted;
        let opened = input.spool - self.null_bias;
        let model = self.model.flow(opened, opened, T::splat(0.0), control.supply);
        let slope = control.flow_gain * model.root;
        let residual = self.area * state.velocity - slope * model.at_no_load;
        if force & !others.contains(&true) & input.spool.is_finite() {
            self.average_offset(state, [residual, slope * model.slope], input.spool, control);
        }
    }

    /// The velocity (m/s) of the piston by the opening offset and an opening (1) that a calibration adds, at this spool
    /// opening (1). A calibration that corrects the flow curve corrects its asymmetry as well.
    #[inline(always)]
    pub(crate) fn offset_velocity(
        &self,
        state: &PlausibilityState<T>,
        added: T,
        spool: T,
        corrects: bool,
    ) -> T {
        let opening = spool - self.null_bias;
        let excess = added
            + if corrects { state.opening_offset.null_bias() } else { state.opening_offset.at(opening) };
        let slope = self.model.flow(opening, opening, T::splat(0.0), T::splat(1.0)).slope;
        slope * excess / self.area
    }
}
