//! The ends of the stroke: `F_s = k_s·δ·(1 + d·δ̇)`, never a pull.
//!
//! `δ` is the distance of the piston beyond its stroke. The damping grows with the penetration, so the force
//! is continuous at contact (Hunt and Crossley, *J. Appl. Mech.* 42, 1975): a body that arrives at `v` leaves
//! at
//! `v·(1 − ⅔·d·v)` to first order.

use crate::config::RigConfig;
use crate::lanes::Num;

/// Both stops.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EndStop<S> {
    /// Whether any lane has stops.
    present: bool,
    stroke: S,
    stiffness: S,
    damping: S,
}

impl<S: Num> EndStop<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            present: (0..S::LANES).any(|i| rig(i).actuator.stop_stiffness.is_some()),
            stroke: S::from_lanes(|i| rig(i).actuator.stroke),
            stiffness: S::from_lanes(|i| rig(i).actuator.stop_stiffness.unwrap_or(0.0)),
            damping: S::from_lanes(|i| rig(i).actuator.stop_damping),
        }
    }

    /// Force (N) against a displacement (m) at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn force(&self, displacement: S, velocity: S) -> S {
        if !self.present {
            return S::splat(0.0);
        }
        self.elastic(displacement) * self.hardening(displacement, velocity)
    }

    /// Rate (N/s) of that force at an acceleration (m/s²).
    #[inline(always)]
    pub(crate) fn rate(&self, displacement: S, velocity: S, acceleration: S) -> S {
        let zero = S::splat(0.0);
        if !self.present {
            return zero;
        }
        let hardening = self.hardening(displacement, velocity);
        let pushing = self.elastic(displacement).abs().gt(zero) & hardening.gt(zero);
        let outward = acceleration.times_sign_of(displacement);
        let rate =
            self.stiffness * velocity * hardening + self.elastic(displacement) * self.damping * outward;
        S::select(pushing, rate, zero)
    }

    /// Power (W) lost in the stop.
    #[inline(always)]
    pub(crate) fn loss(&self, displacement: S, velocity: S) -> S {
        if !self.present {
            return S::splat(0.0);
        }
        (self.force(displacement, velocity) - self.elastic(displacement)) * velocity
    }

    /// Energy (J) stored in the stop.
    pub(crate) fn stored(&self, displacement: S) -> S {
        S::splat(0.5) * self.elastic(displacement) * self.beyond(displacement)
    }

    #[inline(always)]
    fn beyond(&self, displacement: S) -> S {
        displacement - displacement.limit(-self.stroke, self.stroke)
    }

    #[inline(always)]
    fn elastic(&self, displacement: S) -> S {
        self.stiffness * self.beyond(displacement)
    }

    #[inline(always)]
    fn hardening(&self, displacement: S, velocity: S) -> S {
        let outward = velocity.times_sign_of(displacement);
        (S::splat(1.0) + self.damping * outward).limit(S::splat(0.0), S::splat(f64::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    /// Velocity (m/s) at which a body of 7040 kg leaves the stop after it arrived with `arrival` (m/s).
    fn rebound(damping: f64, arrival: f64, side: f64) -> f64 {
        let rig =
            changed(&[("actuator.stop_stiffness", 1e9.into()), ("actuator.stop_damping", damping.into())]);
        let stop = EndStop::<f64>::pack(&|_| &rig);
        let (mut x, mut v, step) = (side * 0.127, side * arrival, 1e-6);
        // Velocity Verlet keeps the energy of an elastic collision.
        while side * v > 0.0 || side * x > 0.127 {
            let half = v - 0.5 * step * stop.force(x, v) / 7040.0;
            x += step * half;
            v = half - 0.5 * step * stop.force(x, half) / 7040.0;
        }
        side * v
    }

    #[test]
    fn an_elastic_stop_returns_the_whole_velocity() {
        for side in [1.0, -1.0] {
            assert!((rebound(0.0, 0.5, side) + 0.5).abs() < 1e-5);
        }
    }

    #[test]
    fn a_damped_stop_reduces_the_velocity_by_two_thirds_of_the_damping() {
        let (damping, arrival) = (0.05, 0.5);
        let expected = -arrival * (1.0 - 2.0 / 3.0 * damping * arrival);
        // The next term is of the order (d·v)².
        assert!((rebound(damping, arrival, 1.0) - expected).abs() < (damping * arrival).powi(2));
    }

    #[test]
    fn the_stops_force_agrees_with_its_rate_and_never_pulls() {
        let rig = changed(&[("actuator.stop_stiffness", 1e8.into()), ("actuator.stop_damping", 2.0.into())]);
        let stop = EndStop::<f64>::pack(&|_| &rig);
        assert_eq!(stop.force(0.1, 3.0), 0.0);
        assert_eq!(stop.force(0.13, -1.0), 0.0);
        assert_eq!(stop.rate(0.13, -1.0, 5.0), 0.0);
        for (x, v, a) in [(0.13, 0.2, 3.0), (-0.128, -0.4, 5.0), (0.129, -0.1, -2.0)] {
            let h = 1e-7;
            let numeric = (stop.force(x + h * v, v + h * a) - stop.force(x - h * v, v - h * a)) / (2.0 * h);
            assert!((stop.rate(x, v, a) / numeric - 1.0).abs() < 1e-6);
        }
    }
}
