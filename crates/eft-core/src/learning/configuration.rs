//! A learner from the rig's parameters.

use crate::compensation::{CurveGrid, LeadNetwork, null_bias};
use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::learning::band_filter::{BandFilter, end_taps};
use crate::learning::deviation::Deviation;
use crate::learning::flow::FlowEstimator;
use crate::learning::flow_curve::FlowCurve;
use crate::learning::flow_model::FlowModel;
use crate::learning::gate::Gate;
use crate::learning::guard::{Guard, tuning as guard};
use crate::learning::learner::{Largest, Learner};
use crate::learning::least_squares::{Priors, Range};
use crate::learning::tuning as t;
use crate::learning::valve::ValveEstimator;
use crate::parameters::{Mode, Parameters};

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
/// Least and largest ratio (1) of the flow gain to the table's greatest flow.
const LEAST_FLOW_GAIN: f64 = 1.0e-3;
const LARGEST_FLOW_GAIN: f64 = 1.0e3;
/// Ticks of the shortest window.
const SHORTEST: u32 = 8;
/// Lowest sample rate (Hz) of the learner. Below it there are too few windows for its filters.
pub(crate) const LOWEST_RATE: f64 = 200.0;

/// Ticks of a window at a sample rate (Hz): a power of two, the shortest for NaN.
pub const fn window_ticks(sample_rate: f64) -> u32 {
    let mut ticks = SHORTEST;
    while ticks < 1024 && sample_rate / (2.0 * ticks as f64) >= WINDOW_RATE {
        ticks *= 2;
    }
    ticks
}

/// Windows in a time (s), rounded up.
const fn windows(time: f64, period: f64) -> u32 {
    let whole = (time / period) as u32;
    if whole as f64 * period < time { whole + 1 } else { whole }
}

/// Coefficient of a first-order low-pass with this corner (rad/s) and period (s), by Tustin's rule without its zero.
const fn share(corner: f64, period: f64) -> f64 {
    let angle = corner * period;
    angle / (1.0 + 0.5 * angle)
}

/// Variance (1) of noise of variance 1 after three symmetric taps with these end taps and the sum 1, and two equal low-passes with
/// this coefficient. It follows from the autocovariance of noise after the low-passes.
const fn noise_passed(ends: f64, share: f64) -> f64 {
    let (middle, pole) = (1.0 - 2.0 * ends, 1.0 - share);
    let (kept, rest) = (pole * pole, 1.0 - pole * pole);
    let after_low_passes = share * share * share * share * (1.0 + kept) / (rest * rest * rest);
    let of_one_step = pole * (1.0 + rest / (1.0 + kept));
    let of_two_steps = kept * (1.0 + 2.0 * rest / (1.0 + kept));
    let taps = 2.0 * ends * ends + middle * middle;
    after_low_passes * (taps + 4.0 * ends * middle * of_one_step + 2.0 * ends * ends * of_two_steps)
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

/// Mean square distance of a rectangular distribution over the bounds from a value.
const fn mean_square_distance([least, most]: [f64; 2], value: f64) -> f64 {
    let (below, above) = (least - value, most - value);
    (below * below + below * above + above * above) / 3.0
}

macro_rules! constructor {
    ($t:ty) => {
        impl Priors<$t> {
            /// From the period and the nominal delay (s), the weights, and bounds and largest change of gain and delay.
            const fn of(
                [period, nominal_delay]: [f64; 2],
                weights: [f64; 2],
                [least_gain, most_gain, gain_change]: [f64; 3],
                [least_delay, most_delay, delay_change]: [f64; 3],
            ) -> Self {
                Self {
                    period: period as $t,
                    per_period: (1.0 / period) as $t,
                    nominal_delay: nominal_delay as $t,
                    weights: [weights[0] as $t, (weights[1] * period * period) as $t],
                    spread: [
                        mean_square_distance([least_gain, most_gain], 1.0) as $t,
                        (mean_square_distance([least_delay, most_delay], nominal_delay) / (period * period))
                            as $t,
                    ],
                    gain: Range { bounds: [least_gain as $t, most_gain as $t], change: gain_change as $t },
                    delay: Range {
                        bounds: [least_delay as $t, most_delay as $t],
                        change: delay_change as $t,
                    },
                }
            }
        }

        impl<const N: usize> Learner<$t, N> {
            /// From the rig's parameters.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name; a sample rate below 200 Hz; a flow gain of
            /// more than 1,000 times the table's greatest flow, or less than a thousandth of it; a `lead_alpha` with
            /// which the lead network's lag at the longest delay exceeds 524,288 samples.
            pub const fn new(p: &Parameters) -> Result<Self, ConfigError> {
                check!(within("sample_rate", p.sample_rate, LOWEST_RATE, LARGEST));
                let l = &p.learning;
                let computation =
                    check!(within("computation_delay", p.computation_delay as f64, 0.0, MOST_COMPUTATION));
                let ticks = window_ticks(p.sample_rate);
                let sample = 1.0 / p.sample_rate;
                let period = ticks as f64 * sample;
                let tau = core::f64::consts::TAU;
                let network = check!(LeadNetwork::<$t>::by(p));
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
                let added_damping = area / (leak + loop_gain);
                let integral = check!(within("integral_gain", p.integral_gain, 0.0, LARGEST));
                let integral = if p.integrates() { integral / p.proportional_gain } else { 0.0 };
                // Bounds and start of the delay.
                let [least, most] = check!(bounds("response_delay_bounds", l.response_delay_bounds));
                let least = least * p.response_delay;
                let shortest = t::SHORTEST_DELAY * sample;
                let lowest = if least > shortest { least } else { shortest };
                let most = most * p.response_delay;
                let highest = if most > lowest { most } else { lowest };
                check!(within("response_delay_bounds", highest, 0.0, LONGEST_DELAY));
                let nominal = if p.response_delay > lowest { p.response_delay } else { lowest };
                let delay_change = t::DELAY_RATE * nominal * period;
                let velocity_delay = check!(within("velocity_delay", p.velocity_delay, 0.0, 1.0));
                let [lead, lag] = t::VELOCITY_DELAY_REACH;
                let [least_flow, most_flow] = check!(gains("flow_gain_bounds", l.flow_gain_bounds));
                let [least_gain, most_gain] = check!(gains("valve_gain_bounds", l.valve_gain_bounds));
                let null_bias = check!(null_bias(p));
                let excitation = check!(positive("excitation", l.excitation));
                let longest = if highest > nominal { highest } else { nominal };
                let slowest = longest + (1.0 + t::LARGEST_DEFICIT) * (velocity_delay + lag * nominal);
                let alpha = check!(decaying(p.lead_alpha, slowest, sample));
                let phase_deficit = 1.0 / 3.0 + alpha / ((1.0 - alpha) * (1.0 - alpha));
                let low_pass = share(tau * t::LOW_PASS, period);
                let ends = end_taps(tau * t::MAINS * period);
                let grid = CurveGrid::over(p.greatest_flow());
                // Made before the learner, which is then built in its place: the stack holds no second learner.
                let mut model = FlowModel::<$t, N>::EMPTY;
                check!(model.fill(p));
                let greatest = p.greatest_flow();
                check!(within(
                    "flow_gain",
                    flow_gain,
                    LEAST_FLOW_GAIN * greatest,
                    LARGEST_FLOW_GAIN * greatest
                ));
                Ok(Self {
                    adapts: l.adaptive,
                    corrects: l.adaptive && l.curve_correction && !matches!(p.mode, Mode::Linear),
                    guards: l.guard,
                    per_window: (1.0 / ticks as f64) as $t,
                    checkpoint_windows: windows(t::CHECKPOINT, period),
                    largest: Largest {
                        flow: (t::LARGEST_SUM * (greatest + leak * area * pressure)) as $t,
                        force: (t::LARGEST_SUM * area * pressure) as $t,
                        opening: t::LARGEST_SUM as $t,
                    },
                    piston_area: area as $t,
                    flow_gain: flow_gain as $t,
                    flow_per_force: leak as $t,
                    flow_per_change: volume as $t,
                    model,
                    lead: network,
                    response_delay: p.response_delay as $t,
                    null_gain: if p.integrates() { 0.0 } else { network.gain() },
                    known_signal: null_bias as $t * network.gain(),
                    filter: BandFilter {
                        taps: [ends as $t, (1.0 - 2.0 * ends) as $t],
                        low_pass: low_pass as $t,
                        high_pass: share(tau * t::HIGH_PASS, period) as $t,
                    },
                    gate: Gate {
                        linear_range: (t::LINEAR_RANGE - null_bias.abs()) as $t,
                        excitation: (excitation * excitation) as $t,
                        change_weight: (t::EXCITATION_TIME * t::EXCITATION_TIME / (period * period)) as $t,
                        per_square_flow: (1.0 / (flow_gain * flow_gain)) as $t,
                        average: share(1.0 / t::GATE_AVERAGE, period) as $t,
                        threshold: t::GATE_THRESHOLD as $t,
                        period: period as $t,
                        kept: t::KEPT_EVIDENCE as $t,
                        half: t::HALF_EVIDENCE as $t,
                        forgotten: (period / t::MEMORY) as $t,
                        hold_off: windows(t::HOLD_OFF, period),
                        settling: windows(t::SETTLING, period),
                    },
                    deviation: Deviation {
                        correlation: (period / noise_passed(ends, low_pass)) as $t,
                        per_square_flow: (1.0 / (flow_gain * flow_gain)) as $t,
                        half_sample: (0.5 * sample) as $t,
                        leakage_corner: (leak * leak / (volume * volume * period * period) + t::SLOWEST)
                            as $t,
                    },
                    flow: FlowEstimator {
                        priors: Priors::<$t>::of(
                            [period, velocity_delay],
                            [t::FLOW_GAIN_PRIOR * flow_gain, t::VELOCITY_DELAY_PRIOR * flow_gain],
                            [least_flow, most_flow, t::FLOW_GAIN_RATE * period],
                            [velocity_delay + lead * nominal, velocity_delay + lag * nominal, delay_change],
                        ),
                    },
                    curve: FlowCurve {
                        grid: CurveGrid { per_flow: grid.per_flow as $t, step: grid.step as $t },
                        known_null: null_bias as $t,
                        forgotten: (t::MEMORY / t::DIRECTION_MEMORY) as $t,
                        average: (period / t::CURVE_AVERAGE) as $t,
                        correlation: (t::CURVE_CORRELATION / period) as $t,
                        disturbance: (t::DISTURBANCE / period) as $t,
                        change: (2.0 * t::FLOW_GAIN_RATE * period) as $t,
                        null_change: (2.0 * t::NULL_RATE * period) as $t,
                        drift: (t::CURVE_DRIFT * t::CURVE_DRIFT * period) as $t,
                    },
                    valve: ValveEstimator {
                        valve_gain: p.valve_gain as $t,
                        lead_gain: (1.0 / (p.proportional_gain * p.valve_gain)) as $t,
                        lag_per_delay: (2.0 * alpha / (1.0 - alpha)) as $t,
                        phase_deficit: phase_deficit as $t,
                        sample: sample as $t,
                        sampling_delay: ((1.0 + computation) * sample) as $t,
                        priors: Priors::<$t>::of(
                            [period, nominal],
                            [t::VALVE_GAIN_PRIOR, t::RESPONSE_DELAY_PRIOR],
                            [least_gain, most_gain, t::VALVE_GAIN_RATE * period],
                            [lowest, highest, delay_change],
                        ),
                    },
                    guard: Guard {
                        per_added_damping: (1.0 / added_damping) as $t,
                        force_per_flow: (1.0 / loop_gain) as $t,
                        fed_forward: if p.feedforward { 1.0 } else { 0.0 },
                        integrated: (integral * period) as $t,
                        low_pass: share(tau * guard::LOW_PASS, period) as $t,
                        average: share(1.0 / guard::AVERAGE, period) as $t,
                        slow_average: share(1.0 / guard::SLOW_AVERAGE, period) as $t,
                        quiet: (guard::QUIET * guard::QUIET) as $t,
                        tolerated: (if integral > 0.0 {
                            guard::TOLERATED_WITH_INTEGRAL
                        } else {
                            guard::TOLERATED
                        }) as $t,
                        correction: (period / guard::REMOVAL) as $t,
                        lowest: guard::LOWEST_LEVEL as $t,
                    },
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
