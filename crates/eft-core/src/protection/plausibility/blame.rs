//! Selection of the distrusted sensor.

use crate::cause::Cause;
use crate::number::Real;
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, Signal, VELOCITY};
use crate::protection::plausibility::comparisons::MotionSums;
use crate::protection::plausibility::reversal::WrongSign;
use crate::protection::plausibility::{NOTICED_MOTION, Plausibility, PlausibilityState};
use crate::signals::Input;

/// The displacement is blamed for a ratio only if the velocity fits the flow better, by this share of the mean square
/// of the speed. This is so if one of the two has the wrong sign. Near rest the largest speed is the noise of the
/// displacement.
const CLEAR_SHARE: f64 = 0.25;

/// Probability that a working sensor is as still as a frozen one. It is much larger than without a contradiction,
/// because here it only selects the sensor.
const FROZEN_PROBABILITY: f64 = 0.01;
/// Share of the limit of a motion against the command from which on the spool may be wrong.
const OPPOSED: f64 = 0.1;

/// The cause of a wrong sign, if a sensor shows the motion.
#[inline(always)]
fn sign_cause(wrong: Option<WrongSign>, sensor: usize) -> Cause {
    match wrong {
        None => Cause::None,
        Some(WrongSign::Force) => Cause::ForceImplausible,
        Some(WrongSign::Motion) if sensor == VELOCITY => Cause::VelocityImplausible,
        Some(WrongSign::Motion) => Cause::DisplacementImplausible,
    }
}

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// A signal that stays lost.
    #[inline(always)]
    pub(super) fn lost_sensor(&self, state: &PlausibilityState<T>) -> Cause {
        let lost_signal = |n: usize| {
            let (signal, distrusted) = (state.signals.get(n), state.distrusted.get(n));
            match (signal, distrusted) {
                (Some(signal), Some(false)) if signal.lost > self.lost_samples => Some(signal.jumped),
                _ => None,
            }
        };
        match (lost_signal(FORCE), lost_signal(VELOCITY), lost_signal(SPOOL), lost_signal(DISPLACEMENT)) {
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
    pub(super) fn wrong_sign_cause(
        &self,
        state: &mut PlausibilityState<T>,
        large_error: bool,
        tripped: bool,
    ) -> Cause {
        let [force, _, _, spool] = state.distrusted;
        let Some((sensor, moved)) = self.only_motion(state) else { return Cause::None };
        // A spool of wrong sign reverses the valve's flow.
        if force | spool || !self.spool_follows(state) {
            return Cause::None;
        }
        let velocities = [moved, state.flow_velocity.valve, state.flow_velocity.oil];
        let prior_weight = state.opening_offset.prior_weight();
        let sums = &mut state.reversal;
        let wrong = self.reversal.add(sums, self.period, velocities, prior_weight, [large_error, tripped]);
        let frozen = || state.signals.get(sensor).is_some_and(|shown| self.is_frozen(shown));
        if wrong == Some(WrongSign::Force) && frozen() {
            // A frozen sensor shows no motion, so that all of the valve's flow seems to be the oil's.
            return Cause::None;
        }
        if wrong == Some(WrongSign::Motion) && state.force_jumped() {
            // A wrong velocity makes a true force jump.
            let [force, ..] = &mut state.signals;
            force.restart();
        }
        sign_cause(wrong, sensor)
    }

    /// The sensor that shows the motion, and its velocity (m/s), unless there are two or none.
    #[inline(always)]
    fn only_motion(&self, state: &PlausibilityState<T>) -> Option<(usize, T)> {
        let ([_, displacement, velocity, _], [filtered, _]) = (state.distrusted, state.filtered_velocity);
        match (self.senses_velocity, displacement, velocity) {
            (true, true, false) => Some((VELOCITY, filtered)),
            (false, false, _) => Some((DISPLACEMENT, state.derivative.first)),
            _ => None,
        }
    }

    /// The sensor that is indicated after the displacement has failed: a spool that moves against its command, or
    /// velocity or force if a share of the fast flows' limits is exceeded. The sums of wrong signs select one of these
    /// two.
    #[inline(always)]
    pub(super) fn contradiction_by_flow(&self, state: &PlausibilityState<T>, share: T) -> Cause {
        let (balance, limits) = (&state.balance, &self.balance);
        let beyond = balance.wrong_sign.is_beyond(limits.wrong_sign, share)
            || balance.fast.is_beyond(limits.fast, share);
        match self.only_motion(state) {
            _ if state.stroke.against.is_beyond(self.stroke.against, T::splat(1.0)) => {
                Cause::SpoolImplausible
            }
            Some((sensor, _)) if beyond && self.spool_follows(state) => {
                sign_cause(state.reversal.larger(), sensor)
            }
            _ => Cause::None,
        }
    }

    /// Whether the spool is on the side of its command, has not moved against it of late, and is not frozen.
    #[inline(always)]
    fn spool_follows(&self, state: &PlausibilityState<T>) -> bool {
        let ([.., spool], stroke) = (&state.signals, &state.stroke);
        let agrees = (spool.last - self.null_bias) * (stroke.opening - self.null_bias) > T::splat(0.0);
        agrees && !stroke.against.is_beyond(self.stroke.against, T::splat(OPPOSED)) && !self.is_frozen(spool)
    }

    /// A signal whose noise has stopped, or that repeats although it should have moved.
    #[inline(always)]
    pub(super) fn stuck_sensor(
        &self,
        state: &mut PlausibilityState<T>,
        input: &Input<T>,
        velocity: T,
        command: T,
    ) -> Cause {
        let [force, _, speed, _] = &state.signals;
        let [command_at_change, displacement_at_change] = &mut state.last_changes;
        let [force_change, motion_change] = self.changes;
        if force.repeats == 0 {
            *command_at_change = command;
        }
        if speed.repeats == 0 {
            *displacement_at_change = input.displacement;
        }
        let travelled = input.displacement - *displacement_at_change;
        let predicted = T::from_u32(speed.repeats) * self.period * velocity;
        let [still_force, still_displacement, still_velocity, still_spool] =
            state.signals.each_ref().map(|signal| self.gate.is_still(signal));
        let [force_distrusted, displacement_distrusted, velocity_distrusted, spool_distrusted] =
            state.distrusted;
        let (trusts_force, measures_velocity) =
            (!force_distrusted, self.senses_velocity & !velocity_distrusted);
        if still_force & trusts_force {
            Cause::ForceImplausible
        } else if still_velocity & measures_velocity {
            Cause::VelocityImplausible
        } else if still_spool & !spool_distrusted {
            Cause::SpoolImplausible
        } else if still_displacement & !displacement_distrusted {
            Cause::DisplacementImplausible
        } else if trusts_force
            && force.repeats >= self.repeats
            && (command - *command_at_change).abs() > force_change
        {
            Cause::ForceImplausible
        } else if measures_velocity
            && speed.repeats >= self.repeats
            && (travelled - predicted).abs() > motion_change
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
        let wrong_sign = || balance.wrong_sign.is_beyond(self.balance.wrong_sign, share);
        let differs = |share| stroke.difference.is_beyond(self.stroke.difference, T::splat(share));
        let [_, displacement, velocity, spool] = &state.signals;
        if self.travels_beyond(state, share) {
            self.blame_motion(state)
        } else if self.ratio_is_beyond(state, share) {
            self.blame_ratio(state)
        } else if stroke.against.is_beyond(self.stroke.against, T::splat(1.0)) {
            Cause::SpoolImplausible
        } else if wrong_sign() || fast() {
            if self.is_frozen(spool) {
                Cause::SpoolImplausible
            } else if self.travels_beyond(state, T::splat(NOTICED_MOTION)) || self.is_frozen(velocity) {
                match self.blame_motion(state) {
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
            if self.travels_beyond(state, T::splat(NOTICED_MOTION)) {
                self.blame_motion(state)
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
    fn blame_motion(&self, state: &PlausibilityState<T>) -> Cause {
        let [_, displacement, velocity, _] = &state.signals;
        let displacement_wrong = !self.is_frozen(velocity)
            && (self.is_frozen(displacement) || state.motion.evidence.is_of_displacement());
        if displacement_wrong { Cause::DisplacementImplausible } else { Cause::VelocityImplausible }
    }

    /// Whether a reading repeats, or is too still for its noise.
    #[inline(always)]
    fn is_frozen(&self, signal: &Signal<T>) -> bool {
        signal.repeats >= self.repeats || signal.is_stiller(T::splat(FROZEN_PROBABILITY))
    }

    /// Velocity and displacement differ by a ratio. If the flow does not decide, the larger one is distrusted, because
    /// a velocity that is too small leaves damping.
    #[inline(always)]
    fn blame_ratio(&self, state: &PlausibilityState<T>) -> Cause {
        let MotionSums { ratio, misfit, mean_square_speed, .. } = &state.motion;
        let displacement_fits_worse = *misfit < -(T::splat(CLEAR_SHARE) * self.area * *mean_square_speed);
        if displacement_fits_worse | (ratio.below > ratio.above) {
            Cause::DisplacementImplausible
        } else {
            Cause::VelocityImplausible
        }
    }
}

#[cfg(test)]
mod tests;
