//! The null bias and the motion that a watch infers from the flow balance.

use super::equations::{FORCE, PERIOD, SPOOL, before, control, flows, input, near, round, summed};
use super::*;
use crate::protection::plausibility::comparisons::FlowVelocity;
use crate::protection::plausibility::opening_offset::OpeningOffset;

/// The missing opening of `before()` after a sample with this opening, at the spool's opening.
fn after(opening: f64) -> OpeningOffset<f64> {
    let mut offset = before().opening_offset;
    offset.add(opening, SPOOL, PERIOD);
    offset
}

#[test]
fn the_residual_over_the_slope_is_the_missing_opening() {
    let [valve_flow, load_flow, oil] = flows();
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let root = libm::sqrt(0.9 - FORCE / (RIG.piston_area * RIG.supply_pressure));
    for age in [0.0, 1.0] {
        let oil = if age > 0.0 { oil } else { 0.0 };
        let opening = (load_flow + oil - valve_flow) / (1.2 * root * slope);
        let mut state = before();
        state.balance.age = age;
        let state = summed(&round(), state);
        let expected = after(opening);
        near("null bias", state.null_bias(), expected.null_bias());
        near("at an opening", state.opening_offset.at(0.3), expected.at(0.3));
    }
}

#[test]
fn a_new_beginning_keeps_what_is_known_of_the_null_bias() {
    let mut opening_offset = OpeningOffset::default();
    for _ in 0..20_000 {
        opening_offset.add(0.02, SPOOL, PERIOD);
    }
    let begun = PlausibilityState { opening_offset, ..before() }.restarted(0.0);
    let bias = summed(&round(), begun).null_bias();
    // A sample is within ±5 %, and the mean is over 4 s.
    assert!((bias - opening_offset.null_bias()).abs() < 0.07 * PERIOD / 4.0, "{bias}");
}

#[test]
fn a_spool_away_from_its_command_shows_no_missing_opening() {
    for (modelled, valve_command, learns) in [(0.17, 1.0, true), (-0.2, 1.0, false), (-0.2, f64::NAN, true)] {
        let mut with_force = before();
        with_force.stroke.opening = modelled;
        let mut without = PlausibilityState { distrusted: [true, false, false, false], ..with_force };
        let (watch, control) = (round(), Control { valve_command, ..control() });
        watch.compare(&mut with_force, &input(), 0.3, &watch.valve_flow(&input(), &control), &control);
        watch.learn_null_without_force(&mut without, &input(), &control);
        for state in [with_force, without] {
            assert_eq!(state.opening_offset != before().opening_offset, learns, "{modelled} {valve_command}");
        }
    }
}

#[test]
fn without_the_force_the_missing_opening_is_learned_from_piston_and_spool() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, control) = (round(), control());
    let slope = (table.flow(0.201) - table.flow(SPOOL)) / 1e-3;
    let gain = 1.2 * libm::sqrt(0.9);
    for velocity in [0.5 * gain * table.flow(SPOOL) + 0.01 * gain * slope, 0.3] {
        for (distrusted, learns) in
            [([true, false, false, false], true), ([true, false, false, true], false), ([false; 4], false)]
        {
            let mut state = PlausibilityState { velocity, distrusted, ..before() };
            watch.learn_null_without_force(&mut state, &input(), &control);
            let opening = (2.0 * velocity - gain * table.flow(SPOOL)) / (gain * slope);
            let expected = if learns { after(opening) } else { before().opening_offset };
            near("null bias", state.null_bias(), expected.null_bias());
            near("at an opening", state.opening_offset.at(0.3), expected.at(0.3));
        }
    }
    let mut state = PlausibilityState { distrusted: [true, false, false, false], ..before() };
    watch.learn_null_without_force(&mut state, &Input { spool: f64::NAN, ..input() }, &control);
    assert_eq!(state.opening_offset, before().opening_offset, "a lost spool");
}

/// The flow curve begins at the known null. A valve that passes its flow from there on misses no opening.
#[test]
fn without_the_force_a_known_null_bias_is_no_missing_opening() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, control) = (Plausibility { null_bias: 0.05, ..round() }, control());
    // The area is 2 m².
    let velocity = 0.5 * 1.2 * libm::sqrt(0.9) * table.flow(SPOOL - 0.05);
    let mut state = PlausibilityState { velocity, distrusted: [true, false, false, false], ..before() };
    watch.learn_null_without_force(&mut state, &input(), &control);
    let mut expected = before().opening_offset;
    expected.add(0.0, SPOOL - 0.05, PERIOD);
    near("null bias", state.null_bias(), expected.null_bias());
    near("at an opening", state.opening_offset.at(0.3), expected.at(0.3));
}

#[test]
fn a_missing_and_an_added_opening_move_the_piston_by_the_slope_of_the_flow() {
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    let (watch, state) = (Plausibility { null_bias: 0.3, ..round() }, before());
    for (opening, corrects) in [(0.22, false), (-0.22, false), (0.22, true)] {
        let slope = (table.flow(opening + 1e-3) - table.flow(opening)) / 1e-3;
        let offset = if corrects { state.null_bias() } else { state.opening_offset.at(opening) };
        // The area is 2 m².
        let found = watch.offset_velocity(&state, 0.006, 0.3 + opening, corrects);
        assert!((found - 0.5 * slope * (0.006 + offset)).abs() < 1e-12, "{opening}: {found}");
    }
}

#[test]
fn the_velocity_by_the_flow_balance_contains_null_bias_leakage_and_oil() {
    let (watch, control) = (round(), control());
    for (has_force, before_force) in [(false, FORCE), (true, 3.0)] {
        // Also before the first balanced sample, as after a new beginning with a distrusted sensor.
        let mut state = PlausibilityState {
            flow_velocity: FlowVelocity { valve: 0.03, oil: 0.01, force: 3.0, has_force },
            ..before()
        };
        state.balance.age = 0.0;
        let flow = watch.valve_flow(&input(), &control);
        let offset = state.opening_offset.at(SPOOL);
        watch.update_flow_velocity(&mut state, [FORCE, SPOOL], &flow, &control);
        let valve_flow = 1.2 * (flow.root * (flow.at_no_load + offset * flow.slope));
        let oil = watch.oil * watch.rate * (FORCE - before_force);
        let velocity = (valve_flow - watch.leakage * FORCE - oil) / 2.0;
        near("velocity", state.velocity_by_flow(), 0.02 + watch.following.low_gain * (velocity - 0.02));
        near("force", state.flow_velocity.force, FORCE);
    }
}

#[test]
fn a_piston_rests_below_the_velocity_of_a_reversal() {
    let mut state = before();
    for (speed_envelope, rests) in [(1.4, true), (1.5, false)] {
        state.motion.speed_envelope = speed_envelope;
        assert_eq!(round().is_at_rest(&state), rests, "{speed_envelope}");
    }
}
