//! The spool compared with its command, which passes through a model of the valve.

use crate::number::Real;
use crate::protection::plausibility::sums::{envelope, larger, low_pass, opposition};
use crate::protection::plausibility::{Control, Plausibility, PlausibilityState};

/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
pub(super) const VALVE_TOLERANCE: f64 = 0.3;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// The opening that should follow from the valve command.
    #[inline(always)]
    pub(super) fn model_valve(&self, state: &mut PlausibilityState<T>, control: &Control<T>) {
        if control.valve_command.is_finite() {
            let one = T::splat(1.0);
            let commanded = (control.valve_gain * self.valve_gain * control.valve_command).limit(-one, one);
            let commanded = low_pass(&mut state.stroke.first, self.stroke.lag, commanded);
            low_pass(&mut state.stroke.opening, self.stroke.lag, commanded);
        }
    }

    /// Adds a tick's spool opening (1).
    #[inline(always)]
    pub(super) fn compare_spool(&self, state: &mut PlausibilityState<T>, spool: T, control: &Control<T>) {
        if !control.valve_command.is_finite() {
            return;
        }
        let (limits, sums) = (&self.stroke, &mut state.stroke);
        let commanded = low_pass(&mut sums.commanded, self.spool_gain, sums.opening);
        let measured = low_pass(&mut sums.measured, self.spool_gain, spool);
        let largest =
            envelope(&mut sums.opening_envelope, self.decay, larger(commanded.abs(), measured.abs()));
        let tolerance = T::splat(VALVE_TOLERANCE) * largest + limits.drift;
        sums.difference.add(self.period * (measured - commanded), self.period * tolerance, limits.difference);
        // A null bias is no part of the swings about their means.
        let commanded = commanded - low_pass(&mut sums.commanded_mean, self.spool_gain, commanded);
        let moved = measured - low_pass(&mut sums.measured_mean, self.spool_gain, measured);
        let change = self.period * opposition(commanded, moved);
        sums.against.add(change, self.period * limits.against_drift, limits.against);
        sums.against.below = T::splat(0.0);
    }
}
