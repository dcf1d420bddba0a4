//! The residuals of the balances, and their sums.

use crate::learning::ModelFlow;
use crate::number::Real;
use crate::protection::plausibility::sums::{envelope, follow, rest};
use crate::protection::plausibility::{Known, Plausibility, PlausibilityState, SETTLED};
use crate::signals::Input;

/// Share of the flow that a wrong calibration may leave, from the bounds of the self-calibration and the curve's error.
const FLOW: f64 = 0.5;
/// The same above the motion's frequencies, where a wrong curve or gain leaves a smaller residual in a few
/// milliseconds.
const FAST_FLOW: f64 = 0.2;
/// Share of the oil's flow that a stiffness from 0.6 to 1.5 times the configured one leaves.
const OIL: f64 = 0.6;
/// Share by which velocity and displacement may differ.
const MOTION: f64 = 0.05;
/// Share by which the gains of two sound sensors differ: 2 % each.
const SOUND: f64 = 0.04;
/// Share of the motion's limit below which its sum may be noise.
const DIFFERS: f64 = 0.15;
/// Opening (1) within which an overlap counts.
const NULL_REGION: f64 = 0.03;
/// Share of an overlap's flow that counts against a force of the wrong sign: see [`Plausibility::turned`].
const TURNED_NULL: f64 = 0.25;
/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
const VALVE: f64 = 0.3;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds the residuals of a tick to their sums.
    #[inline(always)]
    pub(super) fn sum_up(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        model: &ModelFlow<T>,
        known: &Known<T>,
    ) {
        let half = T::splat(0.5);
        let [valve_low, piston_low, force_low, velocity_low, displacement_low] = &mut state.lows;
        let opened = input.spool - self.null_bias;
        let flow = known.flow_gain * (model.root * model.at_no_load);
        // The means over the tick, as for the differences of force and displacement.
        let passed = follow(valve_low, self.low, half * (flow + state.flow));
        let speed = half * (velocity + state.last_velocity);
        (state.flow, state.last_velocity) = (flow, velocity);
        if !(state.age > T::splat(0.0)) {
            // The force before the first sample is unknown.
            *force_low = input.force;
        }
        let settles = state.age < T::splat(SETTLED);
        if settles {
            state.age = state.age + self.period;
        }
        let leaked = self.leakage * input.force;
        let taken = follow(piston_low, self.low, self.area * speed + leaked);
        let before = *force_low;
        let oil = self.oil * self.rate * (follow(force_low, self.low, input.force) - before);
        let moved = follow(velocity_low, self.low, speed);
        if !state.goes_on {
            // For the motion before the first sample, or during lost samples, there is no velocity.
            let travelled = input.displacement - state.displacement - self.period * speed;
            *displacement_low = *displacement_low + travelled;
        }
        (state.displacement, state.goes_on) = (input.displacement, true);
        let before = *displacement_low;
        let travelled = self.rate * (follow(displacement_low, self.low, input.displacement) - before);

        let [of_passed, of_taken, of_fast, of_oil, of_motion, of_valve] = &mut state.envelopes;
        let [drift, fast_drift, motion_drift, valve_drift, against_drift, ratio_drift] = self.drift;
        let [limit, fast_limit, motion_limit, valve_limit, turned_limit, ratio_limit, against_limit] =
            self.limit;
        let [balance, fast, motion, stroke, turned, ratio, against] = &mut state.sums;
        let share = T::splat(FLOW);

        let residual = taken + oil - passed;
        let slope = known.flow_gain * (model.root * model.slope);
        let larger = |a: T, b: T| if a > b { a } else { b };
        let seen = larger(envelope(of_passed, self.decay, passed), envelope(of_taken, self.decay, taken));
        let tolerance = share * seen + T::splat(OIL) * oil.abs() + drift;
        balance.add(self.period * residual, self.period * tolerance, limit);

        let [of_residual, of_flow, of_force] = &mut state.highs;
        // A null bias leaves a constant residual. Until the low-passes have settled, the high-passes take all of it for
        // their mean, so that its beginning is no step.
        let high = if settles { T::splat(1.0) } else { self.high };
        let residual_above = rest(of_residual, high, residual);
        let flow_above = envelope(of_fast, self.fast_decay, rest(of_flow, high, passed));
        let measured = rest(of_force, high, oil);
        let oil_above = envelope(of_oil, self.fast_decay, measured);
        // Near null an overlap that is not in the table blocks the flow.
        let near = if opened.abs() < T::splat(NULL_REGION) { T::splat(1.0) } else { T::splat(0.0) };
        let hidden = envelope(&mut state.near_null, T::splat(1.0) - self.high, near) * self.null_drift;
        // At most the output of a single high-pass for this flow.
        let [before, _] = &of_flow;
        let through = (passed - *before).abs();
        let hidden = if through < hidden { through } else { hidden };
        let tolerance = T::splat(FAST_FLOW) * flow_above + T::splat(OIL) * oil_above + fast_drift + hidden;
        let seen = envelope(of_motion, self.decay, larger(moved.abs(), travelled.abs()));
        if self.fast_velocity {
            fast.add(self.period * residual_above, self.period * tolerance, fast_limit);
            let tolerance = T::splat(FAST_FLOW) * flow_above + fast_drift + T::splat(TURNED_NULL) * hidden;
            let opposed = opposed(measured, measured - residual_above);
            turned.add(self.period * opposed, self.period * tolerance, turned_limit);
            // Both have the same sign, as they should.
            turned.below = T::splat(0.0);
        }
        if self.senses_velocity {
            let off = moved - travelled;
            let tolerance = T::splat(MOTION) * seen + motion_drift;
            let [motion_began, ratio_began] = &mut state.began;
            let change = [self.period * off, self.period * tolerance, motion_limit];
            motion_began.add(motion, change, [self.late, moved]);
            let [speed_low, off_low, residual_low] = &mut state.fine;
            let (speed, off) = (follow(speed_low, self.fine, moved), follow(off_low, self.fine, off));
            // In a slow motion a null bias leaves more than a wrong sign.
            let unbalanced = follow(residual_low, self.fine, residual - slope * state.missing.null_bias());
            // A velocity that is too large in either direction.
            let one = T::splat(1.0);
            let beyond = off * (self.per_reversal * speed).limit(-one, one);
            // In the direction of the motion a delay adds itself times the change of the velocity's size.
            // The rest of the share is a drift as well, and larger than that against noise in a fast motion.
            let size = speed.abs();
            let tolerance = larger(T::splat(MOTION) * size, T::splat(SOUND) * size + ratio_drift);
            let change = [self.period * beyond, self.period * tolerance, ratio_limit];
            ratio_began.add(ratio, change, [self.late, speed.abs()]);
            let differs = motion.size() > T::splat(DIFFERS) * motion_limit;
            state.evidence.add(differs, off, unbalanced, self.area);
            // The flow's residual vanishes with the correct one of the two.
            let worse = off * (unbalanced - half * (self.area * off));
            follow(&mut state.worse, self.slow, worse);
            let faster = larger(size, (speed - off).abs());
            follow(&mut state.swept, self.slow, faster * faster);
        }

        let [_, opening, asked_low, spool_low, asked_slow, spool_slow] = &mut state.valve;
        if known.valve_command.is_finite() {
            follow(asked_low, self.slow, *opening);
            follow(spool_low, self.slow, input.spool);
            let seen = envelope(of_valve, self.decay, larger(asked_low.abs(), spool_low.abs()));
            let tolerance = T::splat(VALVE) * seen + valve_drift;
            stroke.add(self.period * (*spool_low - *asked_low), self.period * tolerance, valve_limit);
            // A null bias is no part of the swings about their means.
            let asked = *asked_low - follow(asked_slow, self.slow, *asked_low);
            let moved = *spool_low - follow(spool_slow, self.slow, *spool_low);
            against.add(self.period * opposed(asked, moved), self.period * against_drift, against_limit);
            against.below = T::splat(0.0);
        }
        self.average(state, [residual, slope], input.spool, known);
    }

    /// Adds the opening by a residual of the flow (m³/s), at this slope of the flow curve (m³/s) and spool opening (1), to the
    /// missing opening. A spool that is not where its command leads says nothing about the valve.
    #[inline(always)]
    fn average(
        &self,
        state: &mut PlausibilityState<T>,
        [residual, slope]: [T; 2],
        spool: T,
        known: &Known<T>,
    ) {
        let ([_, led, ..], [_, _, _, drift, ..]) = (state.valve, self.drift);
        let larger = if spool.abs() > led.abs() { spool.abs() } else { led.abs() };
        let follows = (spool - led).abs() <= T::splat(VALVE) * larger + drift;
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
}

/// The opposition of two signals: the smaller of their sizes, negative if they have the same sign.
#[inline(always)]
fn opposed<T: Real>(a: T, b: T) -> T {
    let (first, second) = (a.abs(), b.abs());
    let size = if first < second { first } else { second };
    if a * b < T::splat(0.0) { size } else { -size }
}

#[cfg(test)]
mod tests;
