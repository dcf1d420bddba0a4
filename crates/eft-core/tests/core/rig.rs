//! The paper's rig and random ones, for every test of the core.

use eft_core::{
    Channel, ChannelState, ConfigError, FlowTable, Input, Learning, Mode, Output, Parameters, Real, SignFrom,
};
use proptest::prelude::*;

/// m³ per in³.
pub(crate) const IN3: f64 = 1.6387064e-5;

/// The paper's rig at 4096 Hz, with plausible measuring ranges.
pub(crate) const PARAMETERS: Parameters<'static> =
    Parameters { velocity_range: 3.0, force_range: 2.0e5, spool_range: 1.2, ..Parameters::ZHAO2005 };

/// The same with limits, feedforward, estimators and guard.
pub(crate) const LEARNING: Parameters<'static> = Parameters {
    valve_command: 10.0,
    valve_command_rate: 2.0e4,
    feedforward: true,
    learning: Learning::ADAPTIVE,
    ..PARAMETERS
};

/// The paper's flow table.
pub(crate) fn table() -> FlowTable<f64, 21> {
    FlowTable::<f64, 21>::new(PARAMETERS.openings, PARAMETERS.flows).unwrap()
}

/// One tick. It is compiled here once: [`Channel::step`] is inlined wherever it is called.
#[inline(never)]
pub(crate) fn tick<T: Real, const N: usize>(
    channel: &Channel<T, N>,
    state: &mut ChannelState<T>,
    input: &Input<T>,
) -> Output<T> {
    channel.step(state, input)
}

/// The name of the refused parameter.
pub(crate) fn refused<T>(made: Result<T, ConfigError>) -> &'static str {
    match made {
        Ok(_) => "accepted",
        Err(
            ConfigError::NotFinite { parameter }
            | ConfigError::NotPositive { parameter, .. }
            | ConfigError::OutOfRange { parameter, .. },
        ) => parameter,
        Err(_) => "another error",
    }
}

/// The true valve relative to the controller's configuration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Valve {
    /// True flow over the table's (1).
    pub(crate) flow_gain: f64,
    /// The spool's gain over the configured one (1).
    pub(crate) valve_gain: f64,
    /// Delay of the spool after its command (s).
    pub(crate) delay: f64,
}

/// The configured valve.
pub(crate) const SOUND: Valve = Valve { flow_gain: 1.0, valve_gain: 1.0, delay: 5.0e-3 };

impl Valve {
    /// The measurements at a time (s) of a swing, with a force (N) in phase with the velocity (m/s).
    pub(crate) fn swing(&self, time: f64, force_per_velocity: f64) -> Input<f64> {
        let wave = |time: f64| 0.3 * (std::f64::consts::TAU * 0.8 * time).sin();
        let spool = self.valve_gain * wave(time - self.delay);
        let velocity = self.flow_gain * table().flow(spool) / PARAMETERS.piston_area;
        Input {
            command: 0.0,
            velocity,
            force: force_per_velocity * velocity,
            spool,
            supply_pressure: PARAMETERS.supply_pressure,
            valve_command: wave(time) / PARAMETERS.valve_gain,
            ..Input::default()
        }
    }
}

/// An input in `f32`.
pub(crate) fn single(i: &Input<f64>) -> Input<f32> {
    Input {
        command: i.command as f32,
        velocity: i.velocity as f32,
        force: i.force as f32,
        spool: i.spool as f32,
        displacement: i.displacement as f32,
        acceleration: i.acceleration as f32,
        supply_pressure: i.supply_pressure as f32,
        next_command: i.next_command as f32,
        valve_command: i.valve_command as f32,
        alive: i.alive as f32,
        period: i.period as f32,
        load_pressure: i.load_pressure as f32,
    }
}

/// The same in `f64`.
pub(crate) fn double(i: &Input<f64>) -> Input<f64> {
    *i
}

/// Values that no sensor should give, and limit cases of valid ones.
pub(crate) const SPECIAL: [f64; 16] = [
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
pub(crate) fn tables(longest: usize) -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
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

/// Any number from a sensor: plausible, far out of range, or special.
pub(crate) fn samples(scale: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => (-1.0..1.0f64).prop_map(move |x| x * scale),
        2 => (-2.0..2.0f64).prop_map(move |x| x * scale),
        1 => any::<f64>(),
        1 => prop::sample::select(SPECIAL.to_vec()),
    ]
}

/// One tick's command (N), velocity (m/s), force (N) and spool (1).
pub(crate) fn ticks() -> impl Strategy<Value = [f64; 4]> {
    [samples(1.0e5), samples(2.0), samples(1.56e5), samples(1.1)]
}

/// One tick with any numbers.
pub(crate) fn inputs() -> impl Strategy<Value = Input<f64>> {
    let supply = prop_oneof![8 => 1.0e7..2.2e7f64, 1 => samples(1.9e7)];
    (ticks(), supply, [samples(0.1), samples(20.0), samples(1.0e5), samples(8.0)]).prop_map(
        |([command, velocity, force, spool], supply_pressure, [x, a, next_command, valve_command])| Input {
            command,
            velocity,
            force,
            spool,
            displacement: x,
            acceleration: a,
            supply_pressure,
            next_command,
            valve_command,
            ..Input::default()
        },
    )
}

/// Integral gain (1/s), friction (N), overlap (1) and null bias (1), each absent in half of the rigs.
fn wear() -> impl Strategy<Value = [f64; 4]> {
    let up_to = |most: f64| prop_oneof![Just(0.0), 0.0..most];
    let bias = prop_oneof![Just(0.0), -0.5..0.5f64];
    [up_to(40.0).boxed(), up_to(5.0e3).boxed(), up_to(0.05).boxed(), bias.boxed()]
}

/// Parameters near the paper's.
pub(crate) fn parameters() -> impl Strategy<Value = Parameters<'static>> {
    let mode = prop::sample::select(vec![Mode::Off, Mode::Linear, Mode::Nonlinear]);
    let sign = prop::sample::select(vec![SignFrom::Spool, SignFrom::Demand]);
    (mode, sign, 0.0..2.0f64, 0.0..0.02f64, 0.02..0.9f64, 500.0..20_000.0f64, wear()).prop_map(
        |(mode, sign_from, level, response_delay, lead_alpha, sample_rate, wear)| Parameters {
            integral_gain: wear[0],
            friction: wear[1],
            overlap: wear[2],
            null_bias: wear[3],
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
