//! The controller of `uneven` at 5000 Hz, exported by eft.
//!
//! The force loop is closed here: `CONTROLLER.step` gives the valve command, V.
use eft_core::{
    Compensation, CompensationParameters, Controller, FlowTable, Limiter, Mode,
    ServovalveController, SignFrom,
};

/// Points of the flow table.
pub const POINTS: usize = 9;
/// Sample rate (Hz).
pub const SAMPLE_RATE: f64 = 5000.0;

macro_rules! checked {
    ($made:expr) => {
        match $made {
            Ok(made) => made,
            Err(_) => panic!("refused"),
        }
    };
}

/// Spool openings (1).
pub const OPENINGS: [f64; POINTS] = [-1.0, -0.62, -0.2, -0.05, -0.04, 0.0, 0.03, 0.25, 1.0];
/// Flows (m³/s).
pub const FLOWS: [f64; POINTS] = [-0.0101, -0.0083, -0.0034, -0.0006, -0.0004, 0.0, 0.0005, 0.0045, 0.0107];

/// What the compensation is made from.
pub const PARAMETERS: CompensationParameters = CompensationParameters {
    mode: Mode::Nonlinear,
    sign_from: SignFrom::Demand,
    level: 1.02, // 1
    piston_area: 0.0113, // m2
    supply_pressure: 20700000.0, // Pa
    flow_gain: 0.0164, // m3/s
    valve_gain: 0.12, // 1/V
    response_delay: 0.0041, // s
    lead_alpha: 0.15, // 1
    spool_warning: 0.5, // 1
    velocity_range: 1.1, // m/s
    force_range: 220000.0, // N
    spool_range: 1.15, // 1
    sample_rate: SAMPLE_RATE,
    proportional_gain: 0.61, // V/V
};

/// The controller.
pub static CONTROLLER: Controller<f32, POINTS> = {
    let table = checked!(FlowTable::<f32, POINTS>::new(&OPENINGS, &FLOWS));
    Controller {
        compensation: checked!(Compensation::<f32, POINTS>::new(&PARAMETERS, &table)),
        // Force sensitivity (V/N), proportional gain (V/V), derivative gain (s).
        servovalve: checked!(ServovalveController::<f32>::new(7.1e-5, 0.61, 0.0002, SAMPLE_RATE)),
        // Largest valve command (V) and rate (V/s).
        limiter: checked!(Limiter::<f32>::new(8.0, 4000.0, SAMPLE_RATE)),
    }
};
