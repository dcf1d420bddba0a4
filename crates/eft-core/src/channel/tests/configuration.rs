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

/// Also of a lost sample, which repeats the last valve command, and of one of an analog controller.
#[test]
fn a_repeated_valve_command_is_within_the_limit_of_the_new_configuration() {
    for realization in [Realization::Digital, Realization::Analog] {
        let first = Channel::<f64, 21>::new(&Parameters { realization, ..RIG }).unwrap();
        let limited = Parameters { realization: Realization::Digital, valve_command: 0.2, ..RIG };
        let limited = Channel::<f64, 21>::new(&limited).unwrap();
        let mut state = first.at_rest();
        let fast = Input { velocity: 1.0, spool: 0.5, ..swing(0) };
        let before = first.step(&mut state, &fast).voltage;
        assert!(before > 0.4, "{before}");
        limited.take_over(&mut state);
        let lost = limited.step(&mut state, &Input { force: f64::NAN, ..fast }).voltage;
        assert!((lost - 0.2).abs() < 1e-15, "{lost}");
        assert!((limited.hold(&state).voltage - 0.2).abs() < 1e-15);
    }
}

/// A specimen at rest has no velocity, also where an earlier estimate was at another displacement.
#[test]
fn an_estimate_of_the_velocity_from_another_source_starts_anew() {
    let gains = [0.07, 10.0, 300.0];
    let sources = [
        VelocitySource::Derivative { corner: 80.0 },
        VelocitySource::Observer { gains, mass: 7040.0 },
        VelocitySource::Accelerometer { gains },
        VelocitySource::Sensor,
    ];
    for learning in [Learning::OFF, Learning::ADAPTIVE] {
        let channel = |velocity_source| {
            Channel::<f64, 21>::new(&Parameters { velocity_source, learning, ..RIG }).unwrap()
        };
        for (first, second) in
            sources.iter().flat_map(|first| sources.iter().map(move |next| (*first, *next)))
        {
            let mut state = channel(first).at_rest();
            for (source, displacement) in [(first, 0.03), (second, 0.03), (first, 0.03)] {
                channel(source).take_over(&mut state);
                for _ in 0..20 {
                    let input =
                        Input { displacement, velocity: 0.0, force: 0.0, acceleration: 0.0, ..swing(0) };
                    let velocity = channel(source).step(&mut state, &input).velocity;
                    assert!(velocity.abs() < 1e-12, "{first:?}, {second:?}: {velocity} m/s");
                }
            }
            // While the sensor measures the velocity, the specimen moves on.
            channel(VelocitySource::Sensor).take_over(&mut state);
            channel(VelocitySource::Sensor).step(&mut state, &swing(0));
            channel(first).take_over(&mut state);
            let moved =
                Input { displacement: -0.02, velocity: 0.0, force: 0.0, acceleration: 0.0, ..swing(0) };
            let velocity = channel(first).step(&mut state, &moved).velocity;
            assert!(velocity.abs() < 1e-12, "{first:?}, {second:?}: {velocity} m/s");
        }
    }
}
