//! The controller of `uneven` at 5000 Hz, exported by eft.
//!
//! The force loop is closed here: `CHANNEL.step` gives the valve command, V. The protection is off:
//! no level, fault or request trips.
use eft_core::{
    Channel, Learning, Mode, Parameters, Realization, SignFrom, VelocitySource,
};

/// Points of the flow table.
pub const POINTS: usize = 9;

/// The parameters of channel and learner.
pub const PARAMETERS: Parameters = Parameters {
    sample_rate: 5000.0, // Hz
    realization: Realization::Digital,
    mode: Mode::Nonlinear,
    level: 1.02, // 1
    sign_from: SignFrom::Demand,
    piston_area: 0.0113, // m2
    supply_pressure: 20700000.0, // Pa
    supply_correction: false,
    compressibility: 7.56e-13, // m3/Pa
    leakage: 1.3e-11, // m3/(s Pa)
    friction: 0.0, // N
    friction_velocity: 0.001, // m/s
    overlap: 0.0, // 1
    null_bias: 0.0, // 1
    openings: &[-1.0, -0.62, -0.2, -0.05, -0.04, 0.0, 0.03, 0.25, 1.0], // 1
    flows: &[-0.0101, -0.0083, -0.0034, -0.0006, -0.0004, 0.0, 0.0005, 0.0045, 0.0107], // m3/s
    flow_gain: 0.0164, // m3/s
    valve_gain: 0.12, // 1/V
    response_delay: 0.0041, // s
    lead_alpha: 0.15, // 1
    velocity_source: VelocitySource::Sensor,
    velocity_delay: 0.0, // s
    computation_delay: 0, // samples
    feedforward: false,
    look_ahead: false,
    force_sensitivity: 7.1e-5, // V/N
    proportional_gain: 0.61, // V/V
    derivative_gain: 0.0002, // s
    integral_gain: 0.0, // 1/s
    valve_command: 8.0, // V
    valve_command_rate: 4000.0, // V/s
    spool_warning: 0.5, // 1
    velocity_range: 1.1, // m/s
    force_range: 220000.0, // N
    spool_range: 1.15, // 1
    gap_time: 0.0025, // s
    learning: Learning {
        adaptive: false,
        curve_correction: false,
        guard: false,
        excitation: 0.0005, // 1
        flow_gain_bounds: [0.7, 1.35], // 1
        valve_gain_bounds: [0.8, 1.25], // 1
        response_delay_bounds: [0.2, 4.0], // 1
        age_limit: 1.0, // s
    },
    protection: None,
    stuck_samples: 0, // samples
};

/// The channel: the whole tick.
pub static CHANNEL: Channel<f32, POINTS> =
    match Channel::<f32, POINTS>::new(&PARAMETERS) {
        Ok(made) => made,
        Err(_) => panic!("refused"),
    };
