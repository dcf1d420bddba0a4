//! The velocity compared with the displacement's derivative, v = ẋ: in travel, and in the ratio of the two.

use crate::number::Real;
use crate::protection::plausibility::comparisons::MotionSums;
use crate::protection::plausibility::sums::{envelope, larger, low_pass};
use crate::protection::plausibility::{Plausibility, PlausibilityState};

/// Share by which velocity and displacement may differ.
const MOTION_ERROR: f64 = 0.05;
/// Share by which the gains of two sound sensors differ: 2 % each.
const GAIN_ERROR: f64 = 0.04;
/// Share of the motion's limit below which its sum may be noise.
const NOISE_SHARE: f64 = 0.15;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds a tick's mean velocity (m/s) and displacement (m), with residual and slope (m³/s) of the flow balance.
    #[inline(always)]
    pub(super) fn compare_motion(
        &self,
        state: &mut PlausibilityState<T>,
        speed: T,
        displacement: T,
        [residual, slope]: [T; 2],
    ) {
        let (limits, sums) = (&self.motion, &mut state.motion);
        let filtered = low_pass(&mut sums.velocity, self.low_gain, speed);
        if sums.ticks != 1 {
            // In a short gap the mean velocity. The differences of the displacement would add up its noise.
            let travelled = if sums.ticks > 0 && sums.ticks <= self.short_gap {
                self.period * T::from_u32(sums.ticks) * speed
            } else {
                displacement - sums.last_displacement
            };
            sums.displacement = sums.displacement + (travelled - self.period * speed);
        }
        (sums.last_displacement, sums.ticks) = (displacement, 1);
        let before = sums.displacement;
        let travelled = self.rate * (low_pass(&mut sums.displacement, self.low_gain, displacement) - before);
        let largest = envelope(&mut sums.speed_envelope, self.decay, larger(filtered.abs(), travelled.abs()));
        if self.senses_velocity {
            let difference = filtered - travelled;
            let tolerance = T::splat(MOTION_ERROR) * largest + limits.drift;
            let change = [self.period * difference, self.period * tolerance, limits.travel];
            sums.travel_start.add(&mut sums.travel, change, [limits.latency, filtered]);
            // In a slow motion a null bias leaves more than a wrong sign.
            self.add_ratio(sums, filtered, difference, residual - slope * state.opening_offset.null_bias());
        }
    }

    /// Adds the ratio of velocity (m/s) and displacement, by their difference (m/s).
    #[inline(always)]
    fn add_ratio(&self, sums: &mut MotionSums<T>, filtered: T, difference: T, residual: T) {
        let (limits, one) = (&self.motion, T::splat(1.0));
        let speed = low_pass(&mut sums.ratio_velocity, self.ratio_gain, filtered);
        let difference = low_pass(&mut sums.ratio_difference, self.ratio_gain, difference);
        let flow_residual = low_pass(&mut sums.ratio_residual, self.ratio_gain, residual);
        // A velocity that is too large in either direction.
        let excess = difference * (self.per_reversal * speed).limit(-one, one);
        // In the direction of the motion a delay adds itself times the change of the velocity's size.
        // The rest of the share is a drift as well, and larger than that against noise in a fast motion.
        let size = speed.abs();
        let tolerance =
            larger(T::splat(MOTION_ERROR) * size, T::splat(GAIN_ERROR) * size + limits.ratio_drift);
        let change = [self.period * excess, self.period * tolerance, limits.ratio];
        sums.ratio_start.add(&mut sums.ratio, change, [limits.latency, size]);
        let differs = sums.travel.is_beyond(limits.travel, T::splat(NOISE_SHARE));
        sums.evidence.add(differs, difference, flow_residual, self.area);
        // The flow's residual vanishes with the correct one of the two.
        let misfit = difference * (flow_residual - T::splat(0.5) * (self.area * difference));
        low_pass(&mut sums.misfit, self.spool_gain, misfit);
        let faster = larger(size, (speed - difference).abs());
        low_pass(&mut sums.mean_square_speed, self.spool_gain, faster * faster);
    }

    /// Whether the travel is beyond a share of its limit, and what a delay may have added.
    #[inline(always)]
    pub(super) fn travels_beyond(&self, state: &PlausibilityState<T>, share: T) -> bool {
        let (limits, MotionSums { travel, travel_start, velocity, .. }) = (&self.motion, &state.motion);
        travel_start.is_beyond(travel, limits.travel, share, [limits.latency, *velocity])
    }

    /// The same of the ratio.
    #[inline(always)]
    pub(super) fn ratio_is_beyond(&self, state: &PlausibilityState<T>, share: T) -> bool {
        let (limits, MotionSums { ratio, ratio_start, ratio_velocity, .. }) = (&self.motion, &state.motion);
        ratio_start.is_beyond(ratio, limits.ratio, share, [limits.latency, ratio_velocity.abs()])
    }
}
