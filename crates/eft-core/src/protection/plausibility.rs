//! Whether the measurements agree with each other, without a second sensor.
//!
//! Three balances, each a residual with a two-sided cumulative sum: the actuator's flow (once as it is, once above the
//! motion's frequencies, where the oil and so the force shows), the velocity against the displacement's derivative, the
//! spool against its command. What a wrong calibration may leave of a balance is taken off before it is summed up.

use crate::channel::Input;
use crate::learning::FlowModel;
use crate::number::Real;
use crate::protection::cause::Cause;
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, SensorGate, Signal, VELOCITY};
use crate::velocity::{FilteredDerivative, FilteredDerivativeState};

/// Share of the flow that a wrong calibration may leave: the self-calibration's bounds, and what the curve adds.
const FLOW: f64 = 0.5;
/// The same above the motion's frequencies, where a wrong curve or gain leaves less in a few milliseconds.
const FAST_FLOW: f64 = 0.2;
/// Share of the oil's flow that a stiffness from 0.6 to 1.5 times the configured one leaves.
const OIL: f64 = 0.6;
/// Share by which velocity and displacement may differ.
const MOTION: f64 = 0.05;
/// Share of the fast residual's limit that counts where the force has left its command.
const ASTRAY: f64 = 0.5;
/// Opening (1) within which an overlap counts.
const NULL_REGION: f64 = 0.03;
/// Share by which spool and command may differ: the bounds of the valve gain, and of the delay at a few hertz.
const VALVE: f64 = 0.3;

/// A plausibility watch's immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plausibility<T: Real, const N: usize> {
    pub(super) model: FlowModel<T, N>,
    pub(super) gate: SensorGate<T>,
    pub(super) derivative: FilteredDerivative<T>,
    pub(super) lost_samples: u32,
    /// Repetitions (1) that look frozen.
    pub(super) repeats: u32,
    /// Whether a sensor measures the velocity.
    pub(super) senses_velocity: bool,
    pub(super) period: T,
    pub(super) rate: T,
    pub(super) area: T,
    /// Leakage and compressibility over the area (m³/s per N, m³ per N).
    pub(super) leakage: T,
    pub(super) oil: T,
    pub(super) valve_gain: T,
    /// Shares of the way in a sample: the residuals' low-pass, high-pass, the valve's lag, the valve's low-pass.
    pub(super) low: T,
    pub(super) high: T,
    pub(super) lag: T,
    pub(super) slow: T,
    /// Shares of the envelopes that stay, of the fast residual and of the others.
    pub(super) fast_decay: T,
    pub(super) decay: T,
    /// What noise and offsets may leave of flow, fast flow (m³/s), motion (m/s) and opening (1), and sums that count.
    pub(super) drift: [T; 4],
    pub(super) limit: [T; 4],
    /// Flow (m³/s) that an overlap of the spool may hide.
    pub(super) null_drift: T,
    /// Difference (N) from the command at which the force has left it.
    pub(super) astray: T,
    /// Changes of force (N) and displacement (m) that a frozen sensor would have shown.
    pub(super) evidence: [T; 2],
}

/// The residuals, in the order of their arrays.
pub(super) const BALANCE: usize = 0;
pub(super) const FAST: usize = 1;
pub(super) const TRAVEL: usize = 2;
pub(super) const STROKE: usize = 3;

/// Two sums, of what is above and what is below.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
struct Sum<T> {
    above: T,
    below: T,
}

impl<T: Real> Sum<T> {
    #[inline(always)]
    fn add(&mut self, residual: T, tolerance: T, limit: T) {
        let zero = T::splat(0.0);
        let most = T::splat(2.0) * limit;
        self.above = (self.above + (residual - tolerance)).limit(zero, most);
        self.below = (self.below - (residual + tolerance)).limit(zero, most);
    }
    #[inline(always)]
    fn size(&self) -> T {
        if self.above > self.below { self.above } else { self.below }
    }
}

/// What a watch remembers. `default()` is a rig at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct PlausibilityState<T> {
    signals: [Signal<T>; 4],
    distrusted: [bool; 4],
    /// Command (N) and displacement (m) when force and velocity last changed.
    marks: [T; 2],
    derivative: FilteredDerivativeState<T>,
    velocity: T,
    flow: T,
    last_velocity: T,
    /// Low-passed: flow of the valve, of piston and leakage, force, velocity, displacement.
    lows: [T; 5],
    /// High-passes of residual, valve's flow and oil's flow.
    highs: [[T; 2]; 3],
    /// The command's way through the valve, and spool and that low-passed.
    valve: [T; 4],
    envelopes: [T; 6],
    /// How close to null the spool has just been (1).
    near_null: T,
    sums: [Sum<T>; 4],
    /// By how much the velocity's flow fits worse than the displacement's (m³/s), averaged.
    worse: T,
    /// Once the force is blamed for a flow balance, in which the velocity counts as well.
    by_balance: bool,
}

/// What else a watch has to know of a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<T> {
    /// Force command (N).
    pub(crate) command: T,
    /// Valve command (V) that stood; NaN where it is not known.
    pub(crate) valve_command: T,
    pub(crate) flow_gain: T,
    pub(crate) valve_gain: T,
    pub(crate) supply: T,
}

#[inline(always)]
fn follow<T: Real>(state: &mut T, share: T, value: T) -> T {
    *state = *state + share * (value - *state);
    *state
}

/// What two first-order high-passes leave.
#[inline(always)]
fn rest<T: Real>([first, second]: &mut [T; 2], share: T, value: T) -> T {
    let once = value - follow(first, share, value);
    once - follow(second, share, once)
}

#[inline(always)]
fn envelope<T: Real>(state: &mut T, decay: T, value: T) -> T {
    let (size, held) = (value.abs(), decay * *state);
    *state = if size > held { size } else { held };
    *state
}

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// The readings, NaN where they are not accepted.
    #[inline(always)]
    pub(crate) fn gate(&self, state: &mut PlausibilityState<T>, input: &Input<T>) -> Input<T> {
        let mut out = *input;
        let readings = [&mut out.force, &mut out.displacement, &mut out.velocity, &mut out.spool];
        let [of_force, far @ ..] = self.gate.jump;
        let [_, _, velocity, _] = &state.signals;
        let of_force = self.gate.jump_of_force(of_force, velocity);
        let [first, second, third] = far;
        let jumps = [of_force, first, second, third];
        let each = state.signals.iter_mut().zip(jumps).zip(self.gate.still).zip(readings);
        for (((signal, jump), still), reading) in each {
            *reading = self.gate.pass(signal, jump, still, *reading);
        }
        out
    }

    /// Takes in a tick's readings behind the [`gate`](Self::gate), and says what contradicts them now.
    #[inline(always)]
    pub(crate) fn judge(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        known: &Known<T>,
    ) -> Cause {
        if input.displacement.is_finite() {
            state.velocity = self.derivative.step(&mut state.derivative, input.displacement);
        }
        self.pass_through_valve(state, known);
        let cause = self.lost(state);
        if cause != Cause::None {
            return cause;
        }
        let valid = input.force.is_finite() & input.spool.is_finite() & velocity.is_finite();
        let unquestioned = !state.distrusted.iter().any(|distrusted| *distrusted);
        if !(valid & input.displacement.is_finite() & unquestioned) {
            return Cause::None;
        }
        self.sum_up(state, input, velocity, known);
        let stuck = self.stuck(state, input, velocity, known.command);
        if stuck != Cause::None {
            return stuck;
        }
        let astray = (known.command - input.force).abs() > self.astray;
        let cause = self.contradiction(state, if astray { ASTRAY } else { 1.0 });
        state.by_balance |= cause == Cause::ForceImplausible;
        cause
    }

    /// The opening that the valve command should have led to.
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

    /// A signal that stays lost.
    #[inline(always)]
    fn lost(&self, state: &PlausibilityState<T>) -> Cause {
        let gone = |n: usize| {
            let (signal, distrusted) = (state.signals.get(n), state.distrusted.get(n));
            match (signal, distrusted) {
                (Some(signal), Some(false)) if signal.lost > self.lost_samples => Some(signal.jumped),
                _ => None,
            }
        };
        match (gone(FORCE), gone(VELOCITY), gone(SPOOL), gone(DISPLACEMENT)) {
            (Some(true), ..) => Cause::ForceImplausible,
            (Some(false), ..) => Cause::ForceLost,
            (_, Some(true), ..) if self.senses_velocity => Cause::VelocityImplausible,
            (_, Some(false), ..) if self.senses_velocity => Cause::VelocityLost,
            (_, _, Some(true), _) => Cause::SpoolImplausible,
            (_, _, Some(false), _) => Cause::SpoolLost,
            (_, _, _, Some(true)) => Cause::DisplacementImplausible,
            (_, _, _, Some(false)) => Cause::DisplacementLost,
            _ => Cause::None,
        }
    }

    /// Takes the residuals of a tick into their sums.
    #[inline(always)]
    fn sum_up(&self, state: &mut PlausibilityState<T>, input: &Input<T>, velocity: T, known: &Known<T>) {
        let half = T::splat(0.5);
        let [valve_low, piston_low, force_low, velocity_low, displacement_low] = &mut state.lows;
        let model = self.model.flow(input.spool, input.spool, input.force, known.supply);
        let flow = known.flow_gain * (model.root * model.at_no_load);
        // The means over the tick, as the differences of force and displacement are.
        let passed = follow(valve_low, self.low, half * (flow + state.flow));
        let speed = half * (velocity + state.last_velocity);
        (state.flow, state.last_velocity) = (flow, velocity);
        let leaked = self.leakage * input.force;
        let taken = follow(piston_low, self.low, self.area * speed + leaked);
        let before = *force_low;
        let oil = self.oil * self.rate * (follow(force_low, self.low, input.force) - before);
        let moved = follow(velocity_low, self.low, speed);
        let before = *displacement_low;
        let travelled = self.rate * (follow(displacement_low, self.low, input.displacement) - before);

        let [of_passed, of_taken, of_fast, of_oil, of_motion, of_valve] = &mut state.envelopes;
        let [drift, fast_drift, motion_drift, valve_drift] = self.drift;
        let [limit, fast_limit, motion_limit, valve_limit] = self.limit;
        let [balance, fast, motion, stroke] = &mut state.sums;
        let share = T::splat(FLOW);

        let residual = taken + oil - passed;
        let larger = |a: T, b: T| if a > b { a } else { b };
        let seen = larger(envelope(of_passed, self.decay, passed), envelope(of_taken, self.decay, taken));
        let tolerance = share * seen + T::splat(OIL) * oil.abs() + drift;
        balance.add(self.period * residual, self.period * tolerance, limit);

        let [of_residual, of_flow, of_force] = &mut state.highs;
        let residual_above = rest(of_residual, self.high, residual);
        let flow_above = envelope(of_fast, self.fast_decay, rest(of_flow, self.high, passed));
        let oil_above = envelope(of_oil, self.fast_decay, rest(of_force, self.high, oil));
        // Near null an overlap that is not in the table hides what passes.
        let near = if input.spool.abs() < T::splat(NULL_REGION) { T::splat(1.0) } else { T::splat(0.0) };
        let hidden = envelope(&mut state.near_null, T::splat(1.0) - self.high, near) * self.null_drift;
        // No more than what a single high-pass leaves of the flow through it.
        let [before, _] = &of_flow;
        let through = (passed - *before).abs();
        let hidden = if through < hidden { through } else { hidden };
        let tolerance = T::splat(FAST_FLOW) * flow_above + T::splat(OIL) * oil_above + fast_drift + hidden;
        if self.senses_velocity {
            fast.add(self.period * residual_above, self.period * tolerance, fast_limit);
            let seen = envelope(of_motion, self.decay, larger(moved.abs(), travelled.abs()));
            let tolerance = T::splat(MOTION) * seen + motion_drift;
            motion.add(self.period * (moved - travelled), self.period * tolerance, motion_limit);
            let other = residual + self.area * (travelled - moved);
            follow(&mut state.worse, self.slow, residual.abs() - other.abs());
        }

        let [_, opening, asked_low, spool_low] = &mut state.valve;
        if known.valve_command.is_finite() {
            follow(asked_low, self.slow, *opening);
            follow(spool_low, self.slow, input.spool);
            let seen = envelope(of_valve, self.decay, larger(asked_low.abs(), spool_low.abs()));
            let tolerance = T::splat(VALVE) * seen + valve_drift;
            stroke.add(self.period * (*spool_low - *asked_low), self.period * tolerance, valve_limit);
        }
    }

    /// A signal whose noise has stopped, or that repeats itself while it should have moved.
    #[inline(always)]
    fn stuck(&self, state: &mut PlausibilityState<T>, input: &Input<T>, velocity: T, command: T) -> Cause {
        let [force, _, speed, _] = &state.signals;
        let [command_then, displacement_then] = &mut state.marks;
        let [force_evidence, motion_evidence] = self.evidence;
        if force.repeats == 0 {
            *command_then = command;
        }
        if speed.repeats == 0 {
            *displacement_then = input.displacement;
        }
        let travelled = input.displacement - *displacement_then;
        let foreseen = T::from_u32(speed.repeats) * self.period * velocity;
        let [of_force, of_displacement, of_velocity, of_spool] =
            state.signals.each_ref().map(|signal| self.gate.is_still(signal));
        if of_force {
            Cause::ForceImplausible
        } else if of_velocity & self.senses_velocity {
            Cause::VelocityImplausible
        } else if of_spool {
            Cause::SpoolImplausible
        } else if of_displacement {
            Cause::DisplacementImplausible
        } else if force.repeats >= self.repeats && (command - *command_then).abs() > force_evidence {
            Cause::ForceImplausible
        } else if self.senses_velocity
            && speed.repeats >= self.repeats
            && (travelled - foreseen).abs() > motion_evidence
        {
            Cause::VelocityImplausible
        } else {
            Cause::None
        }
    }

    /// Which sensor the sums point to.
    #[inline(always)]
    fn contradiction(&self, state: &PlausibilityState<T>, of_force: f64) -> Cause {
        let beyond = |n: usize, share: f64| match (state.sums.get(n), self.limit.get(n)) {
            (Some(sum), Some(limit)) => sum.size() > T::splat(share) * *limit,
            _ => false,
        };
        let frozen = |n: usize| state.signals.get(n).is_some_and(|signal| signal.repeats >= self.repeats);
        let motion = || {
            let displacement = !frozen(VELOCITY) && (frozen(DISPLACEMENT) || state.worse <= T::splat(0.0));
            if displacement { Cause::DisplacementImplausible } else { Cause::VelocityImplausible }
        };
        if beyond(TRAVEL, 1.0) {
            motion()
        } else if beyond(FAST, of_force) {
            if frozen(SPOOL) {
                Cause::SpoolImplausible
            } else if beyond(TRAVEL, 0.5) || frozen(VELOCITY) {
                motion()
            } else {
                Cause::ForceImplausible
            }
        } else if beyond(BALANCE, 1.0) {
            if beyond(TRAVEL, 0.3) {
                motion()
            } else if beyond(STROKE, 0.05) || frozen(SPOOL) {
                Cause::SpoolImplausible
            } else {
                Cause::FlowImplausible
            }
        } else if beyond(STROKE, 1.0) {
            if beyond(BALANCE, 0.1) { Cause::SpoolImplausible } else { Cause::ValveImplausible }
        } else {
            Cause::None
        }
    }
}

impl<T: Real> PlausibilityState<T> {
    /// Believes a sensor no longer.
    #[inline(always)]
    pub(crate) fn distrust(&mut self, cause: Cause) {
        let [force, displacement, velocity, spool] = &mut self.distrusted;
        match cause {
            Cause::ForceLost | Cause::ForceImplausible => *force = true,
            Cause::DisplacementLost | Cause::DisplacementImplausible => *displacement = true,
            Cause::VelocityLost | Cause::VelocityImplausible => *velocity = true,
            Cause::SpoolLost | Cause::SpoolImplausible => *spool = true,
            _ => {}
        }
    }

    /// Whether the reading of the force jumped in this tick.
    #[inline(always)]
    pub(crate) fn force_jumped(&self) -> bool {
        let [force, ..] = &self.signals;
        force.lost > 0 && force.jumped
    }

    /// Whether the force is blamed for a flow balance, in which the velocity counts as well.
    #[inline(always)]
    pub(crate) fn is_by_balance(&self) -> bool {
        self.by_balance
    }

    /// Sensors that are no longer believed, in the order of [`FORCE`] and its siblings.
    #[inline(always)]
    pub(crate) fn distrusted(&self) -> [bool; 4] {
        self.distrusted
    }

    /// The velocity (m/s) that the displacement gives.
    #[inline(always)]
    pub(crate) fn velocity(&self) -> T {
        self.velocity
    }

    /// The spool opening (1) that the valve command gives.
    #[inline(always)]
    pub(crate) fn spool(&self) -> T {
        let [_, opening, ..] = self.valve;
        opening
    }
}
