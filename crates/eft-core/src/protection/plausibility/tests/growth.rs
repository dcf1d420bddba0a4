//! The growth of the sums in a tick, for signals whose filters and residuals are known in closed form.

use super::*;
use crate::protection::plausibility::balance::SETTLING_TIME;

const AREA: f64 = 8.212e-3;
const PERIOD: f64 = 1.0 / 4096.0;
/// Flow (m³/s) of the paper's valve at openings of 0.3 and 0.1: 260.4 and 102.2 in³/s.
const AT_THREE_TENTHS: f64 = 260.4 * 1.6387064e-5;
const AT_ONE_TENTH: f64 = 102.2 * 1.6387064e-5;

/// Steady signals of a rig; the displacement has a separate velocity.
#[derive(Clone, Copy)]
struct Steady {
    force: f64,
    velocity: f64,
    travel: f64,
    spool: f64,
    valve_command: f64,
}

/// The sums, and the average that compares the two velocities, after one tick of such a rig with settled filters.
fn grown(rig: Steady) -> ([[f64; 2]; 7], f64) {
    let watch = watch();
    let mut state = PlausibilityState::default();
    let control = Control { valve_command: rig.valve_command, ..CONTROL };
    for n in 0..20_000 {
        if n == 19_999 {
            sums(&mut state).into_iter().for_each(|sum| *sum = Cusum::default());
        }
        // A steady flow that is missing would be taken for a null bias.
        state.opening_offset = Default::default();
        let Steady { force, velocity, spool, .. } = rig;
        let displacement = rig.travel * PERIOD * f64::from(n);
        let input = Input { command: 0.0, force, displacement, velocity, spool, ..Input::default() };
        watch.judge(&mut state, &input, velocity, &control);
    }
    (sums(&mut state).map(|sum| [sum.above, sum.below]), state.motion.misfit)
}

fn near(what: &str, found: f64, expected: f64) {
    let scale = expected.abs().max(1e-12);
    assert!((found - expected).abs() < 2e-4 * scale, "{what}: {found:e}, not {expected:e}");
}

#[test]
fn a_steady_flow_is_compared_with_half_of_the_larger_one() {
    // Under 4 kN the valve passes √(1 − 4/156.028) of its flow at 3 V. An error of 5 % of the greatest flow is allowed.
    let valve_flow = AT_THREE_TENTHS * libm::sqrt(1.0 - 4e3 / (AREA * 1.9e7));
    let leaked = 1.3e-11 / AREA * 4e3;
    let drift = watch().balance.drift;
    let rig = Steady { force: 4e3, velocity: 0.0, travel: 0.0, spool: 0.3, valve_command: 3.0 };
    let (sums, _) = grown(rig);
    near("held", sums[BALANCE][1], PERIOD * (valve_flow - leaked - 0.5 * valve_flow - drift));
    assert_eq!([sums[BALANCE][0], sums[STROKE][0], sums[STROKE][1]].map(f64::to_bits), [0; 3]);
    let velocity = 2.5 * valve_flow / AREA;
    let (sums, _) = grown(Steady { velocity, travel: velocity, ..rig });
    let load_flow = 2.5 * valve_flow + leaked;
    near("fast", sums[BALANCE][0], PERIOD * (load_flow - valve_flow - 0.5 * load_flow - drift));
    for n in [FAST, TRAVEL, TURNED, RATIO] {
        assert_eq!(sums[n].map(f64::to_bits), [0; 2], "{n}");
    }
}

#[test]
fn velocity_and_displacement_may_differ_by_a_twentieth() {
    let MotionLimits { drift, ratio_drift, .. } = watch().motion;
    let rig = Steady { force: 0.0, velocity: 0.3, travel: 0.2, spool: 0.1, valve_command: 1.0 };
    let (sums, misfit) = grown(rig);
    near("travel", sums[TRAVEL][0], PERIOD * (0.1 - 0.05 * 0.3 - drift));
    near("ratio", sums[RATIO][0], PERIOD * (0.1 - 0.05 * 0.3));
    // The flow's residual with the velocity, and with the mean of both.
    near("worse", misfit, 0.1 * (AREA * 0.3 - AT_ONE_TENTH - 0.5 * AREA * 0.1));
    let (sums, _) = grown(Steady { travel: 0.4, ..rig });
    near("travel", sums[TRAVEL][1], PERIOD * (0.1 - 0.05 * 0.4 - drift));
    near("ratio", sums[RATIO][1], PERIOD * (0.1 - 0.05 * 0.3));
    // A velocity that is too large backwards counts as above as well. Below 1 % of the trip level, 12 mm/s, the
    // direction has a smaller weight.
    let (sums, _) = grown(Steady { velocity: -0.3, travel: -0.2, spool: -0.1, valve_command: -1.0, ..rig });
    near("backwards", sums[RATIO][0], PERIOD * (0.1 - 0.05 * 0.3));
    let (sums, _) = grown(Steady { velocity: 0.006, travel: 0.0, spool: 0.0, valve_command: 0.0, ..rig });
    near("slow", sums[RATIO][0], PERIOD * (0.5 * 0.006 - 0.04 * 0.006 - ratio_drift));
}

#[test]
fn spool_and_command_may_differ_by_three_tenths() {
    let rig = Steady { force: 0.0, velocity: 0.0, travel: 0.0, spool: 0.3, valve_command: 1.0 };
    let drift = watch().stroke.drift;
    near("ahead", grown(rig).0[STROKE][0], PERIOD * (0.2 - 0.3 * 0.3 - drift));
    let behind = grown(Steady { spool: 0.1, valve_command: 4.0, ..rig }).0[STROKE];
    near("behind", behind[1], PERIOD * (0.3 - 0.3 * 0.4 - drift));
    let unknown = grown(Steady { valve_command: f64::NAN, ..rig }).0[STROKE];
    assert_eq!(unknown.map(f64::to_bits), [0; 2]);
}

/// The sums after the first tick from a long rest, in which force (N) and spool (1) step: only the means over the tick
/// pass.
fn first(force: f64, spool: f64, fast_velocity: bool) -> [[f64; 2]; 7] {
    let watch = Plausibility { fast_velocity, ..watch() };
    let mut state = PlausibilityState::default();
    state.balance.age = SETTLING_TIME;
    let control = CONTROL;
    let input = Input { command: 0.0, force, displacement: 0.0, velocity: 0.0, spool, ..Input::default() };
    watch.compare(&mut state, &input, 0.0, &watch.valve_flow(&input, &control), &control);
    sums(&mut state).map(|sum| [sum.above, sum.below])
}

#[test]
fn above_the_motions_frequencies_the_force_shows_in_the_oils_flow() {
    let Parameters { compressibility, leakage, .. } = Parameters::ZHAO2005;
    // A low-pass of 80 Hz passes a ninth of a step, and two high-passes of 15 Hz nearly all of that.
    let (low_gain, once) = (0.1156239, 1.0 - 0.02274800);
    let twice = once * once;
    for (force, opening, flow, overlap) in
        [(-2e3, 0.1, AT_ONE_TENTH, 0.0), (-4e3, 0.1, AT_ONE_TENTH, 0.0), (2e3, 0.02, 0.2 * AT_ONE_TENTH, 1.0)]
    {
        let root = libm::sqrt(1.0 - force / (AREA * 1.9e7));
        let valve_flow = low_gain * 0.5 * root * flow;
        let load_flow = low_gain * leakage / AREA * force;
        let oil = compressibility / AREA * 4096.0 * low_gain * force;
        // Within 3 % of null an overlap may block the flow.
        let overlap_flow = overlap * once * valve_flow;
        let drift = watch().balance.fast_drift;
        let residual = twice * (load_flow + oil - valve_flow);
        let [above, below] = first(force, opening, true)[FAST];
        let tolerance = twice * (0.2 * valve_flow + 0.6 * oil.abs()) + drift + overlap_flow;
        near("above", above, (PERIOD * (residual - tolerance)).max(0.0));
        near("below", below, (PERIOD * (-residual - tolerance)).max(0.0));
        // If the oil's flow from the force and that from the rest are opposed, the smaller one counts.
        let opposition = if force < 0.0 { twice * (valve_flow - load_flow).min(-oil) } else { 0.0 };
        let tolerance = twice * 0.2 * valve_flow + drift + 0.25 * overlap_flow;
        let [wrong_sign, _] = first(force, opening, true)[TURNED];
        near("turned", wrong_sign, (PERIOD * (opposition - tolerance)).max(0.0));
        assert!(force > 0.0 || (wrong_sign > 0.0 && below > 0.0));
        // With a velocity that does not follow fast motions none of this counts.
        let estimated = first(force, opening, false);
        assert_eq!([estimated[FAST], estimated[TURNED]].concat(), [0.0; 4]);
    }
}

#[test]
fn an_opening_near_null_counts_whole_and_fades_with_the_high_pass() {
    let (watch, mut state) = (watch(), PlausibilityState::default());
    let control = CONTROL;
    let mut near_null = |spool: f64| {
        let input = Input { command: 0.0, force: 0.0, displacement: 0.0, spool, ..Input::default() };
        watch.compare(&mut state, &input, 0.0, &watch.valve_flow(&input, &control), &control);
        state.balance.near_null
    };
    near("within 3 %", near_null(-0.029), 1.0);
    near("beyond", near_null(0.031), 1.0 - 0.02274800);
    near("later", near_null(0.031), (1.0 - 0.02274800) * (1.0 - 0.02274800));
}
