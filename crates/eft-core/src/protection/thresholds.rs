//! The limits of a plausibility watch, from noise and from the allowed error of the calibration.

mod const_math;
mod scales;

use crate::compensation::null_bias;
use crate::error::{ConfigError, LARGEST, check};
use crate::learning::FlowModel;
use crate::parameters::{Parameters, PlausibilityParameters, ProtectionParameters, VelocitySource};
use crate::protection::gate::SensorGate;
use crate::protection::plausibility::{
    FlowLimits, Following, LoadPressureWatch, MotionLimits, Plausibility, ReversalWatch, SpoolLimits,
    ZeroForceWatch,
};
use crate::velocity::FilteredDerivative;
use const_math::{exponential, root};
use scales::{RESIDUAL_CORNER, Scales};

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
/// The brake's largest force as a share of the force's warning level, so that it does not warn, or of the capacity
/// without a level. It is reached at this share of the velocity's trip level.
const BRAKE: f64 = 0.4;
const BRAKE_OF_CAPACITY: f64 = 0.05;
const FULL_BRAKE_VELOCITY: f64 = 1.0 / 6.0;
/// Share of friction's oil flow that is allowed for a force of the wrong sign. It is small, because friction does not
/// reverse a sign.
const WRONG_SIGN: f64 = 0.25;
/// Opening (1) times time (s) that a spool may move against its command, as it does for a moment after a null bias of 3
/// % appears.
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
/// Share of its trip level below which the velocity is near its reversal.
const NEAR_REVERSAL: f64 = 0.05;
/// Factor on the gate of the force. A single reading beyond the gate is only held, and `lost_samples` in a row trip.
/// The gate may therefore be narrow.
const FORCE_GATE: f64 = 0.56;
/// Factor on the path by which the fastest motion leaves its prediction, if the velocity is estimated. A wider jump
/// would be a kick of the velocity, and a wrong sign near zero would pass.
const ESTIMATED_GATE: f64 = 1.5;
/// Corner (Hz) of the average of a signal's slope.
const SLOPE_CORNER: f64 = 60.0;
/// Share of the actuator's capacity by which a reading of zero may be off, as that of a tared load cell.
const ZERO_OFFSET: f64 = 0.005;
/// Deviations of the low-passed noise within which a force reads zero, and the change of its command over this force. A
/// sound force passes zero with more than a tenth of its command's change.
const ZERO_DEVIATIONS: f64 = 5.0;
const COMMAND_CHANGE: f64 = 10.0;
/// Path of the piston over the deviation of the displacement's noise.
const ZERO_PATH: f64 = 5.0;
/// Time (s) of a larger change. In sound tests of rigs with a wrong fixed calibration a reading within the noise of
/// zero had up to half of it.
const ZERO_TIME: f64 = 0.012;
/// Corner (Hz) of the mean sizes of force error and command.
const MEAN_CORNER: f64 = 0.64;
/// Largest change of a still sensor's reading, as a share of the deviation of its noise.
const STILL_CHANGE: f64 = 0.1;

/// Random walk (m²/s) of the sum that compares the ratio of velocity and displacement: its variance in a second. The
/// direction of the motion turns the displacement's noise over at each reversal, so that it adds up, as the velocity's
/// noise does.
const fn ratio_walk(s: &Scales<'_>) -> f64 {
    let fine = s.share(RATIO_CORNER);
    let doubled_noise = 2.0 * s.noise.displacement_noise;
    2.0 * FASTEST_MOTION * doubled_noise * doubled_noise * fine / (2.0 - fine)
        + s.noise.velocity_noise * s.noise.velocity_noise / s.rig.sample_rate
}

/// Path (m) of a delay of the fastest motion at its reversal, and of the displacement's noise behind a low-pass at both
/// ends of a sum.
const fn reversal_path(s: &Scales<'_>) -> f64 {
    let low = s.share(RESIDUAL_CORNER);
    0.7 * s.deviations * s.noise.displacement_noise * root(1e4 * low) / 100.0
        + OPPOSED * core::f64::consts::TAU * FASTEST_MOTION * s.trip.velocity * LATENCY * LATENCY
}

/// Ticks between two displacements in which the velocity goes on: those of 2.5 ms, and at least 3.
const fn short_gap(s: &Scales<'_>) -> u32 {
    let ticks = (2.5e-3 * s.rig.sample_rate) as u32;
    if ticks > 3 { ticks } else { 3 }
}

/// Repetitions (1) of a stuck sensor: those of 3 ms, and at least 8.
const fn repeats(s: &Scales<'_>) -> f64 {
    let repeats = 3.0e-3 * s.rig.sample_rate;
    (if repeats > 8.0 { repeats } else { 8.0 }) + s.rig.computation_delay as f64
}

macro_rules! constructor {
    ($t:ty) => {
        impl SensorGate<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>, lost_samples: u32) -> Self {
                let (Scales { rig, noise, trip, .. }, spread) = (s, s.spread());
                let (angle, motion_angle) = (s.angle(FASTEST_SIGNAL), s.angle(FASTEST_MOTION));
                let reach =
                    if s.limits_displacement { spread * noise.displacement_noise } else { f32::MAX as f64 };
                let growth =
                    ESTIMATED_GATE * trip.velocity * FASTEST_MOTION / (SLOPE_CORNER * rig.sample_rate);
                Self {
                    tolerance: [
                        (FORCE_GATE * (spread * noise.force_noise + angle * trip.force)) as $t,
                        (reach + angle * trip.displacement) as $t,
                        (spread * noise.velocity_noise + motion_angle * trip.velocity) as $t,
                        (spread * noise.spool_noise + angle * trip.spool) as $t,
                    ],
                    displacement_tolerance: (reach + growth) as $t,
                    tolerance_growth: growth as $t,
                    friction_jump: (FRICTION * s.capacity) as $t,
                    reversal_velocity: (NEAR_REVERSAL * trip.velocity) as $t,
                    still_change: [
                        (STILL_CHANGE * noise.force_noise) as $t,
                        (STILL_CHANGE * noise.displacement_noise) as $t,
                        (STILL_CHANGE * noise.velocity_noise) as $t,
                        (STILL_CHANGE * noise.spool_noise) as $t,
                    ],
                    liveliness_gain: s.share(1.0) as $t,
                    still_probability: exponential(-s.readings) as $t,
                    slope_gain: s.share(SLOPE_CORNER) as $t,
                    confirmations: lost_samples / 2 + 1,
                }
            }
        }

        impl LoadPressureWatch<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Option<Self> {
                let Scales { rig, noise, trip, .. } = s;
                if noise.load_pressure_tolerance >= LARGEST {
                    return None;
                }
                let pressure_noise = noise.force_noise / rig.piston_area;
                let tolerance = noise.load_pressure_tolerance + 4.0 * noise.force_noise;
                let swing = s.angle(FASTEST_SIGNAL) * trip.force / rig.piston_area;
                Some(Self {
                    area: rig.piston_area as $t,
                    jump: (FORCE_GATE * (s.spread() * pressure_noise + swing)) as $t,
                    still: (STILL_CHANGE * pressure_noise) as $t,
                    tolerance: tolerance as $t,
                    latency: (PRESSURE_LATENCY * rig.sample_rate) as $t,
                    limit: (PRESSURE_TIME * tolerance) as $t,
                })
            }
        }

        impl FlowLimits<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let Scales { rig, noise, trip, .. } = s;
                let (full_flow, flow_noise) = (s.full_flow, s.drift_factor() * s.flow_noise());
                let walk = s.walk(s.flow_noise());
                // Seven standard deviations of the displacement's noise at both ends of a sum, and one per cent.
                let travel = 16.0 * noise.displacement_noise + 0.01 * trip.displacement;
                Self {
                    high: s.share(FAST_CORNER) as $t,
                    fast_decay: (1.0 - s.share(1.6)) as $t,
                    drift: (flow_noise + FLOW_OFFSET * full_flow) as $t,
                    fast_drift: (flow_noise + FAST_FLOW_OFFSET * full_flow) as $t,
                    null_drift: (OVERLAP_FLOW * full_flow) as $t,
                    slow: (1.5 * rig.piston_area * travel + walk) as $t,
                    fast: (FRICTION * s.capacity * rig.compressibility / rig.piston_area + walk) as $t,
                    wrong_sign: (WRONG_SIGN * FRICTION * s.capacity * rig.compressibility / rig.piston_area
                        + walk) as $t,
                }
            }
        }

        impl MotionLimits<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let Scales { noise, .. } = s;
                let walk = s.walk(noise.velocity_noise);
                // Seven standard deviations of the displacement's low-passed noise at both ends of a sum. The further
                // low-pass of the ratio leaves about half of it.
                let (travel, ratio) =
                    (5.0 * noise.displacement_noise + walk, 3.0 * noise.displacement_noise + walk);
                Self {
                    drift: (s.drift_factor() * noise.velocity_noise) as $t,
                    // A walk against a drift exceeds a limit with a probability of exp(−2·drift·limit/variance).
                    ratio_drift: (0.5 * s.readings * ratio_walk(s) / ratio) as $t,
                    travel: travel as $t,
                    ratio: ratio as $t,
                    latency: LATENCY as $t,
                }
            }
        }

        impl SpoolLimits<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let Scales { rig, .. } = s;
                let lag =
                    0.5 * rig.response_delay * rig.sample_rate + 0.5 * (1.0 + rig.computation_delay as f64);
                let noise = s.drift_factor() * s.noise.spool_noise;
                Self {
                    lag: (1.0 / (1.0 + lag)) as $t,
                    drift: (noise + 0.03) as $t,
                    against_drift: noise as $t,
                    difference: 2.0e-3,
                    against: OPPOSED_TRAVEL as $t,
                }
            }
        }

        impl Following<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let Scales { rig, trip, .. } = s;
                let has_level = s.force_warning < LARGEST;
                let brake = if has_level { BRAKE * s.force_warning } else { BRAKE_OF_CAPACITY * s.capacity };
                Self {
                    low_gain: s.share(FLOW_VELOCITY_CORNER) as $t,
                    fade: (1.0 - 1.0 / (1.0 + rig.response_delay * rig.sample_rate)) as $t,
                    brake: brake as $t,
                    per_brake_velocity: (1.0 / (FULL_BRAKE_VELOCITY * trip.velocity)) as $t,
                }
            }
        }

        impl ReversalWatch<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let offset = FLOW_OFFSET * s.full_flow / s.rig.piston_area;
                let (drift, limit) = ((0.25 * offset) as $t, reversal_path(s) as $t);
                Self { slow: offset as $t, drift, limit }
            }
        }

        impl ZeroForceWatch<$t> {
            #[inline(always)]
            const fn by(s: &Scales<'_>) -> Self {
                let low = s.share(RESIDUAL_CORNER);
                let noise = ZERO_DEVIATIONS * s.noise.force_noise * root(1e4 * low / (2.0 - low)) / 100.0;
                Self {
                    offset: (ZERO_OFFSET * s.capacity + noise) as $t,
                    // A reading without noise stays the same; this is what the repetitions notice.
                    noise: (if s.noise.force_noise > 0.0 { noise } else { -1.0 }) as $t,
                    change: (COMMAND_CHANGE * noise) as $t,
                    path: (ZERO_PATH * s.noise.displacement_noise) as $t,
                    time: ZERO_TIME as $t,
                    mean_gain: s.share(MEAN_CORNER) as $t,
                }
            }
        }

        impl<const N: usize> Plausibility<$t, N> {
            /// Makes the watch of a rig and its protection in `place`, because the stack has no space for a second one.
            #[inline(never)]
            pub(crate) const fn make_in(
                place: &mut Option<Self>,
                p: &Parameters,
                protection: &ProtectionParameters,
                watch: &PlausibilityParameters,
            ) -> Result<(), ConfigError> {
                let s = check!(Scales::new(p, protection, watch));
                let senses_velocity = matches!(p.velocity_source, VelocitySource::Sensor);
                let force_jump = p.piston_area * p.piston_area / (p.compressibility * p.sample_rate);
                *place = Some(Self {
                    model: FlowModel::<$t, N>::EMPTY,
                    gate: SensorGate::<$t>::by(&s, protection.lost_samples),
                    derivative: check!(FilteredDerivative::<$t>::new(RESIDUAL_CORNER, p.sample_rate)),
                    lost_samples: protection.lost_samples,
                    repeats: repeats(&s) as u32,
                    short_gap: short_gap(&s),
                    senses_velocity,
                    fast_velocity: matches!(
                        p.velocity_source,
                        VelocitySource::Sensor | VelocitySource::Accelerometer { .. }
                    ),
                    period: (1.0 / p.sample_rate) as $t,
                    rate: p.sample_rate as $t,
                    area: p.piston_area as $t,
                    leakage: (p.leakage / p.piston_area) as $t,
                    oil: (p.compressibility / p.piston_area) as $t,
                    valve_gain: p.valve_gain as $t,
                    null_bias: check!(null_bias(p)) as $t,
                    low_gain: s.share(RESIDUAL_CORNER) as $t,
                    ratio_gain: s.share(RATIO_CORNER) as $t,
                    spool_gain: s.share(SPOOL_CORNER) as $t,
                    decay: (1.0 - s.share(1.0)) as $t,
                    per_reversal: (1.0 / (REVERSAL_VELOCITY * s.trip.velocity)) as $t,
                    balance: FlowLimits::<$t>::by(&s),
                    motion: MotionLimits::<$t>::by(&s),
                    stroke: SpoolLimits::<$t>::by(&s),
                    reversal: ReversalWatch::<$t>::by(&s),
                    zero_force: ZeroForceWatch::<$t>::by(&s),
                    following: Following::<$t>::by(&s),
                    force_jump: if senses_velocity { 0.0 } else { force_jump as $t },
                    force_error_limit: (10.0 * s.noise.force_noise + 0.15 * s.trip.force) as $t,
                    changes: [
                        (10.0 * s.noise.force_noise + 0.02 * s.trip.force) as $t,
                        (10.0 * s.noise.displacement_noise) as $t,
                    ],
                    load_pressure: LoadPressureWatch::<$t>::by(&s),
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
