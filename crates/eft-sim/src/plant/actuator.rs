//! The actuator, Eq. (7): `K_a·Ṗ_L = Q_L − C_l·P_L − A·ẋ`, with its attachment to the structure.

use eft_core::Scalar;

use crate::config::RigConfig;
use crate::lanes::Num;
use crate::plant::attachment::Attachment;

/// Chambers and piston.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Actuator<S: Num> {
    area: S,
    leakage: S,
    /// 1 over the compressibility (Pa/m³) of oil and attachment. With an attachment of stiffness `k` the
    /// piston's own velocity is `ẋ + A·Ṗ_L/k`, so the load flow contains `(K_a + A²/k)·Ṗ_L`.
    per_compressibility: S,
    /// The oil's share (1) of the compressibility.
    share_of_oil: S,
    attachment: Attachment<S>,
    /// Whether any lane's motion is measured at a piston that moves relative to the structure, and 1 in the
    /// lanes in which it is.
    pub(crate) measures_at_piston: bool,
    at_piston: S,
    stroke: S,
    /// Whether any lane has chambers of variable volume.
    has_chambers: bool,
    per_chamber_length: S,
}

impl<S: Num> Actuator<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let compressibility =
            |i: usize| rig(i).actuator.compressibility + rig(i).actuator.attachment_compressibility();
        Self {
            area: S::from_lanes(|i| rig(i).actuator.piston_area),
            leakage: S::from_lanes(|i| rig(i).actuator.leakage),
            per_compressibility: S::from_lanes(|i| 1.0 / compressibility(i)),
            share_of_oil: S::from_lanes(|i| rig(i).actuator.compressibility / compressibility(i)),
            attachment: Attachment::pack(rig),
            measures_at_piston: (0..S::LANES).any(|i| rig(i).piston_moves_alone()),
            at_piston: S::from_lanes(|i| f64::from(u8::from(rig(i).piston_moves_alone()))),
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

    /// Displacement (m) and velocity (m/s) at the measured side, from those of the structure, and load pressure
    /// and filling (Pa) with their rates (Pa/s).
    #[inline(always)]
    pub(crate) fn measured_motion(&self, at: [S; 2], load_pressure: [S; 2], filling: [S; 2]) -> [S; 2] {
        std::array::from_fn(|i| at[i] + self.at_piston * self.attachment.lead(load_pressure[i], filling[i]))
    }

    /// Load pressure (Pa) at a filling (Pa) of the chambers.
    #[inline(always)]
    pub(crate) fn load_pressure(&self, filling: S) -> S {
        self.attachment.load_pressure(filling)
    }

    /// Where the piston (m) is beyond its stroke.
    #[inline(always)]
    pub(crate) fn beyond_stroke(&self, displacement: S) -> <S as Scalar>::Mask {
        displacement.abs().gt(self.stroke)
    }

    /// As [`rate`](Self::rate), with chambers whose volumes depend on the displacement (m): `V_0 ± A·x` in
    /// series give `K_a(x) = K_a·(1 − (x/l)²)`, where `l = V_0/A` is the sum of stroke and dead length
    /// (Merritt 1967).
    ///
    /// Returns the rates (Pa/s) of load pressure and filling. Within the play of the attachment the load
    /// pressure stays zero.
    #[inline(always)]
    pub(crate) fn rates_at(&self, load_flow: S, load_pressure: S, displacement: S, velocity: S) -> [S; 2] {
        let in_the_middle = self.rate(load_flow, load_pressure, velocity);
        let rate = match self.has_chambers {
            true => in_the_middle / self.relative_compressibility(displacement),
            false => in_the_middle,
        };
        match self.attachment.within_play(load_pressure) {
            None => [rate, rate],
            Some(play) => [S::select(play, S::splat(0.0), rate), S::select(play, in_the_middle, rate)],
        }
    }

    /// Power (W) lost by leakage across the piston.
    #[inline(always)]
    pub(crate) fn leakage_loss(&self, load_pressure: S) -> S {
        self.leakage * load_pressure * load_pressure
    }

    /// Energy (J) of the compressed oil, `½·K_a(x)·P_L²`, and of the attachment, `½·(A·P_L)²/k`.
    pub(crate) fn stored(&self, load_pressure: S, displacement: S) -> S {
        S::splat(0.5) * self.relative_compressibility(displacement) / self.per_compressibility
            * load_pressure
            * load_pressure
    }

    /// Power (W) `½·K_a′(x)·ẋ·P_L²` by the change of the chambers' volume, which Eq. (7) does not contain.
    #[inline(always)]
    pub(crate) fn swept_power(&self, load_pressure: S, displacement: S, velocity: S) -> S {
        if !self.has_chambers {
            return S::splat(0.0);
        }
        let x = displacement.limit(-self.stroke, self.stroke);
        let moving = S::select(x.abs().lt(self.stroke), velocity, S::splat(0.0));
        -(self.share_of_oil * x * self.per_chamber_length * self.per_chamber_length)
            * moving
            * load_pressure
            * load_pressure
            / self.per_compressibility
    }

    /// The compressibility over that in the middle; beyond the stroke it is constant.
    #[inline(always)]
    fn relative_compressibility(&self, displacement: S) -> S {
        let part = displacement.limit(-self.stroke, self.stroke) * self.per_chamber_length;
        S::splat(1.0) - self.share_of_oil * part * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn chambers_away_from_the_middle_are_two_springs_in_parallel() {
        let rig = changed(&[("actuator.dead_length", 0.013.into())]);
        let actuator = Actuator::<f64>::pack(&|_| &rig);
        let (area, half) = (rig.actuator.piston_area, 0.14);
        let compressibility = |x: f64| {
            // K_a in the middle gives the bulk modulus: K_a = V_0/(2β).
            let modulus = area * half / (2.0 * rig.actuator.compressibility);
            let (near, far) = (area * (half + x) / modulus, area * (half - x) / modulus);
            1.0 / (1.0 / near + 1.0 / far)
        };
        for x in [-0.1, 0.0, 0.05, 0.12] {
            let rate = actuator.rates_at(1e-3, 0.0, x, 0.0)[0];
            assert!((rate * compressibility(x) / 1e-3 - 1.0).abs() < 1e-12, "at {x} m");
            let stored = |x| actuator.stored(5e6, x);
            let numeric = (stored(x + 1e-6) - stored(x - 1e-6)) / 2e-6;
            assert!((actuator.swept_power(5e6, x, 1.0) - numeric).abs() < 1e-6 * stored(0.0) / half);
        }
        assert!(
            (actuator.rates_at(1e-3, 0.0, 0.0, 0.0)[0] * rig.actuator.compressibility / 1e-3 - 1.0).abs()
                < 1e-12
        );
    }

    #[test]
    fn a_spring_behind_the_piston_is_in_series_with_the_oil() {
        let stiffness = 5e8;
        let rig = changed(&[("actuator.attachment_stiffness", stiffness.into())]);
        let (actuator, a) = (Actuator::<f64>::pack(&|_| &rig), &rig.actuator);
        let oil = a.piston_area * a.piston_area / a.compressibility;
        // With a closed valve the pressure from a motion of the structure is that of both springs in series.
        let rate = actuator.rate(0.0, 0.0, -0.2);
        let series = 1.0 / (1.0 / oil + 1.0 / stiffness);
        assert!((a.piston_area * rate / (0.2 * series) - 1.0).abs() < 1e-12);
        // The motion of the piston then equals the compression of the oil.
        let [displacement, velocity] = actuator.measured_motion([0.01, -0.2], [3e6, rate], [3e6, rate]);
        assert!((velocity * oil + a.piston_area * rate).abs() < 1e-9 * oil);
        assert!((displacement - 0.01 - a.piston_area * 3e6 / stiffness).abs() < 1e-15);
        let energy = (a.piston_area * 3e6).powi(2) / 2.0 * (1.0 / oil + 1.0 / stiffness);
        assert!((actuator.stored(3e6, 0.0) / energy - 1.0).abs() < 1e-12);
        let plain = changed(&[]);
        assert!(actuator.measures_at_piston && !Actuator::<f64>::pack(&|_| &plain).measures_at_piston);
    }
}
