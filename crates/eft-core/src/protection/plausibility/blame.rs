//! Selection of the distrusted sensor.

use crate::cause::Cause;
use crate::number::Real;
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, Signal, VELOCITY};
use crate::protection::plausibility::comparisons::Motion;
use crate::protection::plausibility::reversal::Wrong;
use crate::protection::plausibility::{Plausibility, PlausibilityState};
use crate::signals::Input;

/// The displacement is blamed for a ratio only if the velocity fits the flow better, by this share of the mean square of the
/// speed. This is so if one of the two has the wrong sign. Near rest the largest speed is the noise of the displacement.
const CLEARLY: f64 = 0.25;

/// Probability that a working sensor is as still as a frozen one. It is much larger than without a contradiction, because
/// here it only selects the sensor.
const FROZEN: f64 = 0.01;
/// Share of the limit of a motion against the command from which on the spool may be wrong.
const AGAINST: f64 = 0.1;

/// The cause of a wrong sign, if a sensor shows the motion.
#[inline(always)]
fn of_sign(wrong: Option<Wrong>, sensor: usize) -> Cause {
    match wrong {
        None => Cause::None,
        Some(Wrong::Force) => Cause::ForceImplausible,
        Some(Wrong::Motion) if sensor == VELOCITY => Cause::VelocityImplausible,
        Some(Wrong::Motion) => Cause::DisplacementImplausible,
    }
}

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

    /// Adds a tick to the sums of wrong signs while a single sensor shows the motion, and returns the sensor that has
    /// one: see [`reversal`](super::reversal).
    #[inline(always)]
    pub(super) fn reversed(&self, state: &mut PlausibilityState<T>, astray: bool, tripped: bool) -> Cause {
        let [force, _, _, spool] = state.distrusted;
        let Some((sensor, moved)) = self.only_motion(state) else { return Cause::None };
        // A spool of wrong sign reverses the valve's flow.
        if force | spool || !self.spool_follows(state) {
            return Cause::None;
        }
        let velocities = [moved, state.by_flow.valve, state.by_flow.oil];
        let unknown = state.missing.unknown();
        let sums = &mut state.reversal;
        let wrong = self.reversal.add(sums, self.period, velocities, unknown, [astray, tripped]);
        let frozen = || state.signals.get(sensor).is_some_and(|shown| self.is_frozen(shown));
        if wrong == Some(Wrong::Force) && frozen() {
            // A frozen sensor shows no motion, so that all of the valve's flow seems to be the oil's.
            return Cause::None;
        }
        if wrong == Some(Wrong::Motion) && state.force_jumped() {
            // A wrong velocity makes a true force jump.
            let [force, ..] = &mut state.signals;
            force.restart();
        }
        of_sign(wrong, sensor)
    }

    /// The sensor that shows the motion, and its velocity (m/s), unless there are two or none.
    #[inline(always)]
    fn only_motion(&self, state: &PlausibilityState<T>) -> Option<(usize, T)> {
        let ([_, displacement, velocity, _], [smooth, _]) = (state.distrusted, state.smooth);
        match (self.senses_velocity, displacement, velocity) {
            (true, true, false) => Some((VELOCITY, smooth)),
            (false, false, _) => Some((DISPLACEMENT, state.derivative.first)),
            _ => None,
        }
    }

    /// The sensor that is indicated after the displacement has failed: a spool that moves against its command, or velocity or
    /// force if a share of the fast flows' limits is exceeded. The sums of wrong signs select one of these two.
    #[inline(always)]
    pub(super) fn contradiction_by_flow(&self, state: &PlausibilityState<T>, share: T) -> Cause {
        let (balance, limits) = (&state.balance, &self.balance);
        let beyond =
            balance.turned.is_beyond(limits.turned, share) || balance.fast.is_beyond(limits.fast, share);
        match self.only_motion(state) {
            _ if state.stroke.against.is_beyond(self.stroke.against, T::splat(1.0)) => {
                Cause::SpoolImplausible
            }
            Some((sensor, _)) if beyond && self.spool_follows(state) => {
                of_sign(state.reversal.larger(), sensor)
            }
            _ => Cause::None,
        }
    }

    /// Whether the spool is on the side of its command, has not moved against it of late, and is not frozen.
    #[inline(always)]
    fn spool_follows(&self, state: &PlausibilityState<T>) -> bool {
        let ([.., spool], stroke) = (&state.signals, &state.stroke);
        let same = (spool.last - self.null_bias) * (stroke.opening - self.null_bias) > T::splat(0.0);
        same && !stroke.against.is_beyond(self.stroke.against, T::splat(AGAINST)) && !self.is_frozen(spool)
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
    pub(super) fn contradiction(&self, state: &PlausibilityState<T>, share: T) -> Cause {
        let (balance, stroke) = (&state.balance, &state.stroke);
        let slow = |share| balance.slow.is_beyond(self.balance.slow, T::splat(share));
        let fast = || balance.fast.is_beyond(self.balance.fast, share);
        let turned = || balance.turned.is_beyond(self.balance.turned, share);
        let differs = |share| stroke.difference.is_beyond(self.stroke.difference, T::splat(share));
        let [_, displacement, velocity, spool] = &state.signals;
        if self.travels_beyond(state, share) {
            self.of_motion(state)
        } else if self.ratio_is_beyond(state, share) {
            self.of_ratio(state)
        } else if stroke.against.is_beyond(self.stroke.against, T::splat(1.0)) {
            Cause::SpoolImplausible
        } else if turned() || fast() {
            if self.is_frozen(spool) {
                Cause::SpoolImplausible
            } else if self.travels_beyond(state, T::splat(0.3)) || self.is_frozen(velocity) {
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
        } else if slow(1.0) {
            if self.travels_beyond(state, T::splat(0.3)) {
                self.of_motion(state)
            } else if differs(0.05) || self.is_frozen(spool) {
                Cause::SpoolImplausible
            } else {
                Cause::FlowImplausible
            }
        } else if differs(1.0) {
            if slow(0.1) { Cause::SpoolImplausible } else { Cause::ValveImplausible }
        } else {
            Cause::None
        }
    }

    /// Velocity and displacement move differently.
    #[inline(always)]
    fn of_motion(&self, state: &PlausibilityState<T>) -> Cause {
        let [_, displacement, velocity, _] = &state.signals;
        let of_displacement = !self.is_frozen(velocity)
            && (self.is_frozen(displacement) || state.motion.evidence.is_of_displacement());
        if of_displacement { Cause::DisplacementImplausible } else { Cause::VelocityImplausible }
    }

    /// Whether a reading repeats, or is too still for its noise.
    #[inline(always)]
    fn is_frozen(&self, signal: &Signal<T>) -> bool {
        signal.repeats >= self.repeats || signal.is_stiller(T::splat(FROZEN))
    }

    /// Velocity and displacement differ by a ratio. If the flow does not decide, the larger one is distrusted, because a
    /// velocity that is too small leaves damping.
    #[inline(always)]
    fn of_ratio(&self, state: &PlausibilityState<T>) -> Cause {
        let Motion { ratio, worse, swept, .. } = &state.motion;
        let told = *worse < -(T::splat(CLEARLY) * self.area * *swept);
        if told | (ratio.below > ratio.above) {
            Cause::DisplacementImplausible
        } else {
            Cause::VelocityImplausible
        }
    }
}

#[cfg(test)]
mod tests;
