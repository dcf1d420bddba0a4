//! The flow curve and the load pressure, for which only the nonlinear scheme compensates.

use eft_core::FlowTable;

use crate::Result;
use crate::config::{Mode, RigConfig, TABLE_CAPACITY};
use crate::plant::Supply;

/// The valve of a rig without the nonlinear scheme.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    flow: FlowTable<f64, TABLE_CAPACITY>,
    /// Opening (1) per flow of the curve about rest, for a pulling and for a pushing piston.
    per_flow: [f64; 2],
    /// The largest force (N) of a pulling and of a pushing piston.
    stall: [f64; 2],
}

impl Curve {
    /// `None` for the scheme that compensates for the curve.
    pub(super) fn of(rig: &RigConfig) -> Result<Option<Self>> {
        if rig.compensation.mode == Mode::Nonlinear {
            return Ok(None);
        }
        let plant = rig.plant();
        let (actuator, curve) = (&plant.actuator, plant.servovalve.true_curve());
        let rest = plant.at_rest(curve)?;
        let slope = 0.5 * (rest.shallower + rest.steeper);
        let stall = actuator.piston_area * Supply::<f64>::pack(&|_| plant).setting(0.0);
        Ok(Some(Self {
            flow: curve.table()?,
            per_flow: actuator.flow_factors().map(|factor| factor / slope),
            stall: [stall, actuator.area_ratio * stall],
        }))
    }

    /// The opening (1) that would pass the same flow about rest, at a force (N), less the opening itself.
    pub(super) fn beyond_linear(&self, opening: f64, force: f64) -> f64 {
        let side = usize::from(opening < 0.0);
        let load = opening.signum() * force / self.stall[side];
        self.per_flow[side] * self.flow.flow(opening) * (1.0 - load).max(0.0).sqrt() - opening
    }
}
