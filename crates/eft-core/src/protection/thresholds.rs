//! The limits of a plausibility watch, from noise and from the allowed error of the calibration.

use crate::compensation::null_bias;
use crate::error::{ConfigError, LARGEST, SMALLEST, check, positive, range, within};
use crate::learning::FlowModel;
use crate::parameters::{Parameters, PlausibilityParameters, ProtectionParameters, VelocitySource};
use crate::protection::gate::SensorGate;
use crate::protection::plausibility::{
    FlowLimits, Following, LoadPressureWatch, MotionLimits, Plausibility, ReversalWatch, SpoolLimits,
};
use crate::velocity::FilteredDerivative;

/// Corner (Hz) of the residuals, and of the velocity that replaces a sensor's.
const RESIDUAL_CORNER: f64 = 80.0;
/// Corner (Hz) above which the force has a large part in the flow balance.
const FAST_CORNER: f64 = 15.0;
/// Corner (Hz) below which the ratio of velocity and displacement is compared.
const RATIO_CORNER: f64 = 15.0;
/// Corner (Hz) of the velocity by the flow balance.
const FLOW_VELOCITY_CORNER: f64 = 40.0;
/// Frequency (Hz) of the fastest motion.
const FASTEST_MOTION: f64 = 10.0;
/// Delay (s) between velocity and displacement: 1.5 ms of latency, and the lag of a sensor of 0.3 kHz.
const LATENCY: f64 = 2.0e-3;
/// Delay (s) between force and load pressure.
const PRESSURE_LATENCY: f64 = 5.0e-4;
/// Time (s) of a difference of twice the tolerance between force and load pressure before it is a contradiction.
const PRESSURE_TIME: f64 = 5.0e-4;
/// Share of the velocity's trip level below which its direction has a smaller weight.
const REVERSAL_VELOCITY: f64 = 0.01;
/// The brake's largest force as a share of the force's warning level, so that it does not warn, or of the capacity without
/// a level. It is reached at this share of the velocity's trip level.
const BRAKE: f64 = 0.4;
const BRAKE_OF_CAPACITY: f64 = 0.05;
const FULL_BRAKE_VELOCITY: f64 = 1.0 / 6.0;
/// Share of friction's oil flow that is allowed for a force of the wrong sign. It is small, because friction does not
/// reverse a sign.
const WRONG_SIGN: f64 = 0.25;
/// Opening (1) times time (s) that a spool may move against its command, as it does for a moment after a null bias of 3 %
/// appears.
const OPPOSED_TRAVEL: f64 = 6.0e-4;
/// Corner (Hz) below which the spool is compared with its command.
const SPOOL_CORNER: f64 = 5.0;
/// Highest frequency (Hz) at which a signal may swing between its trip levels and still pass the gate. For the velocity
/// it is [`FASTEST_MOTION`].
const FASTEST_SIGNAL: f64 = 30.0;
/// Share of the actuator's capacity by which friction may change the force at once.
const FRICTION: f64 = 0.01;
/// Share of the greatest flow that null bias, overlap and leakage may leave, and the share of it that changes fast.
const FLOW_OFFSET: f64 = 0.05;
const FAST_FLOW_OFFSET: f64 = 7.0e-4;
/// Share of the greatest flow that an overlap of about one per cent of the stroke blocks near null.
const OVERLAP_FLOW: f64 = 0.02;

/// Share of the path in which two signals seem to have opposite signs, because one of them is late.
const OPPOSED: f64 = 0.35;

/// Natural logarithm, rounded up to a multiple of that of 2.
const fn logarithm(value: f64) -> f64 {
    let exponent = ((value.to_bits() >> 52) & 0x7ff) as f64 - 1022.0;
    exponent * core::f64::consts::LN_2
}

/// Square root of a number within [1, 1e4], to the last digits, in a constant.
const fn root(square: f64) -> f64 {
    let (mut root, mut n) = (square, 0);
    while n < 40 {
        root = 0.5 * (root + square / root);
        n += 1;
    }
    root
}

/// Share of its trip level below which the velocity is near its reversal.
const NEAR_REVERSAL: f64 = 0.05;
/// Factor on the gate of the force. A single reading beyond the gate is only held, and `lost_samples` in a row trip.
/// The gate may therefore be narrow.
const FORCE_GATE: f64 = 0.56;
/// Factor on the path by which the fastest motion leaves its prediction, if the velocity is estimated. A wider jump would be
/// a kick of the velocity, and a wrong sign near zero would pass.
const ESTIMATED_GATE: f64 = 1.5;
/// Corner (Hz) of the average of a signal's slope.
const SLOPE_CORNER: f64 = 60.0;
/// Largest change of a still sensor's reading, as a share of the deviation of its noise.
const STILL_CHANGE: f64 = 0.1;

/// e to the power of a negative number, in a constant.
const fn exponential(power: f64) -> f64 {
    let (mut value, mut halvings) = (power, 0);
    while value < -0.5 {
        value *= 0.5;
        halvings += 1;
    }
    // Taylor's series by Horner's scheme.
    let (mut result, mut n) = (1.0, 8.0);
    while n > 0.5 {
        result = 1.0 + result * value / n;
        n -= 1.0;
    }
    while halvings > 0 {
        result *= result;
        halvings -= 1;
    }
    result
}

/// Coefficient of a first-order low-pass, at most 1.
const fn share(corner: f64, rate: f64) -> f64 {
    let angle = core::f64::consts::TAU * corner / rate;
    let share = angle / (1.0 + 0.5 * angle);
    if share < 1.0 { share } else { 1.0 }
}

/// A trip level, or a replacement if no level is configured.
const fn level(trip: f64, scale: f64) -> f64 {
    if trip < LARGEST { trip } else { scale }
}

macro_rules! constructor {
    ($t:ty) => {
        impl<const N: usize> Plausibility<$t, N> {
            /// Makes the watch of a rig and its protection in `place`, because the stack has no space for a second one.
            #[inline(never)]
            pub(crate) const fn make_in(
                place: &mut Option<Self>,
                p: &Parameters,
                protection: &ProtectionParameters,
                watch: &PlausibilityParameters,
            ) -> Result<(), ConfigError> {
                let rate = check!(positive("sample_rate", p.sample_rate));
                let area = check!(positive("piston_area", p.piston_area));
                let pressure = check!(positive("supply_pressure", p.supply_pressure));
                let compressibility = check!(positive("compressibility", p.compressibility));
                let force_noise = check!(within("force_noise", watch.force_noise, 0.0, LARGEST));
                let displacement_noise =
                    check!(within("displacement_noise", watch.displacement_noise, SMALLEST, 1.0));
                let velocity_noise = check!(within("velocity_noise", watch.velocity_noise, 0.0, 1e3));
                let spool_noise = check!(within("spool_noise", watch.spool_noise, 0.0, 1.0));
                let alarm_rate = check!(within("false_alarms", watch.false_alarms, 1e-12, 1e6));
                let delay = check!(within("response_delay", p.response_delay, 0.0, 1.0));
                // Gaussian noise exceeds this many deviations once in the readings of one alarm: P(|x| > z·σ) ≤ exp(−z²/2).
                let readings = logarithm(4.0 * 3600.0 * rate / alarm_rate);
                let readings = if readings > 1.0 { readings } else { 1.0 };
                let deviations = root(2.0 * readings);
                let full_flow = p.greatest_flow();
                let capacity = area * pressure;
                let force = level(protection.force.trip, capacity);
                // Without a level, the displacement in a tenth of a second at full flow.
                // Without a warning level the trip level is the warning's.
                let warning = level(protection.force.warning, protection.force.trip);
                let brake = if warning < LARGEST { BRAKE * warning } else { BRAKE_OF_CAPACITY * capacity };
                let displacement = level(protection.displacement.trip, 0.1 * full_flow / area);
                let velocity = level(protection.velocity.trip, full_flow / area);
                let spool = level(protection.spool.trip, 1.0);
                let angle = core::f64::consts::TAU * FASTEST_SIGNAL / rate;
                let motion_angle = core::f64::consts::TAU * FASTEST_MOTION / rate;
                // A third more, for the noise of the prediction.
                let spread = 1.33 * deviations;
                let senses_velocity = matches!(p.velocity_source, VelocitySource::Sensor);
                let motion_tolerance = ESTIMATED_GATE * velocity * FASTEST_MOTION / (SLOPE_CORNER * rate);
                // Without a level every reading is within reach.
                let has_level = protection.displacement.trip < LARGEST;
                let noise_tolerance = if has_level { spread * displacement_noise } else { f32::MAX as f64 };
                let low = share(RESIDUAL_CORNER, rate);
                let flow_noise = area * velocity_noise + full_flow * spool_noise;
                // Three standard deviations of white noise after the low-pass, and the range of the sums of the
                // remaining noise.
                let drift_factor = 3.0 * root(1.0 + low) * 0.75 * root(1.0 + 2.0 * low) * low;
                let flow_walk = readings * flow_noise / (6.0 * rate);
                // Seven standard deviations of the displacement's low-passed noise at both ends of a sum. The further
                // low-pass of the ratio leaves about half of it.
                let motion_limit = 5.0 * displacement_noise + readings * velocity_noise / (6.0 * rate);
                let ratio_limit = 3.0 * displacement_noise + readings * velocity_noise / (6.0 * rate);
                // The direction of the motion turns the displacement's noise over at each reversal, so that it adds up to a
                // random walk, as the velocity's noise does. This is its variance in a second (m²/s). A walk against a
                // drift exceeds a limit with a probability of exp(−2·drift·limit/variance).
                let fine = share(RATIO_CORNER, rate);
                let doubled_noise = 2.0 * displacement_noise;
                let walk = 2.0 * FASTEST_MOTION * doubled_noise * doubled_noise * fine / (2.0 - fine)
                    + velocity_noise * velocity_noise / rate;
                let ratio_drift = 0.5 * readings * walk / ratio_limit;
                let offset = FLOW_OFFSET * full_flow / area;
                // The displacement's noise behind a low-pass at both ends of a sum, and the path in a delay of the fastest
                // motion at its reversal.
                let reversal_path = 0.7 * deviations * displacement_noise * root(1e4 * low) / 100.0
                    + OPPOSED * core::f64::consts::TAU * FASTEST_MOTION * velocity * LATENCY * LATENCY;
                let travel = 16.0 * displacement_noise + 0.01 * displacement;
                let delays = p.computation_delay as f64;
                let repeats = 3.0e-3 * rate;
                let repeats = if repeats > 8.0 { repeats } else { 8.0 } + delays;
                let lag = 0.5 * delay * rate + 0.5 * (1.0 + delays);
                let derivative = check!(FilteredDerivative::<$t>::new(RESIDUAL_CORNER, rate));
                let leakage = check!(within("leakage", p.leakage, 0.0, LARGEST)) / area;
                let tolerance = check!(range("load_pressure_tolerance", watch.load_pressure_tolerance));
                let load_pressure = if tolerance < LARGEST {
                    let pressure_noise = force_noise / area;
                    Some(LoadPressureWatch {
                        area: area as $t,
                        jump: (FORCE_GATE * (spread * pressure_noise + angle * force / area)) as $t,
                        still: (STILL_CHANGE * pressure_noise) as $t,
                        tolerance: (tolerance + 4.0 * force_noise) as $t,
                        latency: (PRESSURE_LATENCY * rate) as $t,
                        limit: (PRESSURE_TIME * (tolerance + 4.0 * force_noise)) as $t,
                    })
                } else {
                    None
                };
                let valve_gain = check!(positive("valve_gain", p.valve_gain));
                *place = Some(Self {
                    model: FlowModel::<$t, N>::EMPTY,
                    gate: SensorGate {
                        tolerance: [
                            (FORCE_GATE * (spread * force_noise + angle * force)) as $t,
                            (noise_tolerance + angle * displacement) as $t,
                            (spread * velocity_noise + motion_angle * velocity) as $t,
                            (spread * spool_noise + angle * spool) as $t,
                        ],
                        displacement_tolerance: (noise_tolerance + motion_tolerance) as $t,
                        tolerance_growth: motion_tolerance as $t,
                        friction_jump: (FRICTION * capacity) as $t,
                        reversal_velocity: (NEAR_REVERSAL * velocity) as $t,
                        still_change: [
                            (STILL_CHANGE * force_noise) as $t,
                            (STILL_CHANGE * displacement_noise) as $t,
                            (STILL_CHANGE * velocity_noise) as $t,
                            (STILL_CHANGE * spool_noise) as $t,
                        ],
                        liveliness_gain: share(1.0, rate) as $t,
                        still_probability: exponential(-readings) as $t,
                        slope_gain: share(SLOPE_CORNER, rate) as $t,
                        confirmations: protection.lost_samples / 2 + 1,
                    },
                    derivative,
                    lost_samples: protection.lost_samples,
                    repeats: repeats as u32,
                    senses_velocity,
                    fast_velocity: matches!(
                        p.velocity_source,
                        VelocitySource::Sensor | VelocitySource::Accelerometer { .. }
                    ),
                    period: (1.0 / rate) as $t,
                    rate: rate as $t,
                    area: area as $t,
                    leakage: leakage as $t,
                    oil: (compressibility / area) as $t,
                    valve_gain: valve_gain as $t,
                    null_bias: check!(null_bias(p)) as $t,
                    low_gain: low as $t,
                    ratio_gain: fine as $t,
                    spool_gain: share(SPOOL_CORNER, rate) as $t,
                    decay: (1.0 - share(1.0, rate)) as $t,
                    per_reversal: (1.0 / (REVERSAL_VELOCITY * velocity)) as $t,
                    balance: FlowLimits {
                        high: share(FAST_CORNER, rate) as $t,
                        fast_decay: (1.0 - share(1.6, rate)) as $t,
                        drift: (drift_factor * flow_noise + FLOW_OFFSET * full_flow) as $t,
                        fast_drift: (drift_factor * flow_noise + FAST_FLOW_OFFSET * full_flow) as $t,
                        null_drift: (OVERLAP_FLOW * full_flow) as $t,
                        slow: (1.5 * area * travel + flow_walk) as $t,
                        fast: (FRICTION * capacity * compressibility / area + flow_walk) as $t,
                        wrong_sign: (WRONG_SIGN * FRICTION * capacity * compressibility / area + flow_walk)
                            as $t,
                    },
                    motion: MotionLimits {
                        drift: (drift_factor * velocity_noise) as $t,
                        ratio_drift: ratio_drift as $t,
                        travel: motion_limit as $t,
                        ratio: ratio_limit as $t,
                        latency: LATENCY as $t,
                    },
                    stroke: SpoolLimits {
                        lag: (1.0 / (1.0 + lag)) as $t,
                        drift: (drift_factor * spool_noise + 0.03) as $t,
                        against_drift: (drift_factor * spool_noise) as $t,
                        difference: 2.0e-3,
                        against: OPPOSED_TRAVEL as $t,
                    },
                    following: Following {
                        low_gain: share(FLOW_VELOCITY_CORNER, rate) as $t,
                        fade: (1.0 - 1.0 / (1.0 + delay * rate)) as $t,
                        brake: brake as $t,
                        per_brake_velocity: (1.0 / (FULL_BRAKE_VELOCITY * velocity)) as $t,
                    },
                    reversal: ReversalWatch {
                        slow: offset as $t,
                        drift: (0.25 * offset) as $t,
                        limit: reversal_path as $t,
                    },
                    force_jump: if senses_velocity {
                        0.0
                    } else {
                        (area * area / (compressibility * rate)) as $t
                    },
                    force_error_limit: (10.0 * force_noise + 0.15 * force) as $t,
                    changes: [(10.0 * force_noise + 0.02 * force) as $t, (10.0 * displacement_noise) as $t],
                    load_pressure,
                });
                match place {
                    Some(watch) => watch.model.fill_table(p),
                    None => Ok(()),
                }
            }
        }
    };
}
constructor!(f32);
constructor!(f64);

#[cfg(test)]
mod tests;
