//! The null bias and the motion that a watch infers from the flow balance.

use super::equations::{FORCE, PERIOD, SPOOL, before, flows, input, known, near, round, summed};
use super::*;

#[test]
fn the_null_bias_is_the_mean_opening_of_the_residual() {
    let [passed, taken, oil] = flows();
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let root = libm::sqrt(0.9 - FORCE / (RIG.piston_area * RIG.supply_pressure));
    let open = ((taken + oil - passed) / (1.2 * root * slope)).clamp(-0.05, 0.05);
    // The mean is over 4 s, and 0.1 s without a bias before the first one.
    for (age, time) in [(0.0, 0.1 + PERIOD), (1.0, 1.1 + PERIOD), (4.0, 4.1)] {
        let oil = if age > 0.0 { open } else { ((taken - passed) / (1.2 * root * slope)).clamp(-0.05, 0.05) };
        let state = summed(&round(), PlausibilityState { age, ..before() });
        near("null", state.null, 0.01 + (oil - 0.01) * PERIOD / time);
        near("age", state.age, f64::min(age + PERIOD, 4.0));
    }
}

#[test]
fn without_the_force_the_null_bias_is_learned_from_piston_and_spool() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, known) = (round(), known());
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let gain = 1.2 * libm::sqrt(0.9);
    for (velocity, limited) in [(0.5 * gain * table.flow(SPOOL) + 0.01 * gain * slope, false), (0.3, true)] {
        for (distrusted, learns) in
            [([true, false, false, false], true), ([true, false, false, true], false), ([false; 4], false)]
        {
            let mut state = PlausibilityState { velocity, distrusted, ..before() };
            watch.learn_null_without_force(&mut state, &input(), &known);
            let open = (2.0 * velocity - gain * table.flow(SPOOL)) / (gain * slope);
            let expected = if limited { 0.05 } else { open };
            let expected = if learns { 0.01 + (expected - 0.01) * PERIOD / (1.1 + PERIOD) } else { 0.01 };
            near("null", state.null, expected);
        }
    }
    let mut state = PlausibilityState { distrusted: [true, false, false, false], ..before() };
    watch.learn_null_without_force(&mut state, &Input { spool: f64::NAN, ..input() }, &known);
    near("a lost spool", state.null, 0.01);
}

#[test]
fn an_excess_of_the_opening_moves_the_piston_by_the_slope_of_the_flow() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    // The area is 2 m².
    let found = round().velocity_of(0.006, SPOOL);
    assert!((found - 0.5 * slope * 0.006).abs() < 1e-12, "{found}");
}

#[test]
fn a_small_excess_at_null_counts_when_the_valve_has_closed() {
    // Nothing of 0.003 and all of 0.006 counts while the loop swings.
    for (added, left, swinging) in [
        (0.0, 0.01, 0.01),
        (-0.004, 0.006, 0.006),
        (-0.006, 0.004, 0.004 / 3.0),
        (-0.008, 0.002, 0.0),
        (-0.0145, -0.0045, -0.0045 / 2.0),
    ] {
        for (distrusts, learns) in
            [([true, false, false, false], true), ([false; 4], true), ([true, true, false, false], false)]
        {
            let state = PlausibilityState { distrusted: distrusts, ..before() };
            let near = |authority: f64, expected: f64| {
                let found = state.null_excess(added, authority);
                assert!((found - expected).abs() < 1e-15, "{added} {authority}: {found}");
            };
            near(1.0, swinging);
            near(0.0, if learns { left } else { swinging });
            near(0.25, if learns { 0.75 * left + 0.25 * swinging } else { swinging });
        }
    }
}

#[test]
fn the_velocity_by_the_flow_balance_contains_null_bias_leakage_and_oil() {
    let (watch, known) = (round(), known());
    for (has_force, before_force) in [(false, FORCE), (true, 3.0)] {
        // Also before the first balanced sample, as after a new beginning with a distrusted sensor.
        let mut state = PlausibilityState {
            age: 0.0,
            null: 0.02,
            has_force,
            last_force: 3.0,
            by_flow: [0.03, 0.01],
            ..before()
        };
        let flow = watch.valve_flow(&input(), &known);
        watch.move_by_flow(&mut state, FORCE, &flow, &known);
        let passed = 1.2 * (flow.root * (flow.at_no_load + 0.02 * flow.slope));
        let oil = watch.oil * watch.rate * (FORCE - before_force);
        let velocity = (passed - watch.leakage * FORCE - oil) / 2.0;
        near("velocity", state.velocity_by_flow(), 0.02 + watch.moved * (velocity - 0.02));
        near("force", state.last_force, FORCE);
    }
}

#[test]
fn a_piston_rests_below_the_velocity_of_a_reversal() {
    let mut state = before();
    for (fastest, rests) in [(1.4, true), (1.5, false)] {
        state.envelopes[4] = fastest;
        assert_eq!(round().rests(&state), rests, "{fastest}");
    }
}
