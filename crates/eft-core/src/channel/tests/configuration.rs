//! A state that goes on under another configuration.

use super::*;
use crate::compensation::Calibration;

#[test]
fn a_state_continues_under_another_configuration() {
    let first = Channel::<f64, 21>::new(&RIG).unwrap();
    let second = Parameters { response_delay: 3.0e-3, valve_gain: 0.12, ..RIG };
    let second = Channel::<f64, 21>::new(&second).unwrap();
    let (mut state, mut expected) = (first.at_rest(), second.at_rest());
    state.trip();
    expected.trip();
    for tick in 0..1000 {
        first.step(&mut state, &swing(tick));
        second.step(&mut expected, &swing(tick));
    }
    second.take_over(&mut state);
    assert_eq!(state.calibration(), expected.calibration());
    // The lead network forgets its state within a few hundred ticks; the trip stays.
    for tick in 1000..2000 {
        let (out, like) = (second.step(&mut state, &swing(tick)), second.step(&mut expected, &swing(tick)));
        assert!((out.voltage - like.voltage).abs() < 0.1 * 0.9_f64.powi((tick - 1000) as i32) + 1e-12);
        assert_ne!(out.status & status::TRIPPED, 0);
    }
}

#[test]
fn what_was_learned_stays_under_another_configuration() {
    let learning = Parameters { learning: Learning::ADAPTIVE, ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    let mut state = channel.at_rest();
    let found = Calibration { flow_gain: 1.1, window: 0, ..*state.calibration() };
    for tick in 0..=2 * channel.window_ticks() {
        let out = channel.step(&mut state, &swing(tick));
        if out.window.is_some_and(|window| window.number == 0) {
            channel.publish(&mut state, found);
        }
    }
    let before = state;
    Channel::<f64, 21>::new(&Parameters { level: 0.9, ..learning }).unwrap().take_over(&mut state);
    assert_eq!((state, state.calibration()), (before, &found));
}

#[test]
fn a_state_that_learned_nothing_begins_its_first_window_under_a_learning_configuration() {
    let fixed = Channel::<f64, 21>::new(&RIG).unwrap();
    let learning = Channel::<f64, 21>::new(&Parameters { learning: Learning::ADAPTIVE, ..RIG }).unwrap();
    let mut state = fixed.at_rest();
    for tick in 0..100 {
        assert!(fixed.step(&mut state, &swing(tick)).window.is_none());
    }
    fixed.prime(&mut state, &swing(100));
    learning.take_over(&mut state);
    let last = learning.window_ticks() - 1;
    for tick in 0..=last {
        let window = learning.step(&mut state, &swing(100 + tick)).window;
        // There is no valid sample before it.
        assert_eq!(window.map(|w| (w.number, w.lost)), (tick == last).then_some((0, 1)), "tick {tick}");
    }
}
