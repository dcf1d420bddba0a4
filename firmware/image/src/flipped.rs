//! The same channel with one constant a little off, the one that `EFT_FLIP` named when this was built: its run must not
//! equal the host's.

use eft_core::{Channel, Parameters};
use eft_rigs::zhao2005::{CHANNEL, PARAMETERS, POINTS};

/// A few steps of an `f32`.
const OFF: f64 = 1.000_001;

/// The rig's channel but for the one constant.
pub fn channel() -> Channel<f32, POINTS> {
    let (mut p, mut flows) = (PARAMETERS, [0.0; POINTS]);
    flows.copy_from_slice(PARAMETERS.flows);
    match option_env!("EFT_FLIP") {
        Some("lead") => p.response_delay *= OFF,
        Some("load_pressure") => p.supply_pressure *= OFF,
        Some("table") => flows[11] *= OFF,
        Some("piston_area") => p.piston_area *= OFF,
        Some("force_sensitivity") => p.force_sensitivity *= OFF,
        _ => {}
    }
    Channel::<f32, POINTS>::new(&Parameters { flows: &flows, ..p }).unwrap_or(CHANNEL)
}
