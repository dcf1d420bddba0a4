//! The watch with signals whose balance is known in closed form.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod equations;
mod growth;
mod judgement;
mod motion;
mod opening_offset;
mod wrong_sign;
mod wrong_spool;

use core::cell::Cell;

use super::*;
use crate::parameters::Parameters;
use crate::parameters::{Levels, PlausibilityParameters, ProtectionParameters};
use crate::protection::gate::{DISPLACEMENT, FORCE, SPOOL, VELOCITY};
use crate::protection::plausibility::comparisons::FlowBalance;
use crate::protection::plausibility::sums::Cusum;
use crate::table::FlowTable;

/// The sums, in their order.
pub(super) const BALANCE: usize = 0;
pub(super) const FAST: usize = 1;
pub(super) const TRAVEL: usize = 2;
pub(super) const STROKE: usize = 3;
pub(super) const TURNED: usize = 4;
pub(super) const RATIO: usize = 5;
pub(super) const AGAINST: usize = 6;

pub(super) fn sums(state: &mut PlausibilityState<f64>) -> [&mut Cusum<f64>; 7] {
    let PlausibilityState { balance: FlowBalance { slow, fast, wrong_sign, .. }, motion, stroke, .. } = state;
    [
        slow,
        fast,
        &mut motion.travel,
        &mut stroke.difference,
        wrong_sign,
        &mut motion.ratio,
        &mut stroke.against,
    ]
}

pub(super) fn limits(watch: &mut Plausibility<f64, 21>) -> [&mut f64; 7] {
    let Plausibility { balance: FlowLimits { slow, fast, wrong_sign, .. }, motion, stroke, .. } = watch;
    [
        slow,
        fast,
        &mut motion.travel,
        &mut stroke.difference,
        wrong_sign,
        &mut motion.ratio,
        &mut stroke.against,
    ]
}

const RIG: Parameters = Parameters::ZHAO2005;
const STEP: f64 = 1.0 / RIG.sample_rate;

pub(super) fn watch() -> Plausibility<f64, 21> {
    watch_of(1.2, &PlausibilityParameters::DEFAULT)
}

/// The paper's rig with this trip level of the velocity (m/s), and this noise.
fn watch_of(velocity: f64, noise: &PlausibilityParameters) -> Plausibility<f64, 21> {
    let to = |trip: f64| Levels { warning: trip, trip };
    let protection = ProtectionParameters {
        force: to(20e3),
        displacement: to(0.115),
        velocity: to(velocity),
        spool: to(0.8),
        ..ProtectionParameters::DEFAULT
    };
    let mut place = None;
    Plausibility::<f64, 21>::make_in(&mut place, &RIG, &protection, noise).unwrap();
    place.unwrap()
}

/// The nominal calibration and supply, without a known valve command.
pub(super) const CONTROL: Control<f64> = Control {
    command: 0.0,
    valve_command: f64::NAN,
    flow_gain: 1.0,
    valve_gain: 1.0,
    supply: 1.0,
    tripped: false,
};

/// Force, displacement, velocity and spool of a sample.
type Readings = [f64; 4];

/// The time (s) at which the watch names a cause for these readings, and the cause.
fn named(seconds: f64, readings: impl Fn(f64) -> Readings) -> Option<(f64, Cause)> {
    named_by(&watch(), seconds, readings)
}

/// The same for another watch.
fn named_by(
    watch: &Plausibility<f64, 21>,
    seconds: f64,
    readings: impl Fn(f64) -> Readings,
) -> Option<(f64, Cause)> {
    let mut state = PlausibilityState::default();
    let control = CONTROL;
    (0..(seconds * RIG.sample_rate) as u32).find_map(|n| {
        let time = f64::from(n) * STEP;
        let [force, displacement, velocity, spool] = readings(time);
        let input = Input { command: 0.0, force, displacement, velocity, spool, ..Input::default() };
        let input = watch.gate(&mut state, &input);
        match watch.judge(&mut state, &input, input.velocity, &control) {
            Cause::None => None,
            cause => Some((time, cause)),
        }
    })
}

/// A piston that swings at 2 Hz and 0.2 m/s without force, in balance with the valve's flow.
fn swing(time: f64) -> Readings {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let rate = core::f64::consts::TAU * 2.0;
    let velocity = 0.2 * libm::sin(rate * time);
    let displacement = 0.2 / rate * (1.0 - libm::cos(rate * time));
    [0.0, displacement, velocity, table.opening(RIG.piston_area * velocity)]
}

/// The swing, with a factor on displacement and velocity that appears from 1.05 s on within a time (s).
fn swing_by(displacement: f64, velocity: f64, within: f64) -> Option<(f64, Cause)> {
    named(6.0, |time| {
        let [force, x, v, spool] = swing(time);
        let come = ((time - 1.05) / within).clamp(0.0, 1.0);
        let [of_x, of_v] = [displacement, velocity].map(|factor| 1.0 + come * (factor - 1.0));
        // Without a jump, which the gate would reject.
        [force, of_x * x + (1.0 - of_x) * swing(1.05)[1], of_v * v, spool]
    })
}

#[test]
fn velocity_and_displacement_may_differ_by_four_hundredths_and_not_by_a_tenth() {
    for factor in [0.96, 1.0, 1.04] {
        assert_eq!((swing_by(1.0, factor, 1.0), swing_by(factor, 1.0, 1.0)), (None, None), "{factor}");
    }
    // The larger of the two is distrusted.
    let larger = [(1.0, 1.1, Cause::VelocityImplausible), (1.0, 0.9, Cause::DisplacementImplausible)];
    for (displacement, velocity, cause) in larger {
        let Some((time, named)) = swing_by(displacement, velocity, 0.2) else {
            panic!("{velocity} is not noticed")
        };
        assert_eq!(named, cause);
        assert!((1.05..1.4).contains(&time), "{velocity}: {time}");
    }
}

/// The fastest motion of the paper's piston with a velocity that is late (s), and that reads this share more than the
/// displacement from 1.1 s on.
fn late_swing(frequency: f64, speed: f64, latency: f64, excess: f64) -> Option<(f64, Cause)> {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let rate = core::f64::consts::TAU * frequency;
    let velocity = |time: f64| speed * libm::sin(rate * time.max(0.0));
    named(3.0, |time| {
        let displacement = speed / rate * (1.0 - libm::cos(rate * time));
        let factor = if time > 1.1 { 1.0 + excess } else { 1.0 };
        [
            0.0,
            displacement,
            factor * velocity(time - latency),
            table.opening(RIG.piston_area * velocity(time)),
        ]
    })
}

/// Random numbers with the variance of one.
fn deviations() -> impl Fn() -> f64 {
    let random = Cell::new(20051_u64);
    // Twelve uniform numbers have this variance.
    move || {
        (0..12).fold(-6.0, |sum, _| {
            random.set(random.get().wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1));
            sum + (random.get() >> 11) as f64 / (1_u64 << 53) as f64
        })
    }
}

/// Largest ratio's sum over its limit in 100 s of a motion of 2 mm/s at 9 Hz, with gains that differ by 3.6 % and with
/// noise of twice the usual size. The residual without noise may be larger by this drift (m/s).
fn walk(drift: impl Fn(f64) -> f64) -> f64 {
    let usual = PlausibilityParameters::DEFAULT;
    let noise = PlausibilityParameters {
        displacement_noise: 2.0 * usual.displacement_noise,
        velocity_noise: 2.0 * usual.velocity_noise,
        ..usual
    };
    let mut watch = watch_of(0.1, &noise);
    watch.motion.ratio_drift = drift(watch.motion.ratio_drift);
    let deviation = deviations();
    let (rate, mut state, mut largest) = (core::f64::consts::TAU * 9.0, PlausibilityState::default(), 0.0);
    let control = CONTROL;
    for time in (0..409_600).map(|n| f64::from(n) * STEP) {
        let displacement = -2e-3 / rate * libm::cos(rate * time) + noise.displacement_noise * deviation();
        let velocity = 1.036 * 2e-3 * libm::sin(rate * time) + noise.velocity_noise * deviation();
        let input = Input { force: 0.0, displacement, velocity, spool: 0.0, ..Input::default() };
        watch.compare(&mut state, &input, velocity, &watch.valve_flow(&input, &control), &control);
        let Cusum { above, below } = state.motion.ratio;
        largest = f64::max(largest, f64::max(above, below) / watch.motion.ratio);
    }
    largest
}

#[test]
fn noise_does_not_walk_to_the_limit_of_the_ratio() {
    // Of e^25 walks one reaches the limit, so that of some thousand the largest reaches a third.
    let largest = walk(|drift| drift);
    assert!((0.1..0.6).contains(&largest), "{largest}");
    let without = walk(|_| 0.0);
    assert!(without > 1.0, "{without}");
}

// SR-19
#[test]
fn two_milliseconds_between_velocity_and_displacement_are_no_contradiction() {
    for (frequency, speed) in [(0.5, 0.35), (1.5, 0.8), (2.0, 0.9), (4.0, 0.8), (6.0, 0.6), (10.0, 0.4)] {
        for latency in [-2.0e-3, -1.5e-3, 0.0, 1.5e-3, 2.0e-3] {
            assert_eq!(late_swing(frequency, speed, latency, 0.0), None, "{frequency} Hz, {latency} s");
            let found = late_swing(frequency, speed, latency, 0.12);
            let after = found.map_or(f64::INFINITY, |(time, _)| time - 1.1);
            assert!((0.0..0.6).contains(&after), "{frequency} Hz, {latency} s: {found:?}");
        }
    }
}

#[test]
fn a_change_of_the_velocitys_source_makes_no_step() {
    let watch = watch();
    let mut state = PlausibilityState::default();
    for n in 0..100 {
        assert_eq!(watch.fade_source(&mut state, 0.5, 0).to_bits(), 0.5_f64.to_bits(), "{n}");
    }
    // After the valve's response delay a share of 1/e remains.
    let ticks = (RIG.response_delay * RIG.sample_rate) as u32;
    let valve_flow = (0..=ticks).fold([0.5; 2], |[_, before], n| {
        let now = watch.fade_source(&mut state, 0.4, 1);
        assert!(now < before && now > 0.4 && before - now < 0.006, "{n}: {before} {now}");
        [before, now]
    });
    assert!((valve_flow[1] - 0.4 - 0.1 / core::f64::consts::E).abs() < 3e-3, "{valve_flow:?}");
    // A lost velocity changes nothing.
    let before = state;
    assert!(watch.fade_source(&mut state, f64::NAN, 2).is_nan());
    assert_eq!(state, before);
}

#[test]
fn neither_a_start_off_the_middle_nor_samples_that_are_lost_look_like_motion() {
    let watched = named(3.0, |time| {
        let [force, x, v, spool] = swing(time);
        // Nine samples of each quarter of a second.
        let displacement = if time % 0.25 < 9.0 * STEP && time > 0.1 { f64::NAN } else { 0.05 + x };
        [force, displacement, v, spool]
    });
    assert_eq!(watched, None);
}

#[test]
fn single_lost_samples_add_no_noise_to_the_travel() {
    let noise = PlausibilityParameters::DEFAULT;
    for lost in [FORCE, DISPLACEMENT, VELOCITY, SPOOL] {
        let (deviation, count) = (deviations(), Cell::new(0));
        let watched = named(20.0, |time| {
            let mut readings = swing(time);
            readings[DISPLACEMENT] += noise.displacement_noise * deviation();
            readings[VELOCITY] += noise.velocity_noise * deviation();
            count.set((count.get() + 1) % 50);
            if count.get() == 0 {
                readings[lost] = f64::NAN;
            }
            readings
        });
        assert_eq!(watched, None, "{lost}");
    }
}

#[test]
fn the_derivative_of_a_displacement_with_lost_samples_keeps_its_slope() {
    let (watch, mut state) = (watch(), PlausibilityState::default());
    for tick in 0..2000 {
        // Two of ten samples in a row, and one alone.
        let lost = matches!(tick % 10, 3 | 4 | 8);
        let displacement = if lost { f64::NAN } else { 0.3 * STEP * f64::from(tick) };
        watch.filter(&mut state, displacement, 0.3);
    }
    assert!((state.velocity - 0.3).abs() < 1e-9, "{}", state.velocity);
}

// SR-06
#[test]
fn the_brake_is_a_force_in_the_direction_of_the_velocity_up_to_a_limit() {
    let watch = watch();
    // 40 % of the force level of 20 kN, from a sixth of the velocity level of 1.2 m/s on.
    for (velocity, force) in [(0.0, 0.0), (0.05, 2e3), (0.2, 8e3), (1.0, 8e3)] {
        for side in [1.0, -1.0] {
            for share in [0.0, 0.5, 1.0] {
                let mut state = PlausibilityState::default();
                let braking =
                    (0..1000).map(|_| watch.brake(&mut state, side * velocity, share)).last().unwrap();
                assert!((braking - share * side * force).abs() < 1e-6, "{velocity}: {braking}");
                // A lost velocity leaves it.
                assert_eq!(watch.brake(&mut state, f64::NAN, share).to_bits(), braking.to_bits());
            }
        }
    }
    // A quarter of a velocity at 60 Hz passes the low-pass of 15 Hz.
    let mut state = PlausibilityState::default();
    let most = (0..4096).map(|tick| {
        let angle = core::f64::consts::TAU * 60.0 * f64::from(tick) / 4096.0;
        let braking = watch.brake(&mut state, 0.1 * libm::sin(angle), 1.0);
        if tick > 1000 { braking.abs() } else { 0.0 }
    });
    let share = most.fold(0.0, f64::max) / 4e3;
    assert!((share - 0.243).abs() < 0.01, "{share}");
}
