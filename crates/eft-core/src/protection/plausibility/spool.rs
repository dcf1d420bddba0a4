//! The spool compared with its command, which passes through a model of the valve.

use crate::number::Real;
use crate::protection::plausibility::sums::{envelope, larger, low_pass, opposition};
use crate::protection::plausibility::{Control, Plausibility, PlausibilityState};

/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
pub(super) const VALVE_TOLERANCE: f64 = 0.3;
/// Share of the larger opening that a valve gain at its bounds of 0.8 and 1.25 leaves.
const GAIN_ERROR: f64 = 0.2;
/// Opening (1) by which the valve leaves its model, with a hysteresis of 0.5 % of the stroke.
const HYSTERESIS: f64 = 2.5e-3;
/// Three deviations of the noise, in units of a still change.
const THREE_DEVIATIONS: f64 = 30.0;

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

    /// Whether the spool's swing leaves that of the valve's model by more than a sound valve's does. The model does not
    /// contain the force, so that a wrong force moves both.
    ///
    /// Half of the delay may be wrong. Each of the model's lags is half of the delay, so that this changes the opening
    /// by what the second lag is behind. A null bias is no part of the swings.
    #[inline(always)]
    pub(super) fn spool_departs(&self, state: &PlausibilityState<T>, control: &Control<T>) -> bool {
        let (stroke, [.., spool], [.., still_change]) =
            (&state.stroke, &state.signals, self.gate.still_change);
        let (measured, modelled) = (spool.last - stroke.measured, stroke.opening - stroke.commanded);
        let by_gain = T::splat(GAIN_ERROR) * larger(measured.abs(), modelled.abs());
        let by_delay = (stroke.first - stroke.opening).abs();
        let by_noise = T::splat(THREE_DEVIATIONS) * still_change;
        control.valve_command.is_finite()
            && (measured - modelled).abs() > by_gain + by_delay + by_noise + T::splat(HYSTERESIS)
    }
}
