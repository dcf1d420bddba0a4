//! The same controller with one constant a little off, the one that `EFT_FLIP` named when this was built: its run must
//! not equal the host's.

use eft_core::{Compensation, CompensationParameters, Controller, FlowTable, ServovalveController};
use eft_rigs::zhao2005::{FLOWS, OPENINGS, PARAMETERS, POINTS, SAMPLE_RATE};

/// A few steps of an `f32`.
const OFF: f64 = 1.000_001;

/// `controller` but for the one constant.
pub fn controller(controller: &Controller<f32, POINTS>) -> Controller<f32, POINTS> {
    let (mut parameters, mut flows, mut sensitivity) = (PARAMETERS, FLOWS, 5.6e-5);
    match option_env!("EFT_FLIP") {
        Some("lead") => parameters.response_delay *= OFF,
        Some("load_pressure") => parameters.supply_pressure *= OFF,
        Some("table") => flows[11] *= OFF,
        Some("piston_area") => parameters.piston_area *= OFF,
        Some("force_sensitivity") => sensitivity *= OFF,
        _ => {}
    }
    made(&parameters, &flows, sensitivity).unwrap_or(*controller)
}

fn made(
    parameters: &CompensationParameters,
    flows: &[f64],
    force_sensitivity: f64,
) -> Option<Controller<f32, POINTS>> {
    let table = FlowTable::<f32, POINTS>::new(&OPENINGS, flows).ok()?;
    let gain = parameters.proportional_gain;
    Some(Controller {
        compensation: Compensation::<f32, POINTS>::new(parameters, &table).ok()?,
        servovalve: ServovalveController::<f32>::new(force_sensitivity, gain, 2.0e-4, SAMPLE_RATE).ok()?,
        limiter: eft_rigs::zhao2005::CONTROLLER.limiter,
    })
}
