//! What an adaptive compensation is made from.

use crate::adaptation::{Adaptation, CROWDED, SLOTS};
use crate::adaptive::AdaptiveCompensation;
use crate::band_filter::BandFilter;
use crate::compensation::{Compensation, CompensationParameters, Mode};
use crate::error::{ConfigError, LARGEST, check, positive, within};
use crate::feedforward::Feedforward;
use crate::flow_correction::FlowCorrection;
use crate::flow_gain::FlowGainEstimator;
use crate::flow_prediction::FlowPrediction;
use crate::flow_table::FlowTable;
use crate::guard::Guard;
use crate::load_pressure::LoadPressure;
use crate::piecewise::PiecewiseLinear;
use crate::trust::Trust;
use crate::tuning::Tuning;
use crate::valve_estimator::ValveEstimator;

/// What an adaptive compensation is made from, in SI units: the nominal rig, as the paper's scheme knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveParameters {
    /// The paper's compensation, from which everything starts.
    pub compensation: CompensationParameters,
    /// Oil compressibility of the chambers `K_a` (m³/Pa).
    pub compressibility: f64,
    /// Cross-piston leakage `C_l` (m³/(s·Pa)).
    pub leakage: f64,
    /// Force sensitivity `C_F` (V/N) of the servovalve controller.
    pub force_sensitivity: f64,
    /// Delay of the compensation by computation (samples, at most 1000), beyond which the valve command shows it.
    pub computation_delay: u32,
    /// Delay of the velocity itself (s), of an estimate for example, that the lead network makes up for besides.
    pub velocity_delay: f64,
    /// Whether the command's own flow is demanded as well.
    pub feedforward: bool,
    /// Whether flow gain and valve are estimated.
    pub adaptive: bool,
    /// Whether the flow table is corrected by direction and band of opening as well, where flow gain and valve are
    /// estimated.
    pub correct_curve: bool,
    /// Whether overcompensation takes the level back.
    pub guard: bool,
    /// How the estimators and the guard are set.
    pub tuning: Tuning,
}

/// Delay by computation (samples) at the most.
const MOST_COMPUTATION: f64 = 1000.0;

/// Estimator steps per second that a window aims at, at the least (Hz).
const SLOW_RATE: f64 = 200.0;

/// Ticks of the shortest window, of which each does two slots.
const SHORTEST: u32 = SLOTS / 2;

/// Sample rate (Hz) that estimators and guard need at the least: below, their filters have too few windows.
const LOWEST_RATE: f64 = 200.0;

/// Ticks of a window: a power of two.
const fn window(sample_rate: f64) -> u32 {
    let mut window = SHORTEST;
    while window < 1024 && sample_rate / (2.0 * window as f64) >= SLOW_RATE {
        window *= 2;
    }
    window
}

/// Time (s) from one time that evidence is put by to the next, at the least: by then a failed sensor is noticed.
const PROOF: f64 = 0.2;

/// Ticks between two times that evidence is put by: a power of two.
const fn proof(window: u32, sample_rate: f64) -> u32 {
    let mut ticks = window;
    while ticks < 1 << 20 && (ticks as f64) < PROOF * sample_rate {
        ticks *= 2;
    }
    ticks
}

/// Share of the way a first-order low-pass with this corner (rad/s) goes in a period (s), Tustin's without a zero.
const fn share(corner: f64, period: f64) -> f64 {
    let angle = corner * period;
    angle / (1.0 + 0.5 * angle)
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> AdaptiveCompensation<$t, N> {
            /// From its parameters and the flow table.
            ///
            /// # Errors
            /// A parameter that is not finite or out of its range, by name; a sample rate below 200 Hz with estimators or
            /// guard.
            pub const fn new(p: &AdaptiveParameters, table: &FlowTable<$t, N>) -> Result<Self, ConfigError> {
                let c = &p.compensation;
                let compensation = check!(Compensation::<$t, N>::new(c, table));
                let feedforward = if p.feedforward {
                    check!(Feedforward::<$t>::new(c.piston_area, p.compressibility, p.leakage, c.sample_rate))
                } else {
                    Feedforward::<$t>::OFF
                };
                if p.adaptive || p.guard {
                    check!(within("sample_rate", c.sample_rate, LOWEST_RATE, LARGEST));
                }
                let delay =
                    check!(within("computation_delay", p.computation_delay as f64, 0.0, MOST_COMPUTATION));
                let ticks = window(c.sample_rate);
                let sample = 1.0 / c.sample_rate;
                let period = ticks as f64 * sample;
                // The same actuator, seen once a window.
                let volume = check!(positive("compressibility", p.compressibility)) / c.piston_area / period;
                let leak = check!(within("leakage", p.leakage, 0.0, LARGEST)) / c.piston_area;
                let force_sensitivity = check!(positive("force_sensitivity", p.force_sensitivity));
                let loop_gain = force_sensitivity * c.proportional_gain * c.valve_gain * c.flow_gain;
                let added_damping = c.piston_area / (leak + loop_gain);
                let t = check!(p.tuning.checked());
                let tau = core::f64::consts::TAU;
                let least_delay = t.response_delay.0 * c.response_delay;
                let lowest_delay = if least_delay > 2.0 * sample { least_delay } else { 2.0 * sample };
                let most_delay = t.response_delay.1 * c.response_delay;
                let highest_delay = if most_delay > lowest_delay { most_delay } else { lowest_delay };
                let nominal = if c.response_delay > lowest_delay { c.response_delay } else { lowest_delay };
                let alpha = c.lead_alpha;
                let prediction = match c.mode {
                    Mode::Linear => FlowPrediction {
                        load_pressure: LoadPressure::<$t>::NONE,
                        curve: check!(PiecewiseLinear::<$t, N>::new(
                            "openings",
                            &[-1.0, 1.0],
                            "flow_gain",
                            &[-c.flow_gain, c.flow_gain],
                        )),
                    },
                    _ => FlowPrediction {
                        load_pressure: check!(LoadPressure::<$t>::new(c.piston_area, c.supply_pressure)),
                        curve: *table.forward(),
                    },
                };
                let (below, above) = prediction.curve.ends();
                let (below, above) = (-(below as f64), above as f64);
                let end = if below > above { below } else { above };
                let curve = FlowCorrection::over(
                    end,
                    period / t.curve_memory,
                    period * t.rates.0,
                    period / t.curve_band_memory,
                );
                let adaptation = Adaptation {
                    last_tick: ticks - 1,
                    crowded: if ticks < SLOTS { CROWDED } else { 0 },
                    per_window: (1.0 / ticks as f64) as $t,
                    last_of_proof: proof(ticks, c.sample_rate) - 1,
                    lead: compensation.lead,
                    adapting: p.adaptive,
                    guarding: p.guard,
                    correcting: p.adaptive && p.correct_curve,
                    piston_area: c.piston_area as $t,
                    flow_per_force: leak as $t,
                    flow_per_change: volume as $t,
                    prediction,
                    filter: BandFilter {
                        low_pass: share(tau * t.low_pass, period) as $t,
                        high_pass: share(tau * t.high_pass, period) as $t,
                    },
                    flow_gain: FlowGainEstimator {
                        prior: (t.priors.0 * c.flow_gain) as $t,
                        lowest: t.flow_gain.0 as $t,
                        highest: t.flow_gain.1 as $t,
                        change: (t.rates.0 * period) as $t,
                    },
                    curve: FlowCorrection {
                        per_flow: curve.per_flow as $t,
                        step: curve.step as $t,
                        forgotten: curve.forgotten as $t,
                        change: curve.change as $t,
                        forgotten_beside: curve.forgotten_beside as $t,
                    },
                    valve: ValveEstimator {
                        valve_gain: c.valve_gain as $t,
                        lead_gain: (1.0 / (c.proportional_gain * c.valve_gain)) as $t,
                        lag_per_delay: (2.0 * alpha / (1.0 - alpha)) as $t,
                        sample: sample as $t,
                        period: period as $t,
                        per_period: (1.0 / period) as $t,
                        nominal_delay: nominal as $t,
                        velocity_delay: check!(within("velocity_delay", p.velocity_delay, 0.0, 1.0)) as $t,
                        sampling_delay: ((1.0 + delay) * sample) as $t,
                        gain_prior: t.priors.1 as $t,
                        delay_prior: (t.priors.2 * period * period) as $t,
                        lowest_gain: t.valve_gain.0 as $t,
                        highest_gain: t.valve_gain.1 as $t,
                        lowest_delay: lowest_delay as $t,
                        highest_delay: highest_delay as $t,
                        gain_change: (t.rates.1 * period) as $t,
                        delay_change: (t.rates.2 * nominal * period) as $t,
                    },
                    guard: Guard {
                        per_added_damping: (1.0 / added_damping) as $t,
                        force_per_flow: (1.0 / loop_gain) as $t,
                        fed_forward: if p.feedforward { 1.0 } else { 0.0 },
                        low_pass: share(tau * t.guard_low_pass, period) as $t,
                        average: share(1.0 / t.guard_average, period) as $t,
                        slow_average: share(0.25 / t.guard_average, period) as $t,
                        quiet: (t.guard_quiet * t.guard_quiet) as $t,
                        tolerated: t.tolerated as $t,
                        correction: (period / t.guard_time) as $t,
                        lowest: 0.5,
                    },
                    trust: Trust {
                        linear_range: 0.9,
                        excitation: (t.excitation * t.excitation) as $t,
                        audible: (9.0 * t.excitation * t.excitation) as $t,
                        change_weight: (0.01 / (period * period)) as $t,
                        per_square_flow: (1.0 / (c.flow_gain * c.flow_gain)) as $t,
                        average: share(1.0 / 0.03, period) as $t,
                        error_share: t.error_share as $t,
                        period: period as $t,
                        kept: t.kept_evidence as $t,
                        half: t.half_evidence as $t,
                        forgotten: (period / t.memory) as $t,
                        quarantine: (0.5 / period) as $t,
                        just_now: (0.5 / period - 1.5) as $t,
                        settling: (0.1 / period) as $t,
                    },
                };
                Ok(Self {
                    compensation,
                    feedforward,
                    adaptation,
                    supply_pressure: c.supply_pressure as $t,
                    // From a twentieth of the configured pressure to four times it.
                    middle_supply: 2.025,
                    supply_range: 1.975,
                })
            }
        }
    };
}
constructor!(f32);
constructor!(f64);
