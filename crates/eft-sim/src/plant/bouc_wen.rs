//! A hysteretic spring (Bouc 1967, Wen 1976): `r = a·k·x + (1 − a)·k·x_y·z`,
//! `ż = (ẋ/x_y)·(1 − |z|ⁿ·(β·sgn(ẋ·z) + 1 − β))`, `z` within ±1.

use crate::config::{RigConfig, StructureKind};
use crate::lanes::Num;

/// The yielding part of the spring.
#[derive(Debug, Clone)]
pub(crate) struct BoucWen<S> {
    yield_force: S,
    per_yield_displacement: S,
    shape: S,
    /// One per lane; empty if no lane yields.
    exponents: Vec<f64>,
}

impl<S: Num> BoucWen<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let part = |i: usize| match rig(i).structure.kind {
            StructureKind::BoucWen => rig(i).structure.bouc_wen.as_ref(),
            _ => None,
        };
        let yields = (0..S::LANES).any(|i| part(i).is_some());
        let exponents = (0..S::LANES).map(|i| part(i).map_or(1.0, |b| b.exponent));
        Self {
            yield_force: S::from_lanes(|i| {
                part(i).map_or(0.0, |b| {
                    (1.0 - b.post_yield_ratio) * rig(i).structure.stiffness * b.yield_displacement
                })
            }),
            per_yield_displacement: S::from_lanes(|i| part(i).map_or(0.0, |b| 1.0 / b.yield_displacement)),
            shape: S::from_lanes(|i| part(i).map_or(0.5, |b| b.shape)),
            exponents: if yields { exponents.collect() } else { Vec::new() },
        }
    }

    /// Force (N) of the yielding part at `z`.
    #[inline(always)]
    pub(crate) fn force(&self, z: S) -> S {
        self.yield_force * z
    }

    /// Rate (1/s) of `z` at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn rate(&self, velocity: S, z: S) -> S {
        if self.exponents.is_empty() { S::splat(0.0) } else { self.yielding(velocity, z) }
    }

    #[inline(never)]
    fn yielding(&self, velocity: S, z: S) -> S {
        let one = S::splat(1.0);
        let power =
            S::from_lanes(|i| libm::pow(z.abs().lane(i), self.exponents.get(i).copied().unwrap_or(1.0)));
        let loading = self.shape.times_sign_of(velocity * z) + one - self.shape;
        velocity * self.per_yield_displacement * (one - power * loading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    fn part(exponent: f64, shape: f64) -> BoucWen<f64> {
        let rig = changed(&[
            ("structure.kind", "bouc_wen".into()),
            ("structure.bouc_wen.yield_displacement", 0.02.into()),
            ("structure.bouc_wen.post_yield_ratio", 0.1.into()),
            ("structure.bouc_wen.exponent", exponent.into()),
            ("structure.bouc_wen.shape", shape.into()),
        ]);
        BoucWen::pack(&|_| &rig)
    }

    /// `z` after a displacement (m) at constant velocity from the initial `z`.
    fn after(part: &BoucWen<f64>, mut z: f64, way: f64) -> f64 {
        let steps = 20_000;
        let step = way.abs() / f64::from(steps);
        let velocity = way.signum();
        for _ in 0..steps {
            let middle = z + 0.5 * step * part.rate(velocity, z);
            z += step * part.rate(velocity, middle);
        }
        z
    }

    #[test]
    fn first_loading_is_an_exponential_or_a_hyperbolic_tangent() {
        for way in [0.005, 0.02, 0.06, -0.03] {
            let u: f64 = way / 0.02;
            assert!((after(&part(1.0, 0.5), 0.0, way) - u.signum() * (1.0 - (-u.abs()).exp())).abs() < 1e-7);
            assert!((after(&part(2.0, 0.5), 0.0, way) - u.tanh()).abs() < 1e-7);
        }
    }

    #[test]
    fn unloading_with_equal_shares_is_straight() {
        // β = γ = ½: dz/dx = 1/x_y while z and ẋ have opposite signs.
        let loaded = after(&part(1.0, 0.5), 0.0, 0.06);
        let unloaded = after(&part(1.0, 0.5), loaded, -0.01);
        assert!((loaded - unloaded - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_yield_force_is_that_of_the_yielding_share() {
        assert!((part(1.0, 0.5).force(1.0) - 0.9 * 693.8e3 * 0.02).abs() < 1e-9);
    }
}
