//! Friction of the piston's seals: `F_f = F_c·ẋ/√(ẋ² + v_0²)`.
//!
//! This is Coulomb's law with a slope instead of the step at standstill. Below `v_0` the piston creeps
//! instead of sticking (Armstrong-Hélouvry and others, *Automatica* 30, 1994, on such regularisations).

use crate::config::RigConfig;
use crate::lanes::Num;

/// Seals.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Friction<S> {
    /// Whether any lane has friction.
    present: bool,
    force: S,
    velocity_squared: S,
}

impl<S: Num> Friction<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            present: (0..S::LANES).any(|i| rig(i).actuator.friction > 0.0),
            force: S::from_lanes(|i| rig(i).actuator.friction),
            velocity_squared: S::from_lanes(|i| rig(i).actuator.friction_velocity.powi(2)),
        }
    }

    /// Force (N) against the motion at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn force(&self, velocity: S) -> S {
        if !self.present {
            return S::splat(0.0);
        }
        self.force * velocity / (velocity * velocity + self.velocity_squared).sqrt()
    }

    /// Rate (N·s/m) of that force with the velocity (m/s).
    #[inline(always)]
    pub(crate) fn slope(&self, velocity: S) -> S {
        if !self.present {
            return S::splat(0.0);
        }
        let squared = velocity * velocity + self.velocity_squared;
        self.force * self.velocity_squared / (squared * squared.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn a_free_vibration_loses_four_f_over_k_a_cycle() {
        let (force, stiffness, mass): (f64, f64, f64) = (500.0, 693.8e3, 7040.0);
        let rig =
            changed(&[("actuator.friction", force.into()), ("actuator.friction_velocity", 1e-5.into())]);
        let friction = Friction::<f64>::pack(&|_| &rig);
        let (mut x, mut v, step) = (0.02, 0.0, 1e-6);
        let mut crests = vec![x];
        while crests.len() < 4 {
            let before = v;
            let half = v - 0.5 * step * (stiffness * x + friction.force(v)) / mass;
            x += step * half;
            v = half - 0.5 * step * (stiffness * x + friction.force(half)) / mass;
            if before > 0.0 && v <= 0.0 {
                crests.push(x);
            }
        }
        for pair in crests.windows(2) {
            assert!(((pair[0] - pair[1]) / (4.0 * force / stiffness) - 1.0).abs() < 2e-3, "{crests:?}");
        }
    }

    #[test]
    fn slope_is_the_derivative() {
        let rig = changed(&[("actuator.friction", 500.0.into())]);
        let friction = Friction::<f64>::pack(&|_| &rig);
        for v in [-0.1, -1e-3, 0.0, 2e-4, 0.05] {
            let numeric = (friction.force(v + 1e-7) - friction.force(v - 1e-7)) / 2e-7;
            assert!((friction.slope(v) - numeric).abs() < 1e-6 * friction.slope(0.0));
        }
    }
}
