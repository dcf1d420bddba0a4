//! One tick of the watch against the equations of its residuals and tolerances, from a state without a zero.

use super::*;
use crate::protection::plausibility::balance::SETTLING_TIME;
use crate::protection::plausibility::comparisons::{FlowBalance, MotionSums, SpoolSums};
use crate::protection::plausibility::opening_offset::OpeningOffset;
use crate::protection::plausibility::sums::{CusumStart, envelope, high_pass, low_pass};

pub(super) const PERIOD: f64 = 1.0 / 4096.0;
pub(super) const SPOOL: f64 = 0.2;
pub(super) const FORCE: f64 = 4000.0;
pub(super) const VELOCITY: f64 = 0.3;
pub(super) const DISPLACEMENT: f64 = 0.01;

/// The paper's rig with round coefficients and wide limits.
pub(super) fn round() -> Plausibility<f64, 21> {
    let watch = watch();
    Plausibility {
        period: PERIOD,
        rate: 4096.0,
        area: 2.0,
        leakage: 1e-4,
        oil: 1e-7,
        low_gain: 0.5,
        ratio_gain: 0.375,
        spool_gain: 0.125,
        decay: 0.9,
        per_reversal: 0.7,
        balance: FlowLimits {
            high: 0.25,
            fast_decay: 0.8,
            drift: 0.011,
            fast_drift: 0.013,
            null_drift: 0.05,
            slow: 90.0,
            fast: 91.0,
            wrong_sign: 94.0,
        },
        motion: MotionLimits { drift: 0.017, ratio_drift: 0.007, travel: 92.0, ratio: 95.0, latency: 0.003 },
        stroke: SpoolLimits { lag: 0.2, drift: 0.019, against_drift: 0.001, difference: 93.0, against: 96.0 },
        following: Following { low_gain: 0.3, ..watch.following },
        senses_velocity: true,
        fast_velocity: true,
        ..watch
    }
}

/// Each sum begins in its middle.
const MIDDLE: f64 = 1.0;

/// A null bias and an asymmetry.
fn uneven() -> OpeningOffset<f64> {
    let mut opening_offset = OpeningOffset::default();
    for opening in [0.05, 0.15, 0.1, 0.4] {
        opening_offset.add(0.01 + 0.03 * opening, opening, 0.25);
    }
    opening_offset
}

pub(super) fn before() -> PlausibilityState<f64> {
    let sum = Cusum { above: MIDDLE, below: MIDDLE };
    PlausibilityState {
        balance: FlowBalance {
            age: 1.0,
            last_flow: 0.003,
            valve_flow: 0.4,
            load_flow: 0.7,
            force: 3000.0,
            fast_residual: [0.06, 0.01],
            fast_valve_flow: [0.05, 0.02],
            fast_oil_flow: [0.08, 0.03],
            flow_envelope: 0.9,
            fast_valve_envelope: 0.02,
            fast_oil_envelope: 0.03,
            near_null: 0.8,
            slow: sum,
            fast: sum,
            wrong_sign: sum,
        },
        motion: MotionSums {
            last_velocity: 0.26,
            last_displacement: 0.0098,
            velocity: 0.2,
            displacement: 0.009,
            ratio_velocity: 0.21,
            ratio_difference: 0.04,
            ratio_residual: 0.05,
            speed_envelope: 0.25,
            travel: sum,
            ratio: sum,
            travel_start: CusumStart { above: 0.1, below: 0.15 },
            ratio_start: CusumStart { above: 0.5, below: 0.6 },
            misfit: 0.002,
            mean_square_speed: 0.5,
            ticks: 1,
            ..MotionSums::default()
        },
        stroke: SpoolSums {
            first: 0.11,
            opening: 0.16,
            commanded: 0.13,
            measured: 0.18,
            commanded_mean: 0.12,
            measured_mean: 0.2,
            opening_envelope: 0.1,
            difference: sum,
            against: sum,
        },
        opening_offset: uneven(),
        ..PlausibilityState::default()
    }
}

pub(super) fn input() -> Input<f64> {
    Input { force: FORCE, displacement: DISPLACEMENT, velocity: VELOCITY, spool: SPOOL, ..Input::default() }
}

pub(super) fn control() -> Control<f64> {
    Control { command: 0.0, valve_command: 1.0, flow_gain: 1.2, valve_gain: 1.0, supply: 0.9, tripped: false }
}

pub(super) fn sum(
    watch: &Plausibility<f64, 21>,
    state: &mut PlausibilityState<f64>,
    input: &Input<f64>,
    control: &Control<f64>,
) {
    watch.compare(state, input, VELOCITY, &watch.valve_flow(input, control), control);
}

pub(super) fn summed(
    watch: &Plausibility<f64, 21>,
    mut state: PlausibilityState<f64>,
) -> PlausibilityState<f64> {
    sum(watch, &mut state, &input(), &control());
    state
}

pub(super) fn near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{what}: {found:e}, not {expected:e}");
}

/// Residual and tolerance that this tick has added to a sum.
pub(super) fn added(what: &str, sum: &Cusum<f64>, residual: f64, tolerance: f64) {
    let [above, below] = [sum.above, sum.below].map(|size| (size - MIDDLE) / PERIOD);
    let difference = |found: f64, expected: f64| (found - expected).abs() > 1e-9;
    assert!(
        !difference(0.5 * (above - below), residual) && !difference(-0.5 * (above + below), tolerance),
        "{what}: {} and {}, not {residual} and {tolerance}",
        0.5 * (above - below),
        -0.5 * (above + below)
    );
}

/// Flow (m³/s) of the valve, of piston and leakage, and of the oil, low-passed.
pub(super) fn flows() -> [f64; 3] {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let root = libm::sqrt(0.9 - FORCE / (RIG.piston_area * RIG.supply_pressure));
    let mean = 0.5 * (1.2 * root * table.flow(SPOOL) + 0.003);
    let load_flow = 2.0 * 0.5 * (VELOCITY + 0.26) + 1e-4 * FORCE;
    [0.4 + 0.5 * (mean - 0.4), 0.7 + 0.5 * (load_flow - 0.7), 1e-7 * 4096.0 * 0.5 * (FORCE - 3000.0)]
}

/// Two equal high-passes of 0.25.
fn high([first, second]: [f64; 2], value: f64) -> f64 {
    let once = value - (first + 0.25 * (value - first));
    once - (second + 0.25 * (once - second))
}

#[test]
fn the_flow_balance_allows_half_of_the_flow_and_six_tenths_of_the_oils() {
    let state = summed(&round(), before());
    let [valve_flow, load_flow, oil] = flows();
    let envelope = f64::max(f64::max(valve_flow, load_flow), 0.9 * 0.9);
    added("balance", &state.balance.slow, load_flow + oil - valve_flow, 0.5 * envelope + 0.6 * oil + 0.011);
}

#[test]
fn an_envelope_of_the_flow_holds_the_larger_of_valve_and_piston() {
    for (most, valve_flow, load_flow) in [(9.0, 0.4, 0.7), (0.1, -9.0, 0.7), (0.1, 0.4, -9.0)] {
        let mut state = before();
        (state.balance.flow_envelope, state.balance.valve_flow, state.balance.load_flow) =
            (most, valve_flow, load_flow);
        let found = summed(&round(), state).balance;
        let [.., oil] = flows();
        let envelope = f64::max(f64::max(found.valve_flow.abs(), found.load_flow.abs()), 0.9 * most);
        added(
            "balance",
            &found.slow,
            found.load_flow + oil - found.valve_flow,
            0.5 * envelope + 0.6 * oil + 0.011,
        );
    }
}

/// Residual, valve's flow and oil's flow above the motion's frequencies, and the flow that an overlap may hide.
fn fast() -> [f64; 4] {
    let [valve_flow, load_flow, oil] = flows();
    // A share of 0.25 of the recent stay near null is forgotten. A high-pass passes three quarters of the step.
    let overlap_flow = f64::min(0.75 * 0.8 * 0.05, 0.75 * (valve_flow - 0.05).abs());
    [
        high([0.06, 0.01], load_flow + oil - valve_flow),
        high([0.05, 0.02], valve_flow),
        high([0.08, 0.03], oil),
        overlap_flow,
    ]
}

#[test]
fn the_fast_balance_allows_a_fifth_of_the_flow_and_the_overlap() {
    let state = summed(&round(), before());
    let [residual, flow, oil, overlap_flow] = fast();
    let envelope = [f64::max(flow.abs(), 0.8 * 0.02), f64::max(oil.abs(), 0.8 * 0.03)];
    added(
        "fast",
        &state.balance.fast,
        residual,
        0.2 * envelope[0] + 0.6 * envelope[1] + 0.013 + overlap_flow,
    );
}

#[test]
fn until_the_low_passes_have_settled_all_of_a_residual_is_its_mean() {
    let [valve_flow, load_flow, oil] = flows();
    let mut state = before();
    for age in [PERIOD, SETTLING_TIME - 0.5 * PERIOD] {
        state = before();
        state.balance.age = age;
        state = summed(&round(), state);
        near("mean", state.balance.fast_residual[0], load_flow + oil - valve_flow);
        assert!(state.balance.fast_residual[1].abs() < 1e-12, "{age}");
        // Nothing but the tolerance is added: the envelopes fade.
        let tolerance = 0.2 * 0.8 * 0.02 + 0.013;
        added("fast", &state.balance.fast, 0.0, tolerance + 0.6 * 0.8 * 0.03);
        near("turned", (state.balance.wrong_sign.above - MIDDLE) / PERIOD, -tolerance);
    }
    assert!((state.balance.age - SETTLING_TIME - 0.5 * PERIOD).abs() < 1e-12);
    // The force before the first sample counts as the first one.
    state.balance.age = 0.0;
    near("force", summed(&round(), state).balance.force, FORCE);
}

#[test]
fn only_near_null_an_overlap_hides_flow() {
    // Far from null for long, and at its edge.
    for (spool, near_null, share) in
        [(0.2, 0.0, 0.0), (0.031, 0.0, 0.0), (0.029, 0.0, 1.0), (-0.029, 0.5, 1.0)]
    {
        let (watch, mut state) = (round(), before());
        state.balance.near_null = near_null;
        sum(&watch, &mut state, &Input { spool, ..input() }, &control());
        near("nearness", 1.0 + state.balance.near_null, 1.0 + share);
    }
    // An overlap hides no more than the flow that changes.
    let mut watch = round();
    watch.balance.null_drift = 1e3;
    let [residual, flow, oil, _] = fast();
    let [valve_flow, ..] = flows();
    let envelope = [f64::max(flow.abs(), 0.8 * 0.02), f64::max(oil.abs(), 0.8 * 0.03)];
    let overlap_flow = 0.75 * (valve_flow - 0.05).abs();
    let state = summed(&watch, before());
    added(
        "fast",
        &state.balance.fast,
        residual,
        0.2 * envelope[0] + 0.6 * envelope[1] + 0.013 + overlap_flow,
    );
}

#[test]
fn a_turned_force_is_the_opposition_of_measured_and_expected_oil_flow() {
    let state = summed(&round(), before());
    let [residual, flow, oil, overlap_flow] = fast();
    let expected = oil - residual;
    let size = f64::min(oil.abs(), expected.abs());
    let opposition = if (oil > 0.0) == (expected > 0.0) { -size } else { size };
    let tolerance = 0.2 * f64::max(flow.abs(), 0.8 * 0.02) + 0.013 + 0.25 * overlap_flow;
    near("above", (state.balance.wrong_sign.above - MIDDLE) / PERIOD, opposition - tolerance);
    near("agreement does not count", 1.0 + state.balance.wrong_sign.below, 1.0);
}

#[test]
fn the_spool_may_differ_from_its_command_by_three_tenths() {
    let state = summed(&round(), before());
    let (commanded, spool) = (0.13 + 0.125 * (0.16 - 0.13), 0.18 + 0.125 * (SPOOL - 0.18));
    let envelope = f64::max(f64::max(commanded, spool), 0.9 * 0.1);
    added("stroke", &state.stroke.difference, spool - commanded, 0.3 * envelope + 0.019);
    // Without a valve command there is nothing to compare.
    let mut state = before();
    sum(&round(), &mut state, &input(), &Control { valve_command: f64::NAN, ..control() });
    assert_eq!(state.stroke, before().stroke);
}

#[test]
fn a_spool_moves_against_its_command_by_the_smaller_of_the_opposed_swings() {
    let (commanded, spool) = (0.13 + 0.125 * (0.16 - 0.13), 0.18 + 0.125 * (SPOOL - 0.18));
    // An eighth of the distance from the means is forgotten.
    let swing = |value: f64, mean: f64| 0.875 * (value - mean);
    for (commanded_mean, spool_mean, sign) in
        [(0.12, 0.2, 1.0), (0.2, 0.12, 1.0), (0.12, 0.12, -1.0), (0.2, 0.2, -1.0)]
    {
        let mut state = before();
        (state.stroke.commanded_mean, state.stroke.measured_mean) = (commanded_mean, spool_mean);
        let size = f64::min(swing(commanded, commanded_mean).abs(), swing(spool, spool_mean).abs());
        let sum = summed(&round(), state).stroke.against;
        near("above", (sum.above - MIDDLE) / PERIOD, sign * size - 0.001);
        near("agreement does not count", 1.0 + sum.below, 1.0);
    }
}

#[test]
fn without_a_sensor_of_the_velocity_only_flow_and_stroke_are_compared() {
    let mut both = summed(&round(), before());
    for fast_velocity in [false, true] {
        let mut state = summed(&Plausibility { senses_velocity: false, fast_velocity, ..round() }, before());
        for n in [TRAVEL, RATIO] {
            assert_eq!(sums(&mut state)[n], sums(&mut before())[n], "{n}");
        }
        // An accelerometer shows the fast motions.
        let mut of_force = if fast_velocity { both } else { before() };
        for n in [FAST, TURNED] {
            assert_eq!(sums(&mut state)[n], sums(&mut of_force)[n], "{n}");
        }
        for n in [BALANCE, STROKE, AGAINST] {
            assert_eq!(sums(&mut state)[n], sums(&mut both)[n], "{n}");
        }
    }
}

#[test]
fn the_valve_models_opening_has_two_lags_and_stops_at_the_ends() {
    let watch = round();
    for (valve_command, commanded) in [(1.5, 0.18), (-100.0, -1.0), (100.0, 1.0)] {
        let mut state = before();
        watch.model_valve(&mut state, &Control { valve_command, valve_gain: 1.2, ..control() });
        let first = 0.11 + 0.2 * (commanded - 0.11);
        near("first", state.stroke.first, first);
        near("opening", state.spool(), 0.16 + 0.2 * (first - 0.16));
    }
}

#[test]
fn a_sum_is_two_sided_and_ends_at_twice_its_limit() {
    let mut sum = Cusum { above: 0.5, below: 0.7 };
    sum.add(0.3, 0.1, 1.0);
    near("above", sum.above, 0.7);
    near("below", sum.below, 0.3);
    assert_eq!([0.34, 0.36].map(|share| sum.is_beyond(2.0, share)), [true, false]);
    sum.add(-0.5, 0.1, 1.0);
    near("above", sum.above, 0.1);
    near("below", sum.below, 0.7);
    assert_eq!([0.34, 0.36].map(|share| sum.is_beyond(2.0, share)), [true, false]);
    sum.add(9.0, 0.1, 1.0);
    near("most", sum.above, 2.0);
    assert_eq!(sum.below.to_bits(), 0);
    sum.add(-9.0, 0.1, 1.0);
    near("most", sum.below, 2.0);
    assert_eq!(sum.above.to_bits(), 0);
}

#[test]
fn filters_of_the_residuals_are_of_first_order() {
    let mut state = 2.0;
    near("low-pass", low_pass(&mut state, 0.25, 4.0), 2.5);
    near("its state", state, 2.5);
    let mut highs = [2.0, 0.5];
    near("high-passes", high_pass(&mut highs, 0.25, 4.0), 0.75 * (1.5 - 0.5));
    near("first", highs[0], 2.5);
    near("second", highs[1], 0.75);
    let mut held = 2.0;
    near("decay", envelope(&mut held, 0.75, 1.0), 1.5);
    near("rise", envelope(&mut held, 0.75, -4.0), 4.0);
}
