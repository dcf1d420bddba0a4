//! The pilot stage, Eq. (2): `τ·q̇ = K_vp·(v − K_3·x_vmax·x_v) − q`, and its rated flow.

use crate::config::RigConfig;
use crate::lanes::Num;

/// Pilot stage and its inner loop on the spool's position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotValve<S> {
    flow_gain: S,
    spool_feedback: S,
    per_time_constant: S,
    /// Whether any lane has a rated flow.
    limited: bool,
    flow_limit: S,
}

impl<S: Num> PilotValve<S> {
    pub(crate) fn pack<'a>(rig: &dyn Fn(usize) -> &'a RigConfig) -> Self {
        let valve = |i: usize| &rig(i).servovalve;
        Self {
            flow_gain: S::from_lanes(|i| valve(i).pilot_flow_gain),
            spool_feedback: S::from_lanes(|i| valve(i).spool_sensitivity * valve(i).spool_stroke),
            per_time_constant: S::from_lanes(|i| 1.0 / valve(i).pilot_time_constant),
            limited: (0..S::LANES).any(|i| valve(i).pilot_flow_limit.is_some()),
            flow_limit: S::from_lanes(|i| valve(i).pilot_flow_limit.unwrap_or(f64::MAX)),
        }
    }

    /// Rate of the pilot flow (m³/s²) for a valve command (V), the spool opening (1) and the pilot flow (m³/s).
    #[inline(always)]
    pub(crate) fn rate(&self, valve_command: S, spool: S, pilot_flow: S) -> S {
        self.rate_towards(self.demanded_flow(valve_command, spool), pilot_flow)
    }

    /// Demanded pilot flow (m³/s) at a valve command (V) and the spool opening (1). A rated flow `q_max`
    /// (m³/s) limits it to `sat(K_vp·e, q_max)`, so the spool is no faster than `q_max/(A_v·x_vmax)`.
    #[inline(always)]
    pub(crate) fn demanded_flow(&self, valve_command: S, spool: S) -> S {
        let error = valve_command - self.spool_feedback * spool;
        let unlimited = self.flow_gain * error;
        if self.limited { unlimited.limit(-self.flow_limit, self.flow_limit) } else { unlimited }
    }

    /// Rate of the pilot flow (m³/s²) towards a flow (m³/s).
    #[inline(always)]
    pub(crate) fn rate_towards(&self, pilot_demand: S, pilot_flow: S) -> S {
        (pilot_demand - pilot_flow) * self.per_time_constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::changed;

    #[test]
    fn the_pilot_settles_at_its_largest_flow() {
        let limit = 2e-6;
        let rig = changed(&[("servovalve.pilot_flow_limit", limit.into())]);
        let pilot = PilotValve::<f64>::pack(&|_| &rig);
        for (command, side) in [(5.0, 1.0), (-5.0, -1.0)] {
            assert_eq!(pilot.rate(command, 0.0, side * limit), 0.0);
            assert!(side * pilot.rate(command, 0.0, 0.0) > 0.0);
        }
        // Small commands are not limited.
        let plain = changed(&[]);
        assert_eq!(pilot.rate(0.1, 0.0, 1e-7), PilotValve::<f64>::pack(&|_| &plain).rate(0.1, 0.0, 1e-7));
    }
}
