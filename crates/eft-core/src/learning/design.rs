//! The numbers that a learner is made of, from the rig's parameters, in double precision.

use crate::compensation::null_bias;
use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::learning::tuning as t;
use crate::parameters::Parameters;

/// Largest computation delay (samples).
const MOST_COMPUTATION: f64 = 1000.0;
/// Bounds (1) of the gains' bounds.
const GAINS: [f64; 2] = [0.01, 100.0];
/// Longest response delay (s) that can be learned, and longest lag (samples) of the lead network. With such a lag its pole is
/// below 1 in single precision.
const LONGEST_DELAY: f64 = 10.0;
const LONGEST_LAG: f64 = 524_288.0;
/// Least intended number of windows per second (Hz).
const WINDOW_RATE: f64 = 200.0;
/// Ticks of the shortest window.
const SHORTEST: u32 = 8;

/// Ticks of a window at a sample rate (Hz): a power of two, the shortest for NaN.
pub const fn window_ticks(sample_rate: f64) -> u32 {
    let mut ticks = SHORTEST;
    while ticks < 1024 && sample_rate / (2.0 * ticks as f64) >= WINDOW_RATE {
        ticks *= 2;
    }
    ticks
}

/// Lowest sample rate (Hz) of the learner. Below it there are too few windows for its filters.
pub(crate) const LOWEST_RATE: f64 = 200.0;

/// Checked parameters and what follows from them; times in s.
#[derive(Clone, Copy)]
pub(super) struct Design {
    /// Sample period of the channel.
    pub(super) sample: f64,
    /// Period of the learner, one window.
    pub(super) period: f64,
    /// Area of the piston (m²).
    pub(super) area: f64,
    /// Flow (m³/s) per force (N), and per change of force (N) over a window.
    pub(super) leak: f64,
    pub(super) volume: f64,
    /// Supply pressure (Pa).
    pub(super) pressure: f64,
    /// Flow (m³/s) per unit opening.
    pub(super) flow_gain: f64,
    /// Flow (m³/s) of the force loop per force error (N).
    pub(super) loop_gain: f64,
    /// Integral part of the force loop over the proportional one (1/s).
    pub(super) integral: f64,
    /// Response delay of the valve at the start, and its bounds.
    pub(super) delay: f64,
    pub(super) delays: [f64; 2],
    /// Known delay of the velocity, and the bounds of the learned one.
    pub(super) velocity_delay: f64,
    pub(super) velocity_delays: [f64; 2],
    /// Bounds of flow gain and valve gain (1).
    pub(super) flow_gains: [f64; 2],
    pub(super) valve_gains: [f64; 2],
    /// Known null bias of the valve (1).
    pub(super) null_bias: f64,
    /// Least opening (1) from which anything is learned.
    pub(super) excitation: f64,
}

impl Design {
    /// Refuses a parameter out of its range, by name. It is inlined so that the stack does not hold a design and its copies.
    #[inline(always)]
    pub(super) const fn of(p: &Parameters) -> Result<Self, ConfigError> {
        check!(within("sample_rate", p.sample_rate, LOWEST_RATE, LARGEST));
        check!(within("computation_delay", p.computation_delay as f64, 0.0, MOST_COMPUTATION));
        let l = &p.learning;
        let sample = 1.0 / p.sample_rate;
        let period = window_ticks(p.sample_rate) as f64 * sample;
        // The actuator, sampled once a window.
        let area = check!(positive("piston_area", p.piston_area));
        let volume = check!(positive("compressibility", p.compressibility)) / area / period;
        let leak = check!(within("leakage", p.leakage, 0.0, LARGEST)) / area;
        let pressure = check!(positive("supply_pressure", p.supply_pressure));
        let flow_gain = check!(positive("flow_gain", p.flow_gain));
        let loop_gain = check!(positive("force_sensitivity", p.force_sensitivity))
            * p.proportional_gain
            * p.valve_gain
            * flow_gain;
        let integral = check!(within("integral_gain", p.integral_gain, 0.0, LARGEST));
        let integral = if p.integrates() { integral / p.proportional_gain } else { 0.0 };
        // The valve's delay, at least the shortest that is learned.
        let [least, most] = check!(bounds("response_delay_bounds", l.response_delay_bounds));
        let shortest = larger(least * p.response_delay, t::SHORTEST_DELAY * sample);
        let longest = larger(most * p.response_delay, shortest);
        check!(within("response_delay_bounds", longest, 0.0, LONGEST_DELAY));
        let delay = larger(p.response_delay, shortest);
        let velocity_delay = check!(within("velocity_delay", p.velocity_delay, 0.0, 1.0));
        let [lead, lag] = t::VELOCITY_DELAY_REACH;
        let velocity_delays = [velocity_delay + lead * delay, velocity_delay + lag * delay];
        let flow_gains = check!(gains("flow_gain_bounds", l.flow_gain_bounds));
        let valve_gains = check!(gains("valve_gain_bounds", l.valve_gain_bounds));
        let null_bias = check!(null_bias(p));
        let excitation = check!(positive("excitation", l.excitation));
        let [_, latest] = velocity_delays;
        let slowest = larger(longest, delay) + (1.0 + t::LARGEST_DEFICIT) * latest;
        check!(decaying(p.lead_alpha, slowest, sample));
        Ok(Self {
            sample,
            period,
            area,
            leak,
            volume,
            pressure,
            flow_gain,
            loop_gain,
            integral,
            delay,
            delays: [shortest, longest],
            velocity_delay,
            velocity_delays,
            flow_gains,
            valve_gains,
            null_bias,
            excitation,
        })
    }
}

/// Share by which the phase of a lead network with this `α` falls short of its delay's, over the square of the phase.
pub(super) const fn phase_deficit(alpha: f64) -> f64 {
    1.0 / 3.0 + alpha / ((1.0 - alpha) * (1.0 - alpha))
}

/// The larger number; the second for NaN.
const fn larger(one: f64, other: f64) -> f64 {
    if one > other { one } else { other }
}

/// Refuses bounds without a value between them.
const fn bounds(parameter: &'static str, [lowest, highest]: [f64; 2]) -> Result<[f64; 2], ConfigError> {
    check!(within(parameter, highest, check!(positive(parameter, lowest)), LARGEST));
    Ok([lowest, highest])
}

/// The same for a gain.
const fn gains(parameter: &'static str, [lowest, highest]: [f64; 2]) -> Result<[f64; 2], ConfigError> {
    let [least, most] = GAINS;
    check!(within(parameter, highest, check!(within(parameter, lowest, least, most)), most));
    Ok([lowest, highest])
}

/// Refuses a lead network whose lag is too long at the longest delay (s), in samples of this period (s).
const fn decaying(alpha: f64, delay: f64, sample: f64) -> Result<f64, ConfigError> {
    let most = LONGEST_LAG * sample / delay;
    within("lead_alpha", alpha, 0.0, most / (2.0 + most))
}
