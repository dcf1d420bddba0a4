//! The main stage's load flow, Eq. (6) with Table 2: `Q_L = f(x_v)·√(1 − sgn(x_v)·P_L/P_s)`.

use eft_core::FlowTable;

use crate::config::RigConfig;
use crate::error::Result;
use crate::rig::{Num, TABLE_CAPACITY};

/// Flow through the main stage into the actuator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LoadFlow<S: Num> {
    curve: FlowTable<S, TABLE_CAPACITY>,
    scale: S,
    per_supply_pressure: S,
}

impl<S: Num> LoadFlow<S> {
    pub(crate) fn pack<'a>(rig: impl Fn(usize) -> &'a RigConfig) -> Result<Self> {
        let curves = (0..S::LANES).map(|i| flow_table(rig(i))).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            curve: FlowTable::pack(|i| &curves[i]),
            scale: S::from_lanes(|i| rig(i).servovalve.flow_gain_scale),
            per_supply_pressure: S::from_lanes(|i| 1.0 / rig(i).supply.pressure),
        })
    }

    /// Load flow (m³/s) at a spool opening (1) and a load pressure (Pa). Where the load pressure exceeds the
    /// supply the flow runs backwards: the root keeps the sign of its radicand.
    #[inline(always)]
    pub(crate) fn flow(&self, opening: S, load_pressure: S) -> S {
        let ratio = (load_pressure * self.per_supply_pressure).times_sign_of(opening);
        let radicand = S::splat(1.0) - ratio;
        let root = radicand.abs().sqrt().times_sign_of(radicand);
        self.scale * self.curve.flow(opening) * root
    }
}

/// The rig's flow curve in double precision.
///
/// # Errors
/// What the core refuses, with the configuration's key.
fn flow_table(rig: &RigConfig) -> Result<FlowTable<f64, TABLE_CAPACITY>> {
    let table = &rig.servovalve.flow_table;
    Ok(FlowTable::<f64, TABLE_CAPACITY>::new(&table.openings, &table.flows)?)
}
