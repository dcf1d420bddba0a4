//! Selection of the distrusted sensor.

use crate::cause::Cause;
use crate::number::Real;
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, Signal, VELOCITY};
use crate::protection::plausibility::{
    AGAINST, BALANCE, FAST, Plausibility, PlausibilityState, RATIO, STROKE, TRAVEL, TURNED,
};
use crate::signals::Input;

/// The displacement is blamed for a ratio only if the velocity fits the flow better, by this share of the mean square of the
/// speed. This is so if one of the two has the wrong sign. Near rest the largest speed is the noise of the displacement.
const CLEARLY: f64 = 0.25;

/// Probability that a working sensor is as still as a frozen one. It is much larger than without a contradiction, because
/// here it only selects the sensor.
const FROZEN: f64 = 0.01;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// A signal that stays lost.
    #[inline(always)]
    pub(super) fn lost(&self, state: &PlausibilityState<T>) -> Cause {
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

    /// Adds a tick to the sums of wrong signs on a rig without a velocity sensor, and returns whether the displacement has the
    /// wrong sign: see [`reversal`](super::reversal).
    #[inline(always)]
    pub(super) fn notices_reversal(
        &self,
        state: &mut PlausibilityState<T>,
        astray: bool,
        tripped: bool,
    ) -> bool {
        let [force, displacement, _, spool] = state.distrusted;
        if self.senses_velocity | force | displacement | spool {
            return false;
        }
        let [valve, oil] = state.by_flow;
        let velocities = [state.derivative.first, valve, oil];
        let unknown = state.missing.unknown();
        let sums = &mut state.reversal;
        let reversed = self.reversal.add(sums, self.period, velocities, unknown, [astray, tripped]);
        if !(reversed && self.spool_follows(state)) {
            return false;
        }
        if state.force_jumped() {
            // A wrong velocity makes a true force jump.
            let [force, ..] = &mut state.signals;
            force.restart();
        }
        true
    }

    /// Whether the spool is on the side of its command, and not frozen.
    #[inline(always)]
    fn spool_follows(&self, state: &PlausibilityState<T>) -> bool {
        let ([.., spool], [_, opening, ..]) = (&state.signals, state.valve);
        let same = (spool.last - self.null_bias) * (opening - self.null_bias) > T::splat(0.0);
        same && !self.is_frozen(spool)
    }

    /// A signal whose noise has stopped, or that repeats although it should have moved.
    #[inline(always)]
    pub(super) fn stuck(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        command: T,
    ) -> Cause {
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
        let [force_distrusted, displacement_distrusted, velocity_distrusted, spool_distrusted] =
            state.distrusted;
        let (trusts_force, measures_velocity) =
            (!force_distrusted, self.senses_velocity & !velocity_distrusted);
        if of_force & trusts_force {
            Cause::ForceImplausible
        } else if of_velocity & measures_velocity {
            Cause::VelocityImplausible
        } else if of_spool & !spool_distrusted {
            Cause::SpoolImplausible
        } else if of_displacement & !displacement_distrusted {
            Cause::DisplacementImplausible
        } else if trusts_force
            && force.repeats >= self.repeats
            && (command - *command_then).abs() > force_evidence
        {
            Cause::ForceImplausible
        } else if measures_velocity
            && speed.repeats >= self.repeats
            && (travelled - foreseen).abs() > motion_evidence
        {
            Cause::VelocityImplausible
        } else {
            Cause::None
        }
    }

    /// The sensor that the sums indicate. If the force is far from its command, a share of the limits is enough, except
    /// for those of flow balance, stroke and the spool's direction.
    #[inline(always)]
    pub(super) fn contradiction(&self, state: &PlausibilityState<T>, share: f64) -> Cause {
        let beyond = |n: usize, share: f64| self.is_beyond(state, n, share);
        let [_, displacement, velocity, spool] = &state.signals;
        if beyond(TRAVEL, share) {
            self.of_motion(state)
        } else if beyond(RATIO, share) {
            self.of_ratio(state)
        } else if beyond(AGAINST, 1.0) {
            Cause::SpoolImplausible
        } else if beyond(TURNED, share) || beyond(FAST, share) {
            if self.is_frozen(spool) {
                Cause::SpoolImplausible
            } else if beyond(TRAVEL, 0.3) || self.is_frozen(velocity) {
                match self.of_motion(state) {
                    // These flows contain the velocity's sensor only: a displacement that moves does not change them.
                    // An estimated velocity contains the displacement.
                    Cause::DisplacementImplausible
                        if self.senses_velocity && !self.is_frozen(displacement) =>
                    {
                        Cause::ForceImplausible
                    }
                    cause => cause,
                }
            } else {
                Cause::ForceImplausible
            }
        } else if beyond(BALANCE, 1.0) {
            if beyond(TRAVEL, 0.3) {
                self.of_motion(state)
            } else if beyond(STROKE, 0.05) || self.is_frozen(spool) {
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

    /// Velocity and displacement move differently.
    #[inline(always)]
    fn of_motion(&self, state: &PlausibilityState<T>) -> Cause {
        let [_, displacement, velocity, _] = &state.signals;
        let of_displacement = !self.is_frozen(velocity)
            && (self.is_frozen(displacement) || state.evidence.is_of_displacement());
        if of_displacement { Cause::DisplacementImplausible } else { Cause::VelocityImplausible }
    }

    /// Whether a reading repeats, or is too still for its noise.
    #[inline(always)]
    fn is_frozen(&self, signal: &Signal<T>) -> bool {
        signal.repeats >= self.repeats || signal.is_stiller(T::splat(FROZEN))
    }

    /// Whether a sum is beyond a share of its limit.
    #[inline(always)]
    pub(super) fn is_beyond(&self, state: &PlausibilityState<T>, of: usize, share: f64) -> bool {
        // What a delay between velocity and displacement may have added.
        let ([.., moved, _], [speed, ..], [of_motion, of_ratio]) = (state.lows, state.fine, &state.began);
        let late = match of {
            TRAVEL => of_motion.allowed(self.late, moved),
            RATIO => of_ratio.allowed(self.late, speed.abs()),
            _ => [T::splat(0.0); 2],
        };
        match (state.sums.get(of), self.limit.get(of)) {
            (Some(sum), Some(limit)) => sum.excess(late) > T::splat(share) * *limit,
            _ => false,
        }
    }

    /// Velocity and displacement differ by a ratio. If the flow does not decide, the larger one is distrusted, because a
    /// velocity that is too small leaves damping.
    #[inline(always)]
    fn of_ratio(&self, state: &PlausibilityState<T>) -> Cause {
        let [.., ratio, _] = &state.sums;
        let told = state.worse < -(T::splat(CLEARLY) * self.area * state.swept);
        if told | (ratio.below > ratio.above) {
            Cause::DisplacementImplausible
        } else {
            Cause::VelocityImplausible
        }
    }
}

#[cfg(test)]
mod tests;
