//! Rigs for the core and, by the same numbers, for C.

use eft_core::{
    FlowTable, Learning, Levels, Mode, Parameters, PlausibilityParameters, ProtectionParameters, Realization,
    SignFrom, VelocitySource,
};
use eft_ffi::*;

const GAINS: [f64; 3] = [0.05, 5.0, 50.0];

/// The paper's rig with plausible ranges, and all that learns.
pub(crate) const LEARNING: Parameters = Parameters {
    feedforward: true,
    valve_command: 10.0,
    valve_command_rate: 2.0e4,
    velocity_range: 3.0,
    force_range: 2.0e5,
    spool_range: 1.2,
    gap_time: 0.02,
    learning: Learning { curve_correction: true, ..Learning::ADAPTIVE },
    ..Parameters::ZHAO2005
};

const PROTECTION: ProtectionParameters = ProtectionParameters {
    force: Levels { warning: 8.0e3, trip: 1.2e4 },
    displacement: Levels { warning: 0.5, trip: 0.6 },
    velocity: Levels { warning: 2.0, trip: 2.5 },
    spool: Levels { warning: 0.7, trip: 0.95 },
    start_time: 0.01,
    ramp_time: 0.2,
    shutdown_time: 0.1,
    lost_samples: 3,
    fault_time: f64::MAX,
    period_tolerance: 0.2,
    oscillation_limit: 2.0e3,
    plausibility: None,
};

/// The same behind an observer and a protection.
pub(crate) const GUARDED: Parameters = Parameters {
    velocity_source: VelocitySource::Observer { gains: GAINS, mass: 7040.0 },
    supply_correction: true,
    protection: Some(PROTECTION),
    stuck_samples: 50,
    ..LEARNING
};

/// Rigs in which each field of the parameters counts at least once.
pub(crate) const RIGS: [Parameters; 7] = [
    Parameters::ZHAO2005,
    Parameters { realization: Realization::Analog, ..LEARNING },
    LEARNING,
    GUARDED,
    Parameters {
        velocity_source: VelocitySource::Derivative { corner: 80.0 },
        sign_from: SignFrom::Demand,
        look_ahead: true,
        velocity_delay: 1.0e-3,
        computation_delay: 2,
        protection: Some(ProtectionParameters {
            fault_time: 0.5,
            plausibility: Some(PlausibilityParameters::DEFAULT),
            ..PROTECTION
        }),
        ..GUARDED
    },
    Parameters {
        velocity_source: VelocitySource::Accelerometer { gains: GAINS },
        realization: Realization::Analog,
        ..GUARDED
    },
    Parameters { mode: Mode::Linear, level: 0.9, feedforward: true, ..Parameters::ZHAO2005 },
];

/// The same for C.
pub(crate) fn for_c(p: &Parameters) -> eft_parameters {
    let (mut openings, mut flows) = ([0.0; EFT_TABLE_CAPACITY], [0.0; EFT_TABLE_CAPACITY]);
    openings[..p.openings.len()].copy_from_slice(p.openings);
    flows[..p.flows.len()].copy_from_slice(p.flows);
    let (source, corner, gains, mass) = match p.velocity_source {
        VelocitySource::Sensor => (EFT_VELOCITY_SENSOR, 0.0, [0.0; 3], 0.0),
        VelocitySource::Derivative { corner } => (EFT_VELOCITY_DERIVATIVE, corner, [0.0; 3], 0.0),
        VelocitySource::Observer { gains, mass } => (EFT_VELOCITY_OBSERVER, 0.0, gains, mass),
        VelocitySource::Accelerometer { gains } => (EFT_VELOCITY_ACCELEROMETER, 0.0, gains, 0.0),
    };
    let (l, g) = (&p.learning, p.protection.unwrap_or(ProtectionParameters::DEFAULT));
    let w = g.plausibility.unwrap_or(PlausibilityParameters::DEFAULT);
    eft_parameters {
        sample_rate: p.sample_rate,
        realization: match p.realization {
            Realization::Digital => EFT_REALIZATION_DIGITAL,
            Realization::Analog => EFT_REALIZATION_ANALOG,
        },
        mode: match p.mode {
            Mode::Off => EFT_MODE_OFF,
            Mode::Linear => EFT_MODE_LINEAR,
            Mode::Nonlinear => EFT_MODE_NONLINEAR,
        },
        level: p.level,
        sign_from: match p.sign_from {
            SignFrom::Spool => EFT_SIGN_FROM_SPOOL,
            SignFrom::Demand => EFT_SIGN_FROM_DEMAND,
        },
        piston_area: p.piston_area,
        supply_pressure: p.supply_pressure,
        supply_correction: p.supply_correction.into(),
        compressibility: p.compressibility,
        leakage: p.leakage,
        friction: p.friction,
        friction_velocity: p.friction_velocity,
        overlap: p.overlap,
        null_bias: p.null_bias,
        table_length: p.openings.len() as u32,
        openings,
        flows,
        flow_gain: p.flow_gain,
        valve_gain: p.valve_gain,
        response_delay: p.response_delay,
        lead_alpha: p.lead_alpha,
        velocity_source: source,
        corner,
        gain_on_displacement: gains[0],
        gain_on_velocity: gains[1],
        gain_on_drift: gains[2],
        mass,
        velocity_delay: p.velocity_delay,
        computation_delay: p.computation_delay,
        feedforward: p.feedforward.into(),
        look_ahead: p.look_ahead.into(),
        force_sensitivity: p.force_sensitivity,
        proportional_gain: p.proportional_gain,
        derivative_gain: p.derivative_gain,
        integral_gain: p.integral_gain,
        valve_command: p.valve_command,
        valve_command_rate: p.valve_command_rate,
        spool_warning: p.spool_warning,
        velocity_range: p.velocity_range,
        force_range: p.force_range,
        spool_range: p.spool_range,
        gap_time: p.gap_time,
        learning: eft_learning {
            adaptive: l.adaptive.into(),
            curve_correction: l.curve_correction.into(),
            guard: l.guard.into(),
            excitation: l.excitation,
            flow_gain_bounds: l.flow_gain_bounds,
            valve_gain_bounds: l.valve_gain_bounds,
            response_delay_bounds: l.response_delay_bounds,
            age_limit: l.age_limit,
        },
        protection: eft_protection {
            enabled: p.protection.is_some().into(),
            force_warning: g.force.warning,
            force_trip: g.force.trip,
            displacement_warning: g.displacement.warning,
            displacement_trip: g.displacement.trip,
            velocity_warning: g.velocity.warning,
            velocity_trip: g.velocity.trip,
            spool_warning: g.spool.warning,
            spool_trip: g.spool.trip,
            start_time: g.start_time,
            ramp_time: g.ramp_time,
            shutdown_time: g.shutdown_time,
            lost_samples: g.lost_samples,
            fault_time: g.fault_time,
            period_tolerance: g.period_tolerance,
            oscillation_limit: g.oscillation_limit,
            plausibility: eft_plausibility {
                enabled: g.plausibility.is_some().into(),
                force_noise: w.force_noise,
                displacement_noise: w.displacement_noise,
                velocity_noise: w.velocity_noise,
                spool_noise: w.spool_noise,
                load_pressure_tolerance: w.load_pressure_tolerance,
                false_alarms: w.false_alarms,
                settle_time: w.settle_time,
            },
        },
        stuck_samples: p.stuck_samples,
    }
}

/// What a channel in C is made of, single precision: zero bytes, as of a C program's statics.
pub(crate) fn zeroed<T>() -> Box<T> {
    // Safety: of the interface's structs, in which zero bytes are a value.
    Box::new(unsafe { std::mem::zeroed() })
}

/// A configured channel with its state, at rest.
pub(crate) fn at_rest(p: &eft_parameters) -> (Box<eft_channel<f32>>, Box<eft_state<f32>>) {
    let (mut channel, mut state) = (zeroed(), zeroed());
    // Safety: valid pointers.
    unsafe {
        assert_eq!(eft_configure_f32(p, &mut *channel, std::ptr::null_mut()), EFT_OK);
        assert_eq!(eft_reset_f32(&*channel, &mut *state), EFT_OK);
    }
    (channel, state)
}

/// As [`at_rest`], of a learner.
pub(crate) fn nothing_learned(p: &eft_parameters) -> (Box<eft_learner<f32>>, Box<eft_learner_state<f32>>) {
    let (mut learner, mut state) = (zeroed(), zeroed());
    // Safety: valid pointers.
    unsafe {
        assert_eq!(eft_learner_configure_f32(p, &mut *learner, std::ptr::null_mut()), EFT_OK);
        assert_eq!(eft_learner_reset_f32(&*learner, &mut *state), EFT_OK);
    }
    (learner, state)
}

pub(crate) static TABLE: FlowTable<f64, 21> =
    match FlowTable::<f64, 21>::new(LEARNING.openings, LEARNING.flows) {
        Ok(table) => table,
        Err(_) => panic!("the paper's table is refused"),
    };

/// A rig that swings, its valve passing 5 % more than the table says and following its command of 5 ms before; now and
/// then a sample is lost.
pub(crate) fn sample(tick: u32) -> [f64; 9] {
    const RATE: f64 = 4096.0;
    let displacement = |t: f64| -(0.016 + 0.006 * (0.000_23 * t).sin()) * (0.0061 * t).cos();
    let velocity = |t: f64| (displacement(t + 0.1) - displacement(t - 0.1)) * 5.0 * RATE;
    let opening = |t: f64| TABLE.opening(LEARNING.piston_area * velocity(t) / 1.05);
    let t = f64::from(tick);
    let noise = 1.0e-4 * f64::from(tick.wrapping_mul(2_654_435_761) >> 16) / 65_536.0;
    let lost = if tick % 1009 == 1008 { f64::NAN } else { 1.0 };
    [
        3.0e3 * (0.0061 * t).sin(),
        velocity(t) + noise,
        lost * (2.9e3 * (0.0061 * t - 0.03).sin() + noise),
        opening(t) + noise,
        displacement(t) + 0.01 * noise,
        (velocity(t + 0.5) - velocity(t - 0.5)) * RATE + noise,
        1.9e7,
        3.0e3 * (0.0061 * (t + 1.0)).sin(),
        opening(t + 20.5) / LEARNING.valve_gain,
    ]
}
