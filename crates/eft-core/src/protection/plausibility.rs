//! The plausibility watch: it compares the measurements with each other, without redundant sensors.
//!
//! Three balances have residuals with two-sided cumulative sums. They are the actuator's flow, the velocity compared
//! with the displacement's derivative, and the spool compared with its command. The flow has a second residual above
//! the motion's frequencies, where the oil's flow, and with it the force, has a large part. A dead band for the
//! possible errors of the calibration is subtracted from each residual before the sum. Without a velocity sensor a fourth
//! comparison notices a displacement of the wrong sign.

mod blame;
mod load_pressure;
mod null;
mod residuals;
mod reversal;
mod state;
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
pub(super) use load_pressure::LoadPressureWatch;
pub(super) use reversal::ReversalWatch;
pub(crate) use state::PlausibilityState;
use sums::follow;

/// Share of the limits that is enough if the force is far from its command.
const ASTRAY: f64 = 0.5;
/// Time (s) in which the low-passes settle to 2 %. The fast balance begins then.
const SETTLED: f64 = 8.0e-3;

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
    /// Coefficients (1): the residuals' low-pass and high-pass, the valve's lag, the valve's low-pass.
    pub(super) low: T,
    pub(super) high: T,
    pub(super) lag: T,
    pub(super) slow: T,
    /// Shares of the envelopes that remain in a sample, for the fast residual and for the others.
    pub(super) fast_decay: T,
    pub(super) decay: T,
    /// Residuals by noise and offsets, of flow and fast flow (m³/s), motion (m/s), opening and its direction (1), and ratio
    /// (m/s). Limits of the sums.
    pub(super) drift: [T; 6],
    pub(super) limit: [T; 7],
    /// Largest time (s) between velocity and displacement.
    pub(super) late: T,
    /// Coefficient (1) of the low-pass of velocity and difference, before their ratio is compared.
    pub(super) fine: T,
    /// The same of the velocity by the flow balance.
    pub(super) moved: T,
    pub(super) reversal: ReversalWatch<T>,
    /// Change of the force in a sample (N per m/s) by a flow that differs from the motion's, if the velocity is estimated.
    pub(super) kick: T,
    /// Reciprocal of the velocity (s/m) below which the direction has a smaller weight.
    pub(super) per_reversal: T,
    /// Share (1) of the step between two sources of the velocity that remains after a sample.
    pub(super) fade: T,
    /// The brake's largest force (N), and the reciprocal of the velocity (s/m) from which on it has this force.
    pub(super) brake: [T; 2],
    /// Flow (m³/s) that an overlap of the spool may block.
    pub(super) null_drift: T,
    /// Difference (N) at which the force counts as far from its command.
    pub(super) astray: T,
    /// Changes of command (N) and displacement (m) at which a working sensor must have changed.
    pub(super) evidence: [T; 2],
    /// The comparison with the load pressure, if the chamber pressures are measured.
    pub(super) load_pressure: Option<LoadPressureWatch<T>>,
}
integrity!(Plausibility<T, N>: model, gate, derivative, lost_samples, repeats, senses_velocity, fast_velocity, period, rate, area, leakage, oil, valve_gain, null_bias, low, high, lag, slow, fast_decay, decay, drift, limit, late, fine, moved, reversal, kick, per_reversal, fade, brake, null_drift, astray, evidence, load_pressure);

/// The residuals, in the order of their arrays: flow, fast flow, motion, stroke, force's direction, motion's ratio,
/// spool's direction.
pub(super) const BALANCE: usize = 0;
pub(super) const FAST: usize = 1;
pub(super) const TRAVEL: usize = 2;
pub(super) const STROKE: usize = 3;
pub(super) const TURNED: usize = 4;
pub(super) const RATIO: usize = 5;
pub(super) const AGAINST: usize = 6;

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
        let of_force = self.gate.jump_of_force(of_force, speed) + self.kick * state.step.abs();
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
        if input.displacement.is_finite() {
            if !state.has_displacement {
                // The displacement before the first sample is unknown.
                state.derivative = self.derivative.at_rest(input.displacement);
                state.has_displacement = true;
            }
            state.velocity = self.derivative.step(&mut state.derivative, input.displacement);
        }
        if velocity.is_finite() {
            let [first, second] = &mut state.smooth;
            let once = follow(first, self.low, velocity);
            follow(second, self.low, once);
        }
        self.pass_through_valve(state, known);
        let valid = input.force.is_finite() & input.spool.is_finite();
        let flow = valid.then(|| self.valve_flow(input, known));
        if let Some(flow) = &flow {
            self.move_by_flow(state, [input.force, input.spool], flow, known);
        }
        let astray = (known.command - input.force).abs() > self.astray;
        if self.notices_reversal(state, astray, known.tripped) {
            return Cause::DisplacementImplausible;
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
        let (Some(flow), true, false) =
            (flow, velocity.is_finite() & input.displacement.is_finite(), questioned)
        else {
            state.goes_on = false;
            self.learn_null_without_force(state, input, known);
            return Cause::None;
        };
        self.sum_up(state, input, velocity, &flow, known);
        if displacement {
            // The evidence about the motion goes on, in case the velocity was wrong.
            return Cause::None;
        }
        let cause = self.contradiction(state, if astray { ASTRAY } else { 1.0 });
        state.by_balance |= cause == Cause::ForceImplausible;
        cause
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

    /// The velocity (m/s) to follow. After a change of its source the step between the two fades in the valve's delay,
    /// because the lead network would respond to the step with a peak of the valve command.
    #[inline(always)]
    pub(crate) fn bridge(&self, state: &mut PlausibilityState<T>, velocity: T, source: u32) -> T {
        if !velocity.is_finite() {
            return velocity;
        }
        if source != state.source {
            (state.source, state.step) = (source, state.followed - velocity);
        }
        state.step = self.fade * state.step;
        state.followed = velocity + state.step;
        state.followed
    }

    /// The velocity (m/s) to follow if that of the sensor may be wrong. It is the displacement's derivative, with what the
    /// derivative's low-passes remove: the sensor's share above their corner, in the direction in which the two agree.
    #[inline(always)]
    pub(crate) fn agreed(&self, state: &PlausibilityState<T>, velocity: T) -> T {
        let ([_, smooth], slow, one) = (state.smooth, state.velocity, T::splat(1.0));
        let [_, _, distrusted, _] = state.distrusted;
        if distrusted | !velocity.is_finite() {
            return slow;
        }
        let direction = |velocity: T| (self.per_reversal * velocity).limit(-one, one);
        slow + direction(slow) * direction(smooth) * (velocity - smooth)
    }

    /// The force (N) of the brake at a share (1) of it, in the direction of the velocity. It acts against the motion, as
    /// friction does. A low-pass keeps the oil column's oscillation out of it.
    #[inline(always)]
    pub(crate) fn brake(&self, state: &mut PlausibilityState<T>, velocity: T, share: T) -> T {
        if velocity.is_finite() {
            follow(&mut state.braked, self.fine, velocity);
        }
        let [force, per_velocity] = self.brake;
        let one = T::splat(1.0);
        share * force * (per_velocity * state.braked).limit(-one, one)
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

    /// Whether the piston has hardly moved of late, so that there is no motion to follow.
    #[inline(always)]
    pub(crate) fn rests(&self, state: &PlausibilityState<T>) -> bool {
        let [.., of_motion, _] = state.envelopes;
        self.per_reversal * of_motion < T::splat(1.0)
    }

    /// The flow through the measured opening.
    #[inline(always)]
    fn valve_flow(&self, input: &Input<T>, known: &Known<T>) -> ModelFlow<T> {
        let opened = input.spool - self.null_bias;
        self.model.flow(opened, opened, input.force, known.supply)
    }

    /// Adds a tick to the velocity by the flow balance. The oil's flow belongs to it: without it the piston would seem to
    /// follow the valve, and the compensation would follow itself.
    #[inline(always)]
    fn move_by_flow(
        &self,
        state: &mut PlausibilityState<T>,
        [force, spool]: [T; 2],
        flow: &ModelFlow<T>,
        known: &Known<T>,
    ) {
        // The force before the first sample is unknown.
        let before = if state.has_force { state.last_force } else { force };
        let oil = self.oil * self.rate * (force - before);
        let missing = state.missing.at(spool - self.null_bias);
        let passed = known.flow_gain * (flow.root * (flow.at_no_load + flow.slope * missing));
        let [valve, pressure] = &mut state.by_flow;
        follow(valve, self.moved, (passed - self.leakage * force) / self.area);
        follow(pressure, self.moved, oil / self.area);
        (state.last_force, state.has_force) = (force, true);
    }

    /// The opening that should follow from the valve command.
    #[inline(always)]
    fn pass_through_valve(&self, state: &mut PlausibilityState<T>, known: &Known<T>) {
        if known.valve_command.is_finite() {
            let one = T::splat(1.0);
            let asked = (known.valve_gain * self.valve_gain * known.valve_command).limit(-one, one);
            let [first, opening, ..] = &mut state.valve;
            let asked = follow(first, self.lag, asked);
            follow(opening, self.lag, asked);
        }
    }
}
