//! The motion that is followed after a fault: by which velocity, and with which brake.

use crate::learning::ModelFlow;
use crate::number::Real;
use crate::protection::plausibility::comparisons::Following;
use crate::protection::plausibility::sums::{count_since, low_pass};
use crate::protection::plausibility::{Control, Plausibility, PlausibilityState};

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds a tick's displacement (m) and velocity (m/s) to the derivative, and to the low-passes that delay as it
    /// does. In a short gap the derivative goes on, because its noise cancels only from tick to tick.
    #[inline(always)]
    pub(super) fn filter(&self, state: &mut PlausibilityState<T>, displacement: T, velocity: T) {
        if displacement.is_finite() {
            match state.displacement_ticks {
                // The displacement before the first sample is unknown.
                0 => state.derivative = self.derivative.at_rest(displacement),
                ticks if ticks > self.short_gap => {
                    let further = T::from_u32(ticks - self.short_gap);
                    self.derivative.bridge(&mut state.derivative, displacement, further);
                }
                _ => {}
            }
            state.displacement_ticks = 1;
            state.velocity = self.derivative.step(&mut state.derivative, displacement);
        } else {
            if state.displacement_ticks > 0 && state.displacement_ticks < self.short_gap {
                state.velocity = self.derivative.go_on(&mut state.derivative, self.period);
            }
            count_since(&mut state.displacement_ticks);
        }
        if velocity.is_finite() {
            let [first, second] = &mut state.filtered_velocity;
            let once = low_pass(first, self.low_gain, velocity);
            low_pass(second, self.low_gain, once);
        }
    }

    /// The velocity (m/s) to follow. After a change of its source the step between the two fades in the valve's delay,
    /// because the lead network would respond to the step with a peak of the valve command.
    #[inline(always)]
    pub(crate) fn fade_source(&self, state: &mut PlausibilityState<T>, velocity: T, source: u32) -> T {
        let followed = &mut state.followed;
        if !velocity.is_finite() {
            return velocity;
        }
        if source != followed.source {
            (followed.source, followed.step) = (source, followed.velocity - velocity);
        }
        followed.step = self.following.fade * followed.step;
        followed.velocity = velocity + followed.step;
        followed.velocity
    }

    /// The velocity (m/s) to follow if that of the sensor may be wrong. It is the displacement's derivative, with what
    /// the derivative's low-passes remove: the sensor's share above their corner, in the direction in which the two
    /// agree.
    #[inline(always)]
    pub(crate) fn agreed(&self, state: &PlausibilityState<T>, velocity: T) -> T {
        let ([_, filtered_velocity], slow, one) = (state.filtered_velocity, state.velocity, T::splat(1.0));
        let [_, _, distrusted, _] = state.distrusted;
        if distrusted | !velocity.is_finite() {
            return slow;
        }
        let direction = |velocity: T| (self.per_reversal * velocity).limit(-one, one);
        slow + direction(slow) * direction(filtered_velocity) * (velocity - filtered_velocity)
    }

    /// The force (N) of the brake at a share (1) of it, in the direction of the velocity. It acts against the motion,
    /// as friction does. A low-pass keeps the oil column's oscillation out of it.
    #[inline(always)]
    pub(crate) fn brake(&self, state: &mut PlausibilityState<T>, velocity: T, share: T) -> T {
        if velocity.is_finite() {
            low_pass(&mut state.followed.brake_velocity, self.ratio_gain, velocity);
        }
        let Following { brake: force, per_brake_velocity, .. } = self.following;
        let one = T::splat(1.0);
        share * force * (per_brake_velocity * state.followed.brake_velocity).limit(-one, one)
    }

    /// Whether the piston has hardly moved of late, so that there is no motion to follow.
    #[inline(always)]
    pub(crate) fn is_at_rest(&self, state: &PlausibilityState<T>) -> bool {
        self.per_reversal * state.motion.speed_envelope < T::splat(1.0)
    }

    /// Adds a tick to the velocity by the flow balance. The oil's flow belongs to it: without it the piston would seem
    /// to follow the valve, and the compensation would follow itself.
    #[inline(always)]
    pub(super) fn update_flow_velocity(
        &self,
        state: &mut PlausibilityState<T>,
        [force, spool]: [T; 2],
        flow: &ModelFlow<T>,
        control: &Control<T>,
    ) {
        // The force before the first sample is unknown.
        let before = if state.flow_velocity.has_force { state.flow_velocity.force } else { force };
        let oil = self.oil * self.rate * (force - before);
        let opening_offset = state.opening_offset.at(spool - self.null_bias);
        let valve_flow = control.flow_gain * (flow.root * (flow.at_no_load + flow.slope * opening_offset));
        let velocity = &mut state.flow_velocity;
        low_pass(
            &mut velocity.valve,
            self.following.low_gain,
            (valve_flow - self.leakage * force) / self.area,
        );
        low_pass(&mut velocity.oil, self.following.low_gain, oil / self.area);
        (velocity.force, velocity.has_force) = (force, true);
    }
}
