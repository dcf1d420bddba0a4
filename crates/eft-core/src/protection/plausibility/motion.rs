//! The velocity compared with the displacement's derivative, v = ẋ: in travel, and in the ratio of the two.

use crate::number::Real;
use crate::protection::plausibility::comparisons::Motion;
use crate::protection::plausibility::sums::{envelope, follow, larger};
use crate::protection::plausibility::{Plausibility, PlausibilityState};

/// Share by which velocity and displacement may differ.
const MOTION: f64 = 0.05;
/// Share by which the gains of two sound sensors differ: 2 % each.
const SOUND: f64 = 0.04;
/// Share of the motion's limit below which its sum may be noise.
const DIFFERS: f64 = 0.15;

impl<T: Real, const N: usize> Plausibility<T, N> {
    /// Adds a tick's mean velocity (m/s) and displacement (m), with residual and slope (m³/s) of the flow balance.
    #[inline(always)]
    pub(super) fn add_motion(
        &self,
        state: &mut PlausibilityState<T>,
        speed: T,
        displacement: T,
        [residual, slope]: [T; 2],
    ) {
        let (limits, sums) = (&self.motion, &mut state.motion);
        let moved = follow(&mut sums.velocity, self.low, speed);
        if !sums.goes_on {
            // For the motion before the first sample, or during lost samples, there is no velocity.
            let travelled = displacement - sums.last_displacement - self.period * speed;
            sums.displacement = sums.displacement + travelled;
        }
        (sums.last_displacement, sums.goes_on) = (displacement, true);
        let before = sums.displacement;
        let travelled = self.rate * (follow(&mut sums.displacement, self.low, displacement) - before);
        let seen = envelope(&mut sums.fastest, self.decay, larger(moved.abs(), travelled.abs()));
        if self.senses_velocity {
            let off = moved - travelled;
            let tolerance = T::splat(MOTION) * seen + limits.drift;
            let change = [self.period * off, self.period * tolerance, limits.travel];
            sums.travel_began.add(&mut sums.travel, change, [limits.late, moved]);
            // In a slow motion a null bias leaves more than a wrong sign.
            self.add_ratio(sums, moved, off, residual - slope * state.missing.null_bias());
        }
    }

    /// Adds the ratio of velocity (m/s) and displacement, by their difference (m/s).
    #[inline(always)]
    fn add_ratio(&self, sums: &mut Motion<T>, moved: T, off: T, residual: T) {
        let (limits, one) = (&self.motion, T::splat(1.0));
        let speed = follow(&mut sums.fine_velocity, self.fine, moved);
        let off = follow(&mut sums.fine_off, self.fine, off);
        let unbalanced = follow(&mut sums.fine_residual, self.fine, residual);
        // A velocity that is too large in either direction.
        let beyond = off * (self.per_reversal * speed).limit(-one, one);
        // In the direction of the motion a delay adds itself times the change of the velocity's size.
        // The rest of the share is a drift as well, and larger than that against noise in a fast motion.
        let size = speed.abs();
        let tolerance = larger(T::splat(MOTION) * size, T::splat(SOUND) * size + limits.ratio_drift);
        let change = [self.period * beyond, self.period * tolerance, limits.ratio];
        sums.ratio_began.add(&mut sums.ratio, change, [limits.late, size]);
        let differs = sums.travel.is_beyond(limits.travel, T::splat(DIFFERS));
        sums.evidence.add(differs, off, unbalanced, self.area);
        // The flow's residual vanishes with the correct one of the two.
        let worse = off * (unbalanced - T::splat(0.5) * (self.area * off));
        follow(&mut sums.worse, self.slow, worse);
        let faster = larger(size, (speed - off).abs());
        follow(&mut sums.swept, self.slow, faster * faster);
    }

    /// Whether the travel is beyond a share of its limit, and what a delay may have added.
    #[inline(always)]
    pub(super) fn travels_beyond(&self, state: &PlausibilityState<T>, share: T) -> bool {
        let (limits, Motion { travel, travel_began, velocity, .. }) = (&self.motion, &state.motion);
        travel_began.is_beyond(travel, limits.travel, share, [limits.late, *velocity])
    }

    /// The same of the ratio.
    #[inline(always)]
    pub(super) fn ratio_is_beyond(&self, state: &PlausibilityState<T>, share: T) -> bool {
        let (limits, Motion { ratio, ratio_began, fine_velocity, .. }) = (&self.motion, &state.motion);
        ratio_began.is_beyond(ratio, limits.ratio, share, [limits.late, fine_velocity.abs()])
    }
}
