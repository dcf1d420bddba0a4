//! The actuator, Eq. (7): `K_a·Ṗ_L = Q_L − C_l·P_L − A·ẋ`.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::lanes::Num;

/// Chambers and piston.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Actuator<S> {
    area: S,
    leakage: S,
    per_compressibility: S,
    stroke: S,
    /// Whether the volume of any lane's chambers counts.
    has_chambers: bool,
    per_chamber_length: S,
}

impl<S: Num> Actuator<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            area: S::from_lanes(|i| rig(i).actuator.piston_area),
            leakage: S::from_lanes(|i| rig(i).actuator.leakage),
            per_compressibility: S::from_lanes(|i| 1.0 / rig(i).actuator.compressibility),
            stroke: S::from_lanes(|i| rig(i).actuator.stroke),
            has_chambers: (0..S::LANES).any(|i| rig(i).actuator.dead_length.is_some()),
            per_chamber_length: S::from_lanes(|i| {
                let actuator = &rig(i).actuator;
                actuator.dead_length.map_or(0.0, |dead| 1.0 / (actuator.stroke + dead))
            }),
        }
    }

    /// Rate of the load pressure (Pa/s) for a load flow (m³/s), the load pressure (Pa) and the piston velocity (m/s).
    #[inline(always)]
    pub(crate) fn rate(&self, load_flow: S, load_pressure: S, velocity: S) -> S {
        (load_flow - self.leakage * load_pressure - self.area * velocity) * self.per_compressibility
    }

    /// Force (N) of a load pressure (Pa), or force rate (N/s) of a pressure rate (Pa/s).
    #[inline(always)]
    pub(crate) fn force(&self, load_pressure: S) -> S {
        self.area * load_pressure
    }

    /// Where the piston (m) is beyond its stroke.
    #[inline(always)]
    pub(crate) fn beyond_stroke(&self, displacement: S) -> <S as Scalar>::Mask {
        displacement.abs().gt(self.stroke)
    }

    /// As [`rate`](Self::rate), with chambers whose volumes depend on the displacement (m): `V_0 ± A·x` in series
    /// give `K_a(x) = K_a·(1 − (x/l)²)`, `l = V_0/A` being the stroke and the dead length (Merritt 1967).
    #[inline(always)]
    pub(crate) fn rate_at(&self, load_flow: S, load_pressure: S, displacement: S, velocity: S) -> S {
        let rate = self.rate(load_flow, load_pressure, velocity);
        if self.has_chambers { rate / self.relative_compressibility(displacement) } else { rate }
    }

    /// Power (W) lost by leakage across the piston.
    #[inline(always)]
    pub(crate) fn leakage_loss(&self, load_pressure: S) -> S {
        self.leakage * load_pressure * load_pressure
    }

    /// Energy (J) of the compressed oil, `½·K_a(x)·P_L²`.
    pub(crate) fn stored(&self, load_pressure: S, displacement: S) -> S {
        S::splat(0.5) * self.relative_compressibility(displacement) / self.per_compressibility
            * load_pressure
            * load_pressure
    }

    /// Power (W) `½·K_a′(x)·ẋ·P_L²` that the oil's energy changes by because the chambers do, which Eq. (7) does
    /// not carry.
    #[inline(always)]
    pub(crate) fn swept_power(&self, load_pressure: S, displacement: S, velocity: S) -> S {
        if !self.has_chambers {
            return S::splat(0.0);
        }
        let x = displacement.limit(-self.stroke, self.stroke);
        let moving = S::select(x.abs().lt(self.stroke), velocity, S::splat(0.0));
        -(x * self.per_chamber_length * self.per_chamber_length) * moving * load_pressure * load_pressure
            / self.per_compressibility
    }

    /// `K_a(x)/K_a`; beyond the stroke it stays as it is there.
    #[inline(always)]
    fn relative_compressibility(&self, displacement: S) -> S {
        let part = displacement.limit(-self.stroke, self.stroke) * self.per_chamber_length;
        S::splat(1.0) - part * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn chambers_off_the_middle_are_two_springs_in_series() {
        let rig = changed(&[("actuator.dead_length", 0.013.into())]);
        let actuator = Actuator::<f64>::pack(|_| &rig);
        let (area, half) = (rig.actuator.piston_area, 0.14);
        let compressibility = |x: f64| {
            // K_a of the middle gives the bulk modulus: K_a = V_0/(2β).
            let modulus = area * half / (2.0 * rig.actuator.compressibility);
            let (near, far) = (area * (half + x) / modulus, area * (half - x) / modulus);
            1.0 / (1.0 / near + 1.0 / far)
        };
        for x in [-0.1, 0.0, 0.05, 0.12] {
            let rate = actuator.rate_at(1e-3, 0.0, x, 0.0);
            assert!((rate * compressibility(x) / 1e-3 - 1.0).abs() < 1e-12, "at {x} m");
            let stored = |x| actuator.stored(5e6, x);
            let numeric = (stored(x + 1e-6) - stored(x - 1e-6)) / 2e-6;
            assert!((actuator.swept_power(5e6, x, 1.0) - numeric).abs() < 1e-6 * stored(0.0) / half);
        }
        assert!(
            (actuator.rate_at(1e-3, 0.0, 0.0, 0.0) * rig.actuator.compressibility / 1e-3 - 1.0).abs() < 1e-12
        );
    }
}
