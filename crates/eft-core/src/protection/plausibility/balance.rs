//! The flow balance: piston, leakage and oil take what the valve passes, A·v + C_l·p_L + V/(4β)·ṗ_L = Q.
//!
//! The slow comparison allows for a wrong calibration. The fast one is above the motion's frequencies, where the oil's
//! flow, and with it the force, has a large part. The third one notices a force of the wrong sign.

use crate::learning::ModelFlow;
use crate::number::Real;
use crate::protection::plausibility::comparisons::FlowBalance;
use crate::protection::plausibility::sums::{envelope, high_pass, larger, low_pass, opposition};
use crate::protection::plausibility::{Control, Plausibility, PlausibilityState};
use crate::signals::Input;

/// Time (s) in which the low-passes settle to 2 %. The fast balance begins then.
pub(super) const SETTLING_TIME: f64 = 8.0e-3;
/// Share of the flow that a wrong calibration may leave, from the bounds of the self-calibration and the curve's error.
const FLOW_ERROR: f64 = 0.5;
/// The same above the motion's frequencies, where a wrong curve or gain leaves a smaller residual in a few
/// milliseconds.
const FAST_FLOW_ERROR: f64 = 0.2;
/// Share of the oil's flow that a stiffness from 0.6 to 1.5 times the configured one leaves.
const OIL_ERROR: f64 = 0.6;
/// Opening (1) within which an overlap counts.
const NULL_REGION: f64 = 0.03;
/// Share of an overlap's flow that counts against a force of the wrong sign.
const WRONG_SIGN_NULL: f64 = 0.25;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds a tick to the flow balance, with the mean velocity (m/s) over the tick, and returns the residual (m³/s).
    #[inline(always)]
    pub(super) fn add_flow(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        speed: T,
        model: &ModelFlow<T>,
        control: &Control<T>,
    ) -> T {
        let (limits, sums) = (&self.balance, &mut state.balance);
        let flow = control.flow_gain * (model.root * model.at_no_load);
        // The means over the tick, as for the differences of force and displacement.
        let valve_flow =
            low_pass(&mut sums.valve_flow, self.low_gain, T::splat(0.5) * (flow + sums.last_flow));
        sums.last_flow = flow;
        if !(sums.age > T::splat(0.0)) {
            // The force before the first sample is unknown.
            sums.force = input.force;
        }
        let settling = sums.age < T::splat(SETTLING_TIME);
        if settling {
            sums.age = sums.age + self.period;
        }
        let leakage_flow = self.leakage * input.force;
        let load_flow = low_pass(&mut sums.load_flow, self.low_gain, self.area * speed + leakage_flow);
        let before = sums.force;
        let oil = self.oil * self.rate * (low_pass(&mut sums.force, self.low_gain, input.force) - before);
        let residual = load_flow + oil - valve_flow;
        let largest =
            envelope(&mut sums.flow_envelope, self.decay, larger(valve_flow.abs(), load_flow.abs()));
        let tolerance = T::splat(FLOW_ERROR) * largest + T::splat(OIL_ERROR) * oil.abs() + limits.drift;
        sums.slow.add(self.period * residual, self.period * tolerance, limits.slow);
        self.add_fast_flow(sums, [residual, valve_flow, oil], input.spool - self.null_bias, settling);
        residual
    }

    /// Adds residual, valve's flow and oil's flow (m³/s) of a tick above the motion's frequencies, at an opening (1).
    #[inline(always)]
    fn add_fast_flow(&self, sums: &mut FlowBalance<T>, flows: [T; 3], opening: T, settling: bool) {
        let ([residual, valve_flow, oil], limits, one) = (flows, &self.balance, T::splat(1.0));
        // A null bias leaves a constant residual. Until the low-passes have settled, the high-passes take all of it for
        // their mean, so that its beginning is no step.
        let high = if settling { one } else { limits.high };
        let fast_residual = high_pass(&mut sums.fast_residual, high, residual);
        let fast_valve_flow = high_pass(&mut sums.fast_valve_flow, high, valve_flow);
        let valve_envelope = envelope(&mut sums.fast_valve_envelope, limits.fast_decay, fast_valve_flow);
        let fast_oil_flow = high_pass(&mut sums.fast_oil_flow, high, oil);
        let oil_envelope = envelope(&mut sums.fast_oil_envelope, limits.fast_decay, fast_oil_flow);
        // Near null an overlap that is not in the table blocks the flow.
        let near_null = if opening.abs() < T::splat(NULL_REGION) { one } else { T::splat(0.0) };
        let overlap_flow = envelope(&mut sums.near_null, one - limits.high, near_null) * limits.null_drift;
        // At most the output of a single high-pass for this flow.
        let [mean, _] = sums.fast_valve_flow;
        let high_passed = (valve_flow - mean).abs();
        let overlap_flow = if high_passed < overlap_flow { high_passed } else { overlap_flow };
        if self.fast_velocity {
            let allowed = T::splat(FAST_FLOW_ERROR) * valve_envelope;
            let tolerance = allowed + T::splat(OIL_ERROR) * oil_envelope + limits.fast_drift + overlap_flow;
            sums.fast.add(self.period * fast_residual, self.period * tolerance, limits.fast);
            let tolerance = allowed + limits.fast_drift + T::splat(WRONG_SIGN_NULL) * overlap_flow;
            let opposition = opposition(fast_oil_flow, fast_oil_flow - fast_residual);
            sums.wrong_sign.add(self.period * opposition, self.period * tolerance, limits.wrong_sign);
            // Both have the same sign, as they should.
            sums.wrong_sign.below = T::splat(0.0);
        }
    }
}
