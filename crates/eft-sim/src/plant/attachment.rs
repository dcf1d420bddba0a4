//! The attachment of the piston to the structure: a massless spring with play.
//!
//! Within the play `p` the piston moves alone, and the oil carries no load. The state of a plant with play is
//! therefore not the load pressure but the filling `z` (Pa), the load pressure that the same volume of oil
//! would have without play: `P_L = z − sat(z, z_p)`, where `z_p = ½·p·A/K` and `K` is the compressibility of
//! oil and spring. Within the play `K·ż = Q_L − A·ẋ`, and the piston is ahead of the structure by `K·z/A`.
//! Seals and stops act on the structure's side.

use eft_core::Mask;

use crate::config::RigConfig;
use crate::lanes::Num;

/// Spring and play.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attachment<S: Num> {
    /// `A/k` (m/Pa), or 0 if rigid.
    compliance: S,
    /// Whether any lane has play, and the lanes that have.
    has_play: bool,
    play: S::Mask,
    /// The filling `z_p` (Pa) at an end of the play.
    end_of_play: S,
    /// `K/A` (m/Pa).
    lead_per_filling: S,
}

impl<S: Num> Attachment<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let actuator = |i: usize| &rig(i).actuator;
        let attached = |i: usize| actuator(i).attachment_compressibility();
        let per_filling = |i: usize| (actuator(i).compressibility + attached(i)) / actuator(i).piston_area;
        let play = |i: usize| actuator(i).attachment_play;
        Self {
            compliance: S::from_lanes(|i| attached(i) / actuator(i).piston_area),
            has_play: (0..S::LANES).any(|i| play(i) > 0.0),
            play: S::Mask::from_lanes(|i| play(i) > 0.0),
            end_of_play: S::from_lanes(|i| play(i) / 2.0 / per_filling(i)),
            lead_per_filling: S::from_lanes(per_filling),
        }
    }

    /// Load pressure (Pa) at a filling (Pa).
    #[inline(always)]
    pub(crate) fn load_pressure(&self, filling: S) -> S {
        if self.has_play { filling - filling.limit(-self.end_of_play, self.end_of_play) } else { filling }
    }

    /// Lanes in which the piston moves alone at a load pressure (Pa); `None` if no lane has play.
    #[inline(always)]
    pub(crate) fn within_play(&self, load_pressure: S) -> Option<S::Mask> {
        self.has_play.then(|| self.play & load_pressure.abs().le(S::splat(0.0)))
    }

    /// Distance (m) of the piston ahead of the structure at a load pressure and a filling (Pa), or its rate
    /// (m/s) from their rates.
    #[inline(always)]
    pub(crate) fn lead(&self, load_pressure: S, filling: S) -> S {
        let elastic = self.compliance * load_pressure;
        if self.has_play { elastic + self.lead_per_filling * (filling - load_pressure) } else { elastic }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn the_piston_crosses_the_play_without_load_and_then_stretches_the_spring() {
        let (play, stiffness) = (2e-4, 5e8);
        let rig = changed(&[
            ("actuator.attachment_play", play.into()),
            ("actuator.attachment_stiffness", stiffness.into()),
        ]);
        let (attachment, a) = (Attachment::<f64>::pack(&|_| &rig), &rig.actuator);
        let compressibility = a.compressibility + a.piston_area.powi(2) / stiffness;
        for (volume, expected) in [
            (0.0, 0.0),
            (a.piston_area * 3e-5, 0.0),
            (-a.piston_area * 0.99e-4, 0.0),
            (a.piston_area * 1e-4 + compressibility * 2e6, 2e6),
            (-a.piston_area * 1e-4 - compressibility * 3e6, -3e6),
        ] {
            let filling = volume / compressibility;
            let pressure = attachment.load_pressure(filling);
            assert!((pressure - expected).abs() < 1e-6, "{volume} m³: {pressure} Pa");
            assert_eq!(attachment.within_play(pressure), Some(expected == 0.0));
            // The volume is in the oil and in the piston's lead.
            let lead = attachment.lead(pressure, filling);
            let balance = a.compressibility * pressure + a.piston_area * lead;
            assert!((balance - volume).abs() < 1e-18, "{volume} m³: {lead} m");
        }
    }
}
