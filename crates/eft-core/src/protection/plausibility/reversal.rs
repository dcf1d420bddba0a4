//! Notices a motion or a force of the wrong sign while a single sensor shows the motion: the displacement on a rig
//! without a velocity sensor, or the velocity after the displacement has failed.
//!
//! The flows of valve and oil show the motion a second time: v = b − o, with the sensor's velocity v, and the
//! velocities b and o by the flows of valve and oil. A wrong sign of the sensor makes it −v = b − o, and one of the
//! force v = b + o. Each has a cumulative sum of a quarter of the difference between the squared residual of v = b − o
//! and its own. It is divided by |b − o|, or by a least velocity if that is larger, so that it is a path, and a noise
//! of the displacement adds no more than itself.

use crate::integrity::integrity;
use crate::number::Real;

/// Share of the oil's flow that a stiffness from 0.63 to 1.5 times the configured one leaves, and the share that counts
/// if the force is far from its command: 0.8 to 1.33 times.
const OIL: f64 = 0.6;
const OIL_FAR: f64 = 0.25;
/// Least share of the offset that counts if the force is far from its command.
const LEAST_OFFSET_SHARE: f64 = 0.2;
/// Share of the limit that is enough after a trip.
const TRIPPED_LIMIT_SHARE: f64 = 0.5;
/// Largest sum in units of the limit.
const LARGEST_SUM: f64 = 1000.0;

/// The limits of the sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReversalWatch<T> {
    /// Velocity (m/s) by the flows below which they have a smaller weight.
    pub(crate) slow: T,
    /// Largest gain (m/s) by an offset of the flow.
    pub(crate) drift: T,
    /// In m.
    pub(crate) limit: T,
}
integrity!(ReversalWatch<T>: slow, drift, limit);

/// What has the wrong sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WrongSign {
    Motion,
    Force,
}

/// The sums (m) for a wrong sign of motion and force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct SignSums<T> {
    pub(super) motion: T,
    pub(super) force: T,
}
integrity!(SignSums<T>: motion, force);

impl<T: Real> SignSums<T> {
    /// The one whose wrong sign explains more.
    #[inline(always)]
    pub(super) fn larger(&self) -> Option<WrongSign> {
        if self.motion > self.force {
            Some(WrongSign::Motion)
        } else if self.force > self.motion {
            Some(WrongSign::Force)
        } else {
            None
        }
    }
}

impl<T: Real> ReversalWatch<T> {
    /// Adds a tick's velocities (m/s) by the sensor and by the flows of valve and oil, and returns which of motion and
    /// force has the wrong sign. A share (1) of the null bias is not known yet. The force may be far from its
    /// command, and the protection may have tripped.
    #[inline(always)]
    pub(super) fn add(
        &self,
        sums: &mut SignSums<T>,
        period: T,
        [velocity, valve, oil]: [T; 3],
        prior_weight: T,
        [large_error, tripped]: [bool; 2],
    ) -> Option<WrongSign> {
        let flow_velocity = valve - oil;
        let size = flow_velocity.abs();
        let per_flow = T::splat(1.0) / if size > self.slow { size } else { self.slow };
        let least = T::splat(LEAST_OFFSET_SHARE);
        let offset = if prior_weight > least { prior_weight } else { least };
        let (oil_share, offset) =
            if large_error | tripped { (OIL_FAR, offset) } else { (OIL, T::splat(1.0)) };
        let drift = offset * offset * self.drift;
        let tolerance = T::splat(oil_share) * (oil * velocity).abs() * per_flow + drift;
        let add = |sum: &mut T, product: T| {
            let gain = product * per_flow - tolerance;
            *sum = (*sum + period * gain).limit(T::splat(0.0), T::splat(LARGEST_SUM) * self.limit);
            *sum
        };
        let motion = add(&mut sums.motion, -(velocity * flow_velocity));
        let force = add(&mut sums.force, oil * (velocity - valve));
        let limit = T::splat(if tripped { TRIPPED_LIMIT_SHARE } else { 1.0 }) * self.limit;
        if motion > limit || force > limit { sums.larger() } else { None }
    }
}

#[cfg(test)]
mod tests;
