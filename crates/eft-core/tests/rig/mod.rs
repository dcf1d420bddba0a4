//! The paper's rig and random ones, for every test of the core.
#![allow(dead_code, unreachable_pub)] // no test uses all of it

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveParameters, CompensationParameters, FlowTable, Limiter,
    Mode, ServovalveController, SignFrom, Tuning,
};
use proptest::prelude::*;

pub const IN3: f64 = 1.6387064e-5;
/// Table 2 with the origin, openings (1) and flows (in³/s).
pub const OPENINGS: [f64; 21] = [
    -1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8,
    0.9, 1.0,
];
pub const FLOWS_IN3: [f64; 21] = [
    -536.2, -508.2, -480.2, -452.3, -419.9, -377.1, -324.2, -260.9, -188.2, -101.0, 0.0, 102.2, 187.2, 260.4,
    321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0,
];

/// Table 2 in m³/s.
pub const fn flows() -> [f64; 21] {
    let mut flows = FLOWS_IN3;
    let mut i = 0;
    while i < 21 {
        flows[i] *= IN3;
        i += 1;
    }
    flows
}

/// The paper's compensation at 4096 Hz, with plausible measuring ranges.
pub const PARAMETERS: CompensationParameters = CompensationParameters {
    mode: Mode::Nonlinear,
    level: 1.0,
    piston_area: 8.212e-3,
    supply_pressure: 1.9e7,
    flow_gain: 1.64e-2,
    valve_gain: 0.1,
    proportional_gain: 0.8059,
    response_delay: 5.0e-3,
    lead_alpha: 0.1,
    sample_rate: 4096.0,
    sign_from: SignFrom::Spool,
    spool_warning: 0.6,
    velocity_range: 3.0,
    force_range: 2.0e5,
    spool_range: 1.2,
};

/// The same with feedforward, estimators and guard.
pub const ADAPTIVE: AdaptiveParameters = AdaptiveParameters {
    compensation: PARAMETERS,
    compressibility: 7.56e-13,
    leakage: 1.3e-11,
    force_sensitivity: 5.6e-5,
    computation_delay: 0,
    velocity_delay: 0.0,
    feedforward: true,
    adaptive: true,
    correct_curve: false,
    guard: true,
    tuning: Tuning::DEFAULT,
};

macro_rules! adaptive {
    ($name:ident, $t:ty) => {
        /// The whole adaptive controller of these parameters.
        pub fn $name(p: &AdaptiveParameters, table: &FlowTable<$t, 21>) -> AdaptiveController<$t, 21> {
            let rate = p.compensation.sample_rate;
            let gain = p.compensation.proportional_gain;
            AdaptiveController {
                compensation: AdaptiveCompensation::<$t, 21>::new(p, table).unwrap(),
                servovalve: ServovalveController::<$t>::new(p.force_sensitivity, gain, 2.0e-4, rate).unwrap(),
                limiter: Limiter::<$t>::new(10.0, 2.0e4, rate).unwrap(),
            }
        }
    };
}
adaptive!(adaptive_f32, f32);
adaptive!(adaptive_f64, f64);

/// What no sensor should say, and some corners of what it may.
pub const SPECIAL: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f32::MAX as f64,
    f32::MIN as f64,
    f32::MIN_POSITIVE as f64,
    f64::MIN_POSITIVE,
    5e-324,
    1e-45,
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e30,
];

/// Strictly increasing abscissae and values, up to `longest` knots, of very different spacings.
pub fn tables(longest: usize) -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    let step = (0.0..3.0f64, 0.1..1.0f64).prop_map(|(decades, m)| m * 10f64.powf(-decades));
    let steps = prop::collection::vec((step.clone(), step), 1..longest);
    (steps, -1.0..1.0f64, -1.0..1.0f64).prop_map(|(steps, x0, y0)| {
        let (mut xs, mut ys) = (vec![x0], vec![y0]);
        for (dx, dy) in steps {
            xs.push(xs[xs.len() - 1] + dx);
            ys.push(ys[ys.len() - 1] + dy);
        }
        (xs, ys)
    })
}

/// Any number a sensor may send: plausible, wild, special.
pub fn samples(scale: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => (-1.0..1.0f64).prop_map(move |x| x * scale),
        2 => (-2.0..2.0f64).prop_map(move |x| x * scale),
        1 => any::<f64>(),
        1 => prop::sample::select(SPECIAL.to_vec()),
    ]
}

/// One tick's command (N), velocity (m/s), force (N) and spool (1).
pub fn ticks() -> impl Strategy<Value = [f64; 4]> {
    [samples(1.0e5), samples(2.0), samples(1.56e5), samples(1.1)]
}

/// Parameters around the paper's.
pub fn parameters() -> impl Strategy<Value = CompensationParameters> {
    let mode = prop::sample::select(vec![Mode::Off, Mode::Linear, Mode::Nonlinear]);
    let sign = prop::sample::select(vec![SignFrom::Spool, SignFrom::Demand]);
    (mode, sign, 0.0..2.0f64, 0.0..0.02f64, 0.02..0.9f64, 500.0..20_000.0f64).prop_map(
        |(mode, sign_from, level, response_delay, lead_alpha, sample_rate)| CompensationParameters {
            mode,
            sign_from,
            level,
            response_delay,
            lead_alpha,
            sample_rate,
            ..PARAMETERS
        },
    )
}
