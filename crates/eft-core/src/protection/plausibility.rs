//! The plausibility watch: it compares the measurements with each other, without redundant sensors.
//!
//! Three balances have residuals with two-sided cumulative sums. They are the actuator's flow, the velocity compared
//! with the displacement's derivative, and the spool compared with its command. The flow has a second residual above
//! the motion's frequencies, where the oil's flow, and with it the force, has a large part. A dead band for the
//! possible errors of the calibration is subtracted from each residual before the sum. While a single sensor shows the
//! motion, a fourth comparison notices that it or the force has the wrong sign. A fifth one notices a force that reads zero.

mod balance;
mod blame;
mod comparisons;
mod following;
mod load_pressure;
mod motion;
mod offset_from_flow;
mod opening_offset;
mod reversal;
mod spool;
mod state;
mod sums;
#[cfg(test)]
mod tests;
mod zero_force;

use crate::cause::Cause;
use crate::integrity::integrity;
use crate::learning::{FlowModel, ModelFlow};
use crate::number::Real;
use crate::protection::gate::SensorGate;
use crate::signals::Input;
use crate::status;
use crate::velocity::FilteredDerivative;
pub(super) use comparisons::{FlowLimits, Following, MotionLimits, SpoolLimits};
pub(super) use load_pressure::LoadPressureWatch;
pub(super) use reversal::ReversalWatch;
pub(crate) use state::PlausibilityState;
pub(super) use zero_force::ZeroForceWatch;

/// Share of the limits that is enough if the force is far from its command.
const FAR_LIMIT_SHARE: f64 = 0.5;
/// Share of the motion's limit from which on the velocity may be wrong.
const NOTICED_MOTION: f64 = 0.3;

/// A plausibility watch's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plausibility<T: Real, const N: usize> {
    pub(super) model: FlowModel<T, N>,
    pub(super) gate: SensorGate<T>,
    pub(super) derivative: FilteredDerivative<T>,
    pub(super) lost_samples: u32,
    /// Number of repetitions (1) of a stuck sensor.
    pub(super) repeats: u32,
    /// Ticks between two displacements in which the velocity goes on.
    pub(super) short_gap: u32,
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
    /// Coefficients (1): the low-pass of the residuals, that of velocity and difference before their ratio is compared,
    /// and that of the spool before it is compared with its command.
    pub(super) low_gain: T,
    pub(super) ratio_gain: T,
    pub(super) spool_gain: T,
    /// Share (1) of the envelopes that remains in a sample.
    pub(super) decay: T,
    /// Reciprocal of the velocity (s/m) below which the direction has a smaller weight.
    pub(super) per_reversal: T,
    pub(super) balance: FlowLimits<T>,
    pub(super) motion: MotionLimits<T>,
    pub(super) stroke: SpoolLimits<T>,
    pub(super) reversal: ReversalWatch<T>,
    pub(super) zero_force: ZeroForceWatch<T>,
    pub(super) following: Following<T>,
    /// Change of the force in a sample (N per m/s) by a flow that differs from the motion's, if the velocity is
    /// estimated.
    pub(super) force_jump: T,
    /// Difference (N) at which the force counts as far from its command.
    pub(super) force_error_limit: T,
    /// Changes of command (N) and displacement (m) at which a working sensor must have changed.
    pub(super) changes: [T; 2],
    /// The comparison with the load pressure, if the chamber pressures are measured.
    pub(super) load_pressure: Option<LoadPressureWatch<T>>,
}
integrity!(
    Plausibility<T, N>: model, gate, derivative, lost_samples, repeats, short_gap, senses_velocity, fast_velocity, period,
    rate, area, leakage, oil, valve_gain, null_bias, low_gain, ratio_gain, spool_gain, decay, per_reversal, balance, motion,
    stroke, reversal, zero_force, following, force_jump, force_error_limit, changes, load_pressure
);

/// Further inputs of a watch in a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Control<T> {
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
        let [force_tolerance, displacement_tolerance, velocity_tolerance, spool_tolerance] =
            self.gate.tolerance;
        let [_, displacement, velocity, _] = &state.signals;
        let speed = if self.senses_velocity { velocity.last } else { state.velocity };
        // A velocity that was wrong makes a true force jump, until the valve has followed the other source.
        let force_tolerance =
            self.gate.force_tolerance(force_tolerance, speed) + self.force_jump * state.followed.step.abs();
        let [_, still_change, ..] = self.gate.still_change;
        let [_, _, velocity_distrusted, _] = state.distrusted;
        // An estimate of the velocity must not follow it to zero.
        let estimates = !self.senses_velocity | velocity_distrusted;
        let stuck = estimates && self.gate.is_stuck(displacement, still_change, input.displacement);
        let tolerance = if estimates {
            self.gate.estimated_tolerance(displacement, input.displacement)
        } else {
            displacement_tolerance
        };
        let displacement_tolerance = if stuck { T::splat(-1.0) } else { tolerance };
        let tolerances = [force_tolerance, displacement_tolerance, velocity_tolerance, spool_tolerance];
        let each = state.signals.iter_mut().zip(tolerances).zip(self.gate.still_change).zip(readings);
        for (((signal, tolerance), still_change), reading) in each {
            *reading = self.gate.accept(signal, tolerance, still_change, *reading);
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
        control: &Control<T>,
    ) -> Cause {
        self.filter(state, input.displacement, velocity);
        self.model_valve(state, control);
        let valid = input.force.is_finite() & input.spool.is_finite();
        let flow = valid.then(|| self.valve_flow(input, control));
        if let Some(flow) = &flow {
            self.update_flow_velocity(state, [input.force, input.spool], flow, control);
        }
        let large_error = (control.command - input.force).abs() > self.force_error_limit;
        let cause = self.wrong_sign_cause(state, large_error, control.tripped);
        if cause != Cause::None {
            return cause;
        }
        let cause = self.lost_sensor(state);
        if cause != Cause::None {
            // A wrong velocity makes a true force jump as well.
            state.balance_blame |= cause == Cause::ForceImplausible;
            // Two sensors may share a cable. The second one must not count as a lost measurement.
            state.distrust(cause);
            let second = self.lost_sensor(state);
            state.distrust(second);
            return cause;
        }
        // After a trip by a sensor the command is not followed, so that it says nothing about the force.
        let followed = !state.distrusted.contains(&true);
        let command = if followed { control.command } else { T::splat(f64::NAN) };
        let stuck = self.stuck_sensor(state, input, velocity, command);
        if stuck != Cause::None {
            return stuck;
        }
        let [force, displacement, others @ ..] = state.distrusted;
        let sensor_distrusted = force | others.contains(&true);
        // The flows need no displacement.
        let has_motion = velocity.is_finite() & (input.displacement.is_finite() | displacement);
        let (Some(flow), true, false) = (flow, has_motion, sensor_distrusted) else {
            state.motion.miss();
            self.learn_null_without_force(state, input, control);
            return Cause::None;
        };
        // The evidence about the motion goes on after a failed displacement, in case the velocity was wrong.
        self.compare(state, input, velocity, &flow, control);
        // Converted apart, because a choice of doubles would be converted in the tick.
        let share = if large_error { T::splat(FAR_LIMIT_SHARE) } else { T::splat(1.0) };
        let cause = if displacement {
            self.contradiction_by_flow(state, share)
        } else {
            match self.contradiction(state, share) {
                // The flow that contradicts the force is that of the spool's reading. After a trip the valve may swing
                // wider than its model holds for.
                Cause::ForceImplausible if !control.tripped && self.spool_departs(state, control) => {
                    Cause::SpoolImplausible
                }
                cause => cause,
            }
        };
        state.balance_blame |= cause == Cause::ForceImplausible;
        let readings = [control.command, state.balance.force, state.motion.displacement];
        let reads_zero =
            self.zero_force.contradicts(&mut state.zero_force, readings, [self.low_gain, self.period]);
        // A wrong velocity brings the true force near zero.
        let wrong_velocity = || self.travels_beyond(state, T::splat(NOTICED_MOTION));
        if reads_zero && cause == Cause::None && !control.tripped && !wrong_velocity() {
            return Cause::ForceImplausible;
        }
        cause
    }

    /// Adds a tick to the sums of flow, motion and spool, and to the opening offset.
    #[inline(always)]
    fn compare(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        flow: &ModelFlow<T>,
        control: &Control<T>,
    ) {
        let speed = T::splat(0.5) * (velocity + state.motion.last_velocity);
        state.motion.last_velocity = velocity;
        let residual = self.add_flow(state, input, speed, flow, control);
        let slope = control.flow_gain * (flow.root * flow.slope);
        if input.displacement.is_finite() {
            self.compare_motion(state, speed, input.displacement, [residual, slope]);
        } else {
            state.motion.miss();
        }
        self.compare_spool(state, input.spool, control);
        self.average_offset(state, [residual, slope], input.spool, control);
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
    fn valve_flow(&self, input: &Input<T>, control: &Control<T>) -> ModelFlow<T> {
        let opened = input.spool - self.null_bias;
        self.model.flow(opened, opened, input.force, control.supply)
    }
}
