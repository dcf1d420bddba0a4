//! The rig of the paper: Tables 1 and 2 and Fig. 7, in SI units.

use std::sync::LazyLock;

use eft_core::Parameters;
use toml::{Table, Value};

use super::{RigConfig, tree};
use crate::Result;

static ZHAO2005: LazyLock<Result<RigConfig>> = LazyLock::new(|| RigConfig::from_tree(given()?));

impl RigConfig {
    /// The rig of Zhao, Shield, French and Posbergh (Tables 1 and 2, Fig. 7), nonlinear
    /// compensation at level 1, sampled at 4096 Hz.
    #[allow(clippy::expect_used, reason = "the same rig in every call, so that a test of it is enough")]
    pub fn zhao2005() -> Self {
        ZHAO2005.as_ref().expect("the paper's rig is valid").clone()
    }
}

/// The values without a default. What the controller knows is that of the core.
fn given() -> Result<Table> {
    let p = Parameters::ZHAO2005;
    let list = |values: &[f64]| Value::Array(values.iter().map(|value| Value::Float(*value)).collect());
    let values: [(&str, Value); 28] = [
        ("name", "zhao2005".into()),
        ("actuator.piston_area", p.piston_area.into()),
        ("actuator.compressibility", p.compressibility.into()),
        ("actuator.leakage", p.leakage.into()),
        ("actuator.stroke", 0.127.into()),
        ("supply.pressure", p.supply_pressure.into()),
        ("servovalve.pilot_time_constant", 1.4e-3.into()),
        ("servovalve.pilot_flow_gain", 1.06e-5.into()),
        ("servovalve.spool_area", 1.964e-4.into()),
        ("servovalve.spool_stroke", 2.79e-3.into()),
        ("servovalve.spool_sensitivity", 3579.13.into()),
        ("servovalve.flow_table.openings", list(p.openings)),
        ("servovalve.flow_table.flows", list(p.flows)),
        ("controller.force_sensitivity", p.force_sensitivity.into()),
        ("controller.proportional_gain", p.proportional_gain.into()),
        ("controller.derivative_gain", p.derivative_gain.into()),
        ("controller.sample_rate", p.sample_rate.into()),
        ("compensation.mode", "nonlinear".into()),
        ("compensation.flow_gain", p.flow_gain.into()),
        ("compensation.valve_gain", p.valve_gain.into()),
        ("compensation.response_delay", p.response_delay.into()),
        ("compensation.lead_alpha", p.lead_alpha.into()),
        ("structure.kind", "bilinear".into()),
        ("structure.mass", 7040.0.into()),
        ("structure.damping", 4330.0.into()),
        ("structure.stiffness", 693.8e3.into()),
        ("structure.softening.displacement", 25.0e-3.into()),
        ("structure.softening.stiffness", 350.0e3.into()),
    ];
    let mut tree = Table::new();
    for (key, value) in values {
        tree::set(&mut tree, key, value)?;
    }
    Ok(tree)
}
