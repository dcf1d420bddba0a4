//! The plausibility watch: it compares the measurements with each other, without redundant sensors.
//!
//! Three balances have residuals with two-sided cumulative sums. They are the actuator's flow, the velocity compared
//! with the displacement's derivative, and the spool compared with its command. The flow has a second residual above
//! the motion's frequencies, where the oil's flow, and with it the force, has a large part. A dead band for the
//! possible errors of the calibration is subtracted from each residual before the sum. While a single sensor shows the
//! motion, a fourth comparison notices that it or the force has the wrong sign.

mod balance;
mod blame;
mod comparisons;
mod following;
mod load_pressure;
mod missing;
mod motion;
mod null;
mod reversal;
mod state;
mod stroke;
mod sums;
#[cfg(test)]
mod tests;

use crate::cause::Cause;
use crate::integrity::integrity;
use crate::learning::{FlowModel, ModelFlow};
use crate::number::Real;
use crate::protection::gate::SensorGate;
use crate::signals::Input;
use crate::status;
use crate::velocity::FilteredDerivative;
pub(super) use comparisons::{BalanceLimits, Following, MotionLimits, StrokeLimits};
pub(super) use load_pressure::LoadPressureWatch;
pub(super) use reversal::ReversalWatch;
pub(crate) use state::PlausibilityState;

/// Share of the limits that is enough if the force is far from its command.
const ASTRAY: f64 = 0.5;

/// A plausibility watch's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plausibility<T: Real, const N: usize> {
    pub(super) model: FlowModel<T, N>,
    pub(super) gate: SensorGate<T>,
    pub(super) derivative: FilteredDerivative<T>,
    pub(super) lost_samples: u32,
    /// Number of repetitions (1) of a stuck sensor.
    pub(super) repeats: u32,
    /// Whether a sensor measures the velocity.
    pub(super) senses_velocity: bool,
    /// Whether the velocity follows fast motions without the displacement.
    pub(super) fast_velocity: bool,
    pub(super) period: T,
    pub(super) rate: T,
    pub(super) area: T,
    /// Leakage and compressibility over the area (m³/s per N, m³ per N).
    pub(super) leakage: T,
    pub(super) oil: T,
    pub(super) valve_gain: T,
    /// The known null bias (1), from which the valve's flow depends on the spool.
    pub(crate) null_bias: T,
    /// Coefficients (1): the low-pass of the residuals, that of velocity and difference before their ratio is compared, and
    /// that of the spool before it is compared with its command.
    pub(super) low: T,
    pub(super) fine: T,
    pub(super) slow: T,
    /// Share (1) of the envelopes that remains in a sample.
    pub(super) decay: T,
    /// Reciprocal of the velocity (s/m) below which the direction has a smaller weight.
    pub(super) per_reversal: T,
    pub(super) balance: BalanceLimits<T>,
    pub(super) motion: MotionLimits<T>,
    pub(super) stroke: StrokeLimits<T>,
    pub(super) reversal: ReversalWatch<T>,
    pub(super) following: Following<T>,
    /// Change of the force in a sample (N per m/s) by a flow that differs from the motion's, if the velocity is estimated.
    pub(super) kick: T,
    /// Difference (N) at which the force counts as far from its command.
    pub(super) astray: T,
    /// Changes of command (N) and displacement (m) at which a working sensor must have changed.
    pub(super) evidence: [T; 2],
    /// The comparison with the load pressure, if the chamber pressures are measured.
    pub(super) load_pressure: Option<LoadPressureWatch<T>>,
}
integrity!(Plausibility<T, N>: model, gate, derivative, lost_samples, repeats, senses_velocity, fast_velocity, period, rate, area, leakage, oil, valve_gain, null_bias, low, fine, slow, decay, per_reversal, balance, motion, stroke, reversal, following, kick, astray, evidence, load_pressure);

/// Further inputs of a watch in a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<T> {
    /// Force command (N).
    pub(crate) command: T,
    /// Valve command (V) during the last sample; NaN if unknown.
    pub(crate) valve_command: T,
    pub(crate) flow_gain: T,
    pub(crate) valve_gain: T,
    pub(crate) supply: T,
    /// Whether the protection has tripped.
    pub(crate) tripped: bool,
}

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// The readings; NaN if they are not accepted.
    #[inline(always)]
    pub(crate) fn gate(&self, state: &mut PlausibilityState<T>, input: &Input<T>) -> Input<T> {
        let mut out = *input;
        if !self.senses_velocity {
            // Without a sensor the input may have anything.
            out.velocity = T::splat(f64::NAN);
        }
        let readings = [&mut out.force, &mut out.displacement, &mut out.velocity, &mut out.spool];
        let [of_force, far @ ..] = self.gate.jump;
        let [_, displacement, velocity, _] = &state.signals;
        let speed = if self.senses_velocity { velocity.last } else { state.velocity };
        // A velocity that was wrong makes a true force jump, until the valve has followed the other source.
        let of_force = self.gate.jump_of_force(of_force, speed) + self.kick * state.followed.step.abs();
        let [path, second, third] = far;
        let [_, still, ..] = self.gate.still;
        let [_, _, velocity_distrusted, _] = state.distrusted;
        // An estimate of the velocity must not follow it to zero.
        let estimates = !self.senses_velocity | velocity_distrusted;
        let stands = estimates && self.gate.stands(displacement, still, input.displacement);
        let path = if estimates { self.gate.path(displacement, input.displacement) } else { path };
        let path = if stands { T::splat(-1.0) } else { path };
        let jumps = [of_force, path, second, third];
        let each = state.signals.iter_mut().zip(jumps).zip(self.gate.still).zip(readings);
        for (((signal, jump), still), reading) in each {
            *reading = self.gate.pass(signal, jump, still, *reading);
        }
        out
    }

    /// Adds a tick's readings after the [`gate`](Self::gate), and returns what contradicts now.
    #[inline(always)]
    pub(crate) fn judge(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        known: &Known<T>,
    ) -> Cause {
        self.filter(state, input.displacement, velocity);
        self.pass_through_valve(state, known);
        let valid = input.force.is_finite() & input.spool.is_finite();
        let flow = valid.then(|| self.valve_flow(input, known));
        if let Some(flow) = &flow {
            self.move_by_flow(state, [input.force, input.spool], flow, known);
        }
        let astray = (known.command - input.force).abs() > self.astray;
        let reversed = self.reversed(state, astray, known.tripped);
        if reversed != Cause::None {
            return reversed;
        }
        let cause = self.lost(state);
        if cause != Cause::None {
            // A wrong velocity makes a true force jump as well.
            state.by_balance |= cause == Cause::ForceImplausible;
            // Two sensors may share a cable. The second one must not count as a lost measurement.
            state.distrust(cause);
            let second = self.lost(state);
            state.distrust(second);
            return cause;
        }
        // After a trip by a sensor the command is not followed, so that it says nothing about the force.
        let followed = !state.distrusted.contains(&true);
        let command = if followed { known.command } else { T::splat(f64::NAN) };
        let stuck = self.stuck(state, input, velocity, command);
        if stuck != Cause::None {
            return stuck;
        }
        let [force, displacement, others @ ..] = state.distrusted;
        let questioned = force | others.contains(&true);
        // The flows need no displacement.
        let moves = velocity.is_finite() & (input.displacement.is_finite() | displacement);
        let (Some(flow), true, false) = (flow, moves, questioned) else {
            state.motion.goes_on = false;
            self.learn_null_without_force(state, input, known);
            return Cause::None;
        };
        // The evidence about the motion goes on after a failed displacement, in case the velocity was wrong.
        self.sum_up(state, input, velocity, &flow, known);
        // Converted apart, because a choice of doubles would be converted in the tick.
        let share = if astray { T::splat(ASTRAY) } else { T::splat(1.0) };
        let cause = if displacement {
            self.contradiction_by_flow(state, share)
        } else {
            self.contradiction(state, share)
        };
        state.by_balance |= cause == Cause::ForceImplausible;
        cause
    }

    /// Adds a tick to the sums of flow, motion and stroke, and to the missing opening.
    #[inline(always)]
    fn sum_up(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        flow: &ModelFlow<T>,
        known: &Known<T>,
    ) {
        let speed = T::splat(0.5) * (velocity + state.motion.last_velocity);
        state.motion.last_velocity = velocity;
        let residual = self.add_flow(state, input, speed, flow, known);
        let slope = known.flow_gain * (flow.root * flow.slope);
        if input.displacement.is_finite() {
            self.add_motion(state, speed, input.displacement, [residual, slope]);
        } else {
            state.motion.goes_on = false;
        }
        self.add_stroke(state, input.spool, known);
        self.average(state, [residual, slope], input.spool, known);
    }

    /// Compares the force with the load pressure, if that is measured. Returns what contradicts now, and a flag if the
    /// pressure has failed.
    #[inline(always)]
    pub(crate) fn compare_pressure(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        cause: Cause,
    ) -> (Cause, u32) {
        let Some(watch) = &self.load_pressure else { return (cause, 0) };
        let ([force_distrusted, ..], counts) = (state.distrusted, (self.lost_samples, self.repeats));
        let compared = &mut state.load_pressure;
        let readings = [input.force, input.load_pressure];
        let contradicts = !(force_distrusted | compared.failed)
            && watch.contradicts(compared, &self.gate, counts, self.period, readings);
        let flag = if compared.failed { status::STUCK_MEASUREMENT } else { 0 };
        (if contradicts && cause == Cause::None { Cause::ForceImplausible } else { cause }, flag)
    }

    /// The flow through the measured opening.
    #[inline(always)]
    fn valve_flow(&self, input: &Input<T>, known: &Known<T>) -> ModelFlow<T> {
        let opened = input.spool - self.null_bias;
        self.model.flow(opened, opened, input.force, known.supply)
    }
}
