//! The controller of `guarded` at 4096 Hz, exported by eft.
//!
//! The force loop is closed here: `CHANNEL.step` gives the valve command, V. The measured
//! displacement, m, is given with every sample. The measured supply pressure, Pa, is given with
//! every sample.
use eft_core::{
    Channel, Learner, Learning, Levels, Mode, Parameters, ProtectionParameters, Realization, SignFrom, VelocitySource,
};

/// Points of the flow table.
pub const POINTS: usize = 21;

/// The parameters of channel and learner.
pub const PARAMETERS: Parameters = Parameters {
    sample_rate: 4096.0, // Hz
    realization: Realization::Digital,
    mode: Mode::Nonlinear,
    level: 1.0, // 1
    sign_from: SignFrom::Spool,
    piston_area: 0.008212, // m2
    supply_pressure: 19000000.0, // Pa
    supply_correction: true,
    compressibility: 7.56e-13, // m3/Pa
    leakage: 1.3e-11, // m3/(s Pa)
    friction: 0.0, // N
    friction_velocity: 0.001, // m/s
    overlap: 0.0, // 1
    null_bias: 0.0, // 1
    openings: &[-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0], // 1
    flows: &[-0.008786743716800001, -0.008327905924799999, -0.0078690681328, -0.0074118690472, -0.0068809281735999995, -0.0061795618344, -0.0053126861488, -0.004275384997599999, -0.0030840454447999995, -0.001655093464, 0.0, 0.0016747579408, 0.0030676583807999996, 0.0042671914656, 0.0052618862504, 0.0060599362672, 0.006738360716799999, 0.007226695224, 0.0076740620712, 0.0081230676248, 0.008570434472], // m3/s
    flow_gain: 0.0164, // m3/s
    valve_gain: 0.1, // 1/V
    response_delay: 0.005, // s
    lead_alpha: 0.1, // 1
    velocity_source: VelocitySource::Observer { gains: [0.0688998387462796, 10.072327505043758, 736.1872211790367], mass: 7040.0 },
    velocity_delay: 1.1254828530642381e-7, // s
    computation_delay: 0, // samples
    feedforward: true,
    look_ahead: false,
    force_sensitivity: 5.6e-5, // V/N
    proportional_gain: 0.8059, // V/V
    derivative_gain: 0.0002, // s
    integral_gain: 0.0, // 1/s
    valve_command: 10.0, // V
    valve_command_rate: 20000.0, // V/s
    spool_warning: 0.6, // 1
    velocity_range: 3.0, // m/s
    force_range: 200000.0, // N
    spool_range: 1.2, // 1
    gap_time: 0.0025, // s
    learning: Learning {
        adaptive: true,
        curve_correction: true,
        guard: true,
        excitation: 0.0005, // 1
        flow_gain_bounds: [0.7, 1.35], // 1
        valve_gain_bounds: [0.8, 1.25], // 1
        response_delay_bounds: [0.2, 4.0], // 1
        age_limit: 1.0, // s
    },
    protection: Some(ProtectionParameters {
        force: Levels { warning: 40000.0, trip: 60000.0 }, // N
        displacement: Levels { warning: 0.1, trip: 0.12 }, // m
        velocity: Levels { warning: f64::MAX, trip: f64::MAX }, // m/s
        spool: Levels { warning: 0.95, trip: 0.95 }, // 1
        start_time: 0.5, // s
        ramp_time: 0.3, // s
        shutdown_time: 0.1, // s
        lost_samples: 5, // samples
        fault_time: 0.5, // s
        period_tolerance: 0.1, // 1
        oscillation_limit: f64::MAX, // N
        plausibility: None,
    }),
    stuck_samples: 0, // samples
};

/// The channel: the whole tick.
pub static CHANNEL: Channel<f32, POINTS> =
    match Channel::<f32, POINTS>::new(&PARAMETERS) {
        Ok(made) => made,
        Err(_) => panic!("refused"),
    };

/// The learner, which calibrates the channel.
pub static LEARNER: Learner<f32, POINTS> =
    match Learner::<f32, POINTS>::new(&PARAMETERS) {
        Ok(made) => made,
        Err(_) => panic!("refused"),
    };
