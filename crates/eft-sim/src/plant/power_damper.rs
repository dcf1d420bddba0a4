//! A fluid damper with a power law: `F_d = C·|ẋ|^a·sgn(ẋ)` (Constantinou and Symans, NCEER-92-0032, 1992).
//!
//! It is computed as `C·ẋ·(ẋ² + v_0²)^((a−1)/2)`, whose slope at standstill is finite for `a < 1`.

use crate::config::{RigConfig, StructureKind};
use crate::lanes::Num;

/// Far below any velocity of a test (m/s).
const STANDSTILL: f64 = 1e-4;

/// A damper in parallel with the viscous one.
#[derive(Debug, Clone)]
pub(crate) struct PowerDamper<S> {
    /// Coefficient and exponent, one pair per lane; empty if no lane has such a damper.
    lanes: Vec<(f64, f64)>,
    number: std::marker::PhantomData<S>,
}

impl<S: Num> PowerDamper<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let building = |i: usize| rig(i).structure.kind == StructureKind::ShearBuilding;
        let damper = |i: usize| rig(i).structure.power_damper.as_ref().filter(|_| !building(i));
        let mut lanes: Vec<_> =
            (0..S::LANES).map(|i| damper(i).map_or((0.0, 1.0), |d| (d.coefficient, d.exponent))).collect();
        if lanes.iter().all(|lane| lane.0 == 0.0) {
            lanes.clear();
        }
        Self { lanes, number: std::marker::PhantomData }
    }

    /// Force (N) against the motion at a velocity (m/s).
    #[inline(always)]
    pub(crate) fn force(&self, velocity: S) -> S {
        if self.lanes.is_empty() { S::splat(0.0) } else { self.powers(velocity) }
    }

    #[inline(never)]
    fn powers(&self, velocity: S) -> S {
        S::from_lanes(|i| {
            let (coefficient, exponent) = self.lanes.get(i).copied().unwrap_or((0.0, 1.0));
            let v = velocity.lane(i);
            coefficient * v * libm::pow(v * v + STANDSTILL * STANDSTILL, 0.5 * (exponent - 1.0))
        })
    }
}

/// The steepest slope (N·s/m) of a damper, at standstill for exponents below 1.
pub(crate) fn steepest(coefficient: f64, exponent: f64) -> f64 {
    coefficient * libm::pow(STANDSTILL, (exponent - 1.0).min(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn the_work_of_a_cycle_agrees_with_its_formula() {
        // Over a sine of amplitude X at ω: 2^(2+a)·Γ(1+a/2)²/Γ(2+a)·C·ω^a·X^(1+a).
        for exponent in [0.3, 0.5, 1.0, 2.0] {
            let rig = changed(&[
                ("structure.power_damper.coefficient", 2e4.into()),
                ("structure.power_damper.exponent", exponent.into()),
            ]);
            let damper = PowerDamper::<f64>::pack(&|_| &rig);
            let (amplitude, omega): (f64, f64) = (0.05, 10.0);
            let points = 20_000;
            let angle = std::f64::consts::TAU / f64::from(points);
            let work: f64 = (0..points)
                .map(|n| amplitude * omega * (f64::from(n) * angle).cos())
                .map(|v| damper.force(v) * v * angle / omega)
                .sum();
            let gamma = libm::tgamma;
            let expected = 2f64.powf(2.0 + exponent) * gamma(1.0 + exponent / 2.0).powi(2)
                / gamma(2.0 + exponent)
                * 2e4
                * omega.powf(exponent)
                * amplitude.powf(1.0 + exponent);
            assert!((work / expected - 1.0).abs() < 1e-4, "exponent {exponent}: {work} against {expected}");
        }
    }
}
