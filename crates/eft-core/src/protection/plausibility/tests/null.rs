//! The null bias and the motion that a watch infers from the flow balance.

use super::equations::{FORCE, PERIOD, SPOOL, before, flows, input, known, near, round, summed};
use super::*;
use crate::protection::plausibility::comparisons::ByFlow;
use crate::protection::plausibility::null::MissingOpening;

/// The missing opening of `before()` after a sample with this opening, at the spool's opening.
fn after(opening: f64) -> MissingOpening<f64> {
    let mut missing = before().missing;
    missing.add(opening, SPOOL, PERIOD);
    missing
}

#[test]
fn the_residual_over_the_slope_is_the_missing_opening() {
    let [passed, taken, oil] = flows();
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let root = libm::sqrt(0.9 - FORCE / (RIG.piston_area * RIG.supply_pressure));
    for age in [0.0, 1.0] {
        let oil = if age > 0.0 { oil } else { 0.0 };
        let opening = (taken + oil - passed) / (1.2 * root * slope);
        let mut state = before();
        state.balance.age = age;
        let state = summed(&round(), state);
        let expected = after(opening);
        near("null bias", state.null_bias(), expected.null_bias());
        near("at an opening", state.missing.at(0.3), expected.at(0.3));
    }
}

#[test]
fn a_new_beginning_keeps_what_is_known_of_the_null_bias() {
    let mut missing = MissingOpening::default();
    for _ in 0..20_000 {
        missing.add(0.02, SPOOL, PERIOD);
    }
    let begun = PlausibilityState { missing, ..before() }.begun_anew(0.0);
    let bias = summed(&round(), begun).null_bias();
    // A sample is within ±5 %, and the mean is over 4 s.
    assert!((bias - missing.null_bias()).abs() < 0.07 * PERIOD / 4.0, "{bias}");
}

#[test]
fn a_spool_away_from_its_command_shows_no_missing_opening() {
    for (led, valve_command, learns) in [(0.17, 1.0, true), (-0.2, 1.0, false), (-0.2, f64::NAN, true)] {
        let mut with_force = before();
        with_force.stroke.opening = led;
        let mut without = PlausibilityState { distrusted: [true, false, false, false], ..with_force };
        let (watch, known) = (round(), Known { valve_command, ..known() });
        watch.sum_up(&mut with_force, &input(), 0.3, &watch.valve_flow(&input(), &known), &known);
        watch.learn_null_without_force(&mut without, &input(), &known);
        for state in [with_force, without] {
            assert_eq!(state.missing != before().missing, learns, "{led} {valve_command}");
        }
    }
}

#[test]
fn without_the_force_the_missing_opening_is_learned_from_piston_and_spool() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, known) = (round(), known());
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let gain = 1.2 * libm::sqrt(0.9);
    for velocity in [0.5 * gain * table.flow(SPOOL) + 0.01 * gain * slope, 0.3] {
        for (distrusted, learns) in
            [([true, false, false, false], true), ([true, false, false, true], false), ([false; 4], false)]
        {
            let mut state = PlausibilityState { velocity, distrusted, ..before() };
            watch.learn_null_without_force(&mut state, &input(), &known);
            let opening = (2.0 * velocity - gain * table.flow(SPOOL)) / (gain * slope);
            let expected = if learns { after(opening) } else { before().missing };
            near("null bias", state.null_bias(), expected.null_bias());
            near("at an opening", state.missing.at(0.3), expected.at(0.3));
        }
    }
    let mut state = PlausibilityState { distrusted: [true, false, false, false], ..before() };
    watch.learn_null_without_force(&mut state, &Input { spool: f64::NAN, ..input() }, &known);
    assert_eq!(state.missing, before().missing, "a lost spool");
}

#[test]
fn a_missing_and_an_added_opening_move_the_piston_by_the_slope_of_the_flow() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, state) = (Plausibility { null_bias: 0.3, ..round() }, before());
    for (opening, corrects) in [(0.22, false), (-0.22, false), (0.22, true)] {
        let slope = (table.flow(opening + 1e-3) - table.flow(opening)) / 1e-3;
        let missing = if corrects { state.null_bias() } else { state.missing.at(opening) };
        // The area is 2 m².
        let found = watch.velocity_of_missing(&state, 0.006, 0.3 + opening, corrects);
        assert!((found - 0.5 * slope * (0.006 + missing)).abs() < 1e-12, "{opening}: {found}");
    }
}

#[test]
fn the_velocity_by_the_flow_balance_contains_null_bias_leakage_and_oil() {
    let (watch, known) = (round(), known());
    for (has_force, before_force) in [(false, FORCE), (true, 3.0)] {
        // Also before the first balanced sample, as after a new beginning with a distrusted sensor.
        let mut state = PlausibilityState {
            by_flow: ByFlow { valve: 0.03, oil: 0.01, force: 3.0, has_force },
            ..before()
        };
        state.balance.age = 0.0;
        let flow = watch.valve_flow(&input(), &known);
        let missing = state.missing.at(SPOOL);
        watch.move_by_flow(&mut state, [FORCE, SPOOL], &flow, &known);
        let passed = 1.2 * (flow.root * (flow.at_no_load + missing * flow.slope));
        let oil = watch.oil * watch.rate * (FORCE - before_force);
        let velocity = (passed - watch.leakage * FORCE - oil) / 2.0;
        near("velocity", state.velocity_by_flow(), 0.02 + watch.following.moved * (velocity - 0.02));
        near("force", state.by_flow.force, FORCE);
    }
}

#[test]
fn a_piston_rests_below_the_velocity_of_a_reversal() {
    let mut state = before();
    for (fastest, rests) in [(1.4, true), (1.5, false)] {
        state.motion.fastest = fastest;
        assert_eq!(round().rests(&state), rests, "{fastest}");
    }
}
