//! A learner from the rig's parameters.

use crate::compensation::{CurveGrid, LeadNetwork};
use crate::error::{ConfigError, check, within};
use crate::learning::band_filter::{BandFilter, end_taps};
use crate::learning::design::{Design, phase_deficit, window_ticks};
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

/// Least and largest ratio (1) of the flow gain to the table's greatest flow.
const LEAST_FLOW_GAIN: f64 = 1.0e-3;
const LARGEST_FLOW_GAIN: f64 = 1.0e3;

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
                let d = check!(Design::of(p));
                let (l, tau) = (&p.learning, core::f64::consts::TAU);
                let network = check!(LeadNetwork::<$t>::by(p));
                let ends = end_taps(tau * t::MAINS * d.period);
                let low_pass = share(tau * t::LOW_PASS, d.period);
                let delay_change = t::DELAY_RATE * d.delay * d.period;
                let ([shortest, longest], [earliest, latest]) = (d.delays, d.velocity_delays);
                let ([least_flow, most_flow], [least_gain, most_gain]) = (d.flow_gains, d.valve_gains);
                let grid = CurveGrid::over(p.greatest_flow());
                // Made before the learner, which is then built in its place: the stack holds no second learner.
                let mut model = FlowModel::<$t, N>::EMPTY;
                check!(model.fill(p));
                let greatest = p.greatest_flow();
                check!(within(
                    "flow_gain",
                    d.flow_gain,
                    LEAST_FLOW_GAIN * greatest,
                    LARGEST_FLOW_GAIN * greatest
                ));
                Ok(Self {
                    adapts: l.adaptive,
                    corrects: l.adaptive && l.curve_correction && !matches!(p.mode, Mode::Linear),
                    guards: l.guard,
                    per_window: (1.0 / window_ticks(p.sample_rate) as f64) as $t,
                    checkpoint_windows: windows(t::CHECKPOINT, d.period),
                    largest: Largest {
                        flow: (t::LARGEST_SUM * (greatest + d.leak * d.area * d.pressure)) as $t,
                        force: (t::LARGEST_SUM * d.area * d.pressure) as $t,
                        opening: t::LARGEST_SUM as $t,
                    },
                    piston_area: d.area as $t,
                    flow_gain: d.flow_gain as $t,
                    flow_per_force: d.leak as $t,
                    flow_per_change: d.volume as $t,
                    model,
                    lead: network,
                    response_delay: p.response_delay as $t,
                    null_gain: if p.integrates() { 0.0 } else { network.gain() },
                    known_signal: d.null_bias as $t * network.gain(),
                    filter: BandFilter {
                        taps: [ends as $t, (1.0 - 2.0 * ends) as $t],
                        low_pass: low_pass as $t,
                        high_pass: share(tau * t::HIGH_PASS, d.period) as $t,
                    },
                    gate: Gate {
                        linear_range: (t::LINEAR_RANGE - d.null_bias.abs()) as $t,
                        excitation: (d.excitation * d.excitation) as $t,
                        change_weight: (t::EXCITATION_TIME * t::EXCITATION_TIME / (d.period * d.period))
                            as $t,
                        per_square_flow: (1.0 / (d.flow_gain * d.flow_gain)) as $t,
                        average: share(1.0 / t::GATE_AVERAGE, d.period) as $t,
                        threshold: t::GATE_THRESHOLD as $t,
                        period: d.period as $t,
                        kept: t::KEPT_EVIDENCE as $t,
                        half: t::HALF_EVIDENCE as $t,
                        forgotten: (d.period / t::MEMORY) as $t,
                        hold_off: windows(t::HOLD_OFF, d.period),
                        settling: windows(t::SETTLING, d.period),
                    },
                    deviation: Deviation {
                        correlation: (d.period / noise_passed(ends, low_pass)) as $t,
                        per_square_flow: (1.0 / (d.flow_gain * d.flow_gain)) as $t,
                        half_sample: (0.5 * d.sample) as $t,
                        leakage_corner: (d.leak * d.leak / (d.volume * d.volume * d.period * d.period)
                            + t::SLOWEST) as $t,
                    },
                    flow: FlowEstimator {
                        priors: Priors::<$t>::of(
                            [d.period, d.velocity_delay],
                            [t::FLOW_GAIN_PRIOR * d.flow_gain, t::VELOCITY_DELAY_PRIOR * d.flow_gain],
                            [least_flow, most_flow, t::FLOW_GAIN_RATE * d.period],
                            [earliest, latest, delay_change],
                        ),
                    },
                    curve: FlowCurve {
                        grid: CurveGrid { per_flow: grid.per_flow as $t, step: grid.step as $t },
                        known_null: d.null_bias as $t,
                        forgotten: (t::MEMORY / t::DIRECTION_MEMORY) as $t,
                        average: (d.period / t::CURVE_AVERAGE) as $t,
                        correlation: (t::CURVE_CORRELATION / d.period) as $t,
                        disturbance: (t::DISTURBANCE / d.period) as $t,
                        change: (2.0 * t::FLOW_GAIN_RATE * d.period) as $t,
                        null_change: (2.0 * t::NULL_RATE * d.period) as $t,
                        drift: (t::CURVE_DRIFT * t::CURVE_DRIFT * d.period) as $t,
                    },
                    valve: ValveEstimator {
                        valve_gain: p.valve_gain as $t,
                        lead_gain: (1.0 / (p.proportional_gain * p.valve_gain)) as $t,
                        lag_per_delay: (2.0 * p.lead_alpha / (1.0 - p.lead_alpha)) as $t,
                        phase_deficit: phase_deficit(p.lead_alpha) as $t,
                        sample: d.sample as $t,
                        sampling_delay: ((1.0 + p.computation_delay as f64) * d.sample) as $t,
                        priors: Priors::<$t>::of(
                            [d.period, d.delay],
                            [t::VALVE_GAIN_PRIOR, t::RESPONSE_DELAY_PRIOR],
                            [least_gain, most_gain, t::VALVE_GAIN_RATE * d.period],
                            [shortest, longest, delay_change],
                        ),
                    },
                    guard: Guard {
                        per_added_damping: (1.0 / (d.area / (d.leak + d.loop_gain))) as $t,
                        force_per_flow: (1.0 / d.loop_gain) as $t,
                        fed_forward: if p.feedforward { 1.0 } else { 0.0 },
                        integrated: (d.integral * d.period) as $t,
                        low_pass: share(tau * guard::LOW_PASS, d.period) as $t,
                        average: share(1.0 / guard::AVERAGE, d.period) as $t,
                        slow_average: share(1.0 / guard::SLOW_AVERAGE, d.period) as $t,
                        quiet: (guard::QUIET * guard::QUIET) as $t,
                        tolerated: (if d.integral > 0.0 {
                            guard::TOLERATED_WITH_INTEGRAL
                        } else {
                            guard::TOLERATED
                        }) as $t,
                        correction: (d.period / guard::REMOVAL) as $t,
                        lowest: guard::LOWEST_LEVEL as $t,
                    },
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
