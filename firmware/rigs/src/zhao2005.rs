//! The controller of `zhao2005` at 4096 Hz, exported by eft.
//!
//! An analog controller closes the force loop of this rig: `CONTROLLER.compensation.step` gives the
//! compensation signal, V, that is added to its force error; `CONTROLLER.step` would close the loop
//! as well.
use eft_core::{
    Compensation, CompensationParameters, Controller, FlowTable, Limiter, Mode,
    ServovalveController, SignFrom,
};

/// Points of the flow table.
pub const POINTS: usize = 21;
/// Sample rate (Hz).
pub const SAMPLE_RATE: f64 = 4096.0;

macro_rules! checked {
    ($made:expr) => {
        match $made {
            Ok(made) => made,
            Err(_) => panic!("refused"),
        }
    };
}

/// Spool openings (1).
pub const OPENINGS: [f64; POINTS] = [-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
/// Flows (m³/s).
pub const FLOWS: [f64; POINTS] = [-0.008786743716800001, -0.008327905924799999, -0.0078690681328, -0.0074118690472, -0.0068809281735999995, -0.0061795618344, -0.0053126861488, -0.004275384997599999, -0.0030840454447999995, -0.001655093464, 0.0, 0.0016747579408, 0.0030676583807999996, 0.0042671914656, 0.0052618862504, 0.0060599362672, 0.006738360716799999, 0.007226695224, 0.0076740620712, 0.0081230676248, 0.008570434472];

/// What the compensation is made from.
pub const PARAMETERS: CompensationParameters = CompensationParameters {
    mode: Mode::Nonlinear,
    sign_from: SignFrom::Spool,
    level: 1.0, // 1
    piston_area: 0.008212, // m2
    supply_pressure: 19000000.0, // Pa
    flow_gain: 0.0164, // m3/s
    valve_gain: 0.1, // 1/V
    response_delay: 0.005, // s
    lead_alpha: 0.1, // 1
    spool_warning: 0.6, // 1
    velocity_range: 3.4028234663852886e38, // m/s
    force_range: 3.4028234663852886e38, // N
    spool_range: 3.4028234663852886e38, // 1
    sample_rate: SAMPLE_RATE,
    proportional_gain: 0.8059, // V/V
};

/// The controller.
pub static CONTROLLER: Controller<f32, POINTS> = {
    let table = checked!(FlowTable::<f32, POINTS>::new(&OPENINGS, &FLOWS));
    Controller {
        compensation: checked!(Compensation::<f32, POINTS>::new(&PARAMETERS, &table)),
        // Force sensitivity (V/N), proportional gain (V/V), derivative gain (s).
        servovalve: checked!(ServovalveController::<f32>::new(5.6e-5, 0.8059, 0.0002, SAMPLE_RATE)),
        // Largest valve command (V) and rate (V/s).
        limiter: checked!(Limiter::<f32>::new(f64::MAX, f64::MAX, SAMPLE_RATE)),
    }
};
