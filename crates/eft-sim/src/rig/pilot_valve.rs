//! The pilot stage, Eq. (2): `τ·q̇ = K_vp·(v − K_3·x_vmax·x_v) − q`.

use crate::config::RigConfig;
use crate::rig::Num;

/// Pilot stage and its inner loop on the spool's position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotValve<S> {
    flow_gain: S,
    spool_feedback: S,
    per_time_constant: S,
}

impl<S: Num> PilotValve<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Self {
        Self {
            flow_gain: S::from_lanes(|i| rig(i).servovalve.pilot_flow_gain),
            spool_feedback: S::from_lanes(|i| {
                rig(i).servovalve.spool_sensitivity * rig(i).servovalve.spool_stroke
            }),
            per_time_constant: S::from_lanes(|i| 1.0 / rig(i).servovalve.pilot_time_constant),
        }
    }

    /// Rate of the pilot flow (m³/s²) for a valve command (V), the spool opening (1) and the pilot flow (m³/s).
    #[inline(always)]
    pub(crate) fn rate(&self, valve_command: S, spool: S, pilot_flow: S) -> S {
        let error = valve_command - self.spool_feedback * spool;
        (self.flow_gain * error - pilot_flow) * self.per_time_constant
    }
}
