//! The flow balance: piston, leakage and oil take what the valve passes, A·v + C_l·p_L + V/(4β)·ṗ_L = Q.
//!
//! The slow comparison allows for a wrong calibration. The fast one is above the motion's frequencies, where the oil's
//! flow, and with it the force, has a large part. The third one notices a force of the wrong sign.

use crate::learning::ModelFlow;
use crate::number::Real;
use crate::protection::plausibility::comparisons::Balance;
use crate::protection::plausibility::sums::{envelope, follow, larger, opposed, rest};
use crate::protection::plausibility::{Known, Plausibility, PlausibilityState};
use crate::signals::Input;

/// Time (s) in which the low-passes settle to 2 %. The fast balance begins then.
pub(super) const SETTLED: f64 = 8.0e-3;
/// Share of the flow that a wrong calibration may leave, from the bounds of the self-calibration and the curve's error.
const FLOW: f64 = 0.5;
/// The same above the motion's frequencies, where a wrong curve or gain leaves a smaller residual in a few
/// milliseconds.
const FAST_FLOW: f64 = 0.2;
/// Share of the oil's flow that a stiffness from 0.6 to 1.5 times the configured one leaves.
const OIL: f64 = 0.6;
/// Opening (1) within which an overlap counts.
const NULL_REGION: f64 = 0.03;
/// Share of an overlap's flow that counts against a force of the wrong sign.
const TURNED_NULL: f64 = 0.25;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds a tick to the flow balance, with the mean velocity (m/s) over the tick, and returns the residual (m³/s).
    #[inline(always)]
    pub(super) fn add_flow(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        speed: T,
        model: &ModelFlow<T>,
        known: &Known<T>,
    ) -> T {
        let (limits, sums) = (&self.balance, &mut state.balance);
        let flow = known.flow_gain * (model.root * model.at_no_load);
        // The means over the tick, as for the differences of force and displacement.
        let passed = follow(&mut sums.passed, self.low, T::splat(0.5) * (flow + sums.flow));
        sums.flow = flow;
        if !(sums.age > T::splat(0.0)) {
            // The force before the first sample is unknown.
            sums.force = input.force;
        }
        let settles = sums.age < T::splat(SETTLED);
        if settles {
            sums.age = sums.age + self.period;
        }
        let leaked = self.leakage * input.force;
        let taken = follow(&mut sums.taken, self.low, self.area * speed + leaked);
        let before = sums.force;
        let oil = self.oil * self.rate * (follow(&mut sums.force, self.low, input.force) - before);
        let residual = taken + oil - passed;
        let seen = envelope(&mut sums.most_flow, self.decay, larger(passed.abs(), taken.abs()));
        let tolerance = T::splat(FLOW) * seen + T::splat(OIL) * oil.abs() + limits.drift;
        sums.slow.add(self.period * residual, self.period * tolerance, limits.slow);
        self.add_fast_flow(sums, [residual, passed, oil], input.spool - self.null_bias, settles);
        residual
    }

    /// Adds residual, valve's flow and oil's flow (m³/s) of a tick above the motion's frequencies, at an opening (1).
    #[inline(always)]
    fn add_fast_flow(&self, sums: &mut Balance<T>, flows: [T; 3], opened: T, settles: bool) {
        let ([residual, passed, oil], limits, one) = (flows, &self.balance, T::splat(1.0));
        // A null bias leaves a constant residual. Until the low-passes have settled, the high-passes take all of it for
        // their mean, so that its beginning is no step.
        let high = if settles { one } else { limits.high };
        let residual_above = rest(&mut sums.residual_above, high, residual);
        let passed_above = rest(&mut sums.passed_above, high, passed);
        let flow_above = envelope(&mut sums.most_passed_above, limits.fast_decay, passed_above);
        let measured = rest(&mut sums.oil_above, high, oil);
        let oil_above = envelope(&mut sums.most_oil_above, limits.fast_decay, measured);
        // Near null an overlap that is not in the table blocks the flow.
        let near = if opened.abs() < T::splat(NULL_REGION) { one } else { T::splat(0.0) };
        let hidden = envelope(&mut sums.near_null, one - limits.high, near) * limits.null_drift;
        // At most the output of a single high-pass for this flow.
        let [mean, _] = sums.passed_above;
        let through = (passed - mean).abs();
        let hidden = if through < hidden { through } else { hidden };
        if self.fast_velocity {
            let allowed = T::splat(FAST_FLOW) * flow_above;
            let tolerance = allowed + T::splat(OIL) * oil_above + limits.fast_drift + hidden;
            sums.fast.add(self.period * residual_above, self.period * tolerance, limits.fast);
            let tolerance = allowed + limits.fast_drift + T::splat(TURNED_NULL) * hidden;
            let opposed = opposed(measured, measured - residual_above);
            sums.turned.add(self.period * opposed, self.period * tolerance, limits.turned);
            // Both have the same sign, as they should.
            sums.turned.below = T::splat(0.0);
        }
    }
}
