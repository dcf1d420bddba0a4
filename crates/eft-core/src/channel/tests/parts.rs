//! The optional parts of a tick: none of them, the friction, and the integral.

use super::*;

#[test]
fn a_plain_channel_has_the_bits_of_one_that_is_asked_for_parts() {
    let plain = Parameters { protection: None, ..RIG };
    let limited = Parameters { valve_command: 1.0, valve_command_rate: 1e3, force_range: 2.9e3, ..plain };
    let learning = Parameters { feedforward: true, learning: Learning::ADAPTIVE, ..limited };
    for parameters in [plain, limited, learning] {
        let channel = Channel::<f64, 21>::new(&parameters).unwrap();
        assert!(channel.plain);
        let asked = Channel { plain: false, ..channel };
        let (mut state, mut expected) = (channel.at_rest(), asked.at_rest());
        for tick in 0..3000 {
            let mut input = swing(tick);
            if tick % 97 == 0 {
                input.spool = f64::NAN;
            }
            let (out, like) = (channel.step(&mut state, &input), asked.step(&mut expected, &input));
            assert_eq!((out, state), (like, expected), "tick {tick}");
        }
    }
    let look_ahead = Parameters { feedforward: true, look_ahead: true, ..plain };
    let gains = [0.07, 10.0, 736.0];
    for parameters in [
        RIG,
        look_ahead,
        Parameters { stuck_samples: 5, ..plain },
        Parameters { integral_gain: 4.0, ..plain },
        Parameters { friction: 800.0, ..plain },
        Parameters { supply_correction: true, ..plain },
        Parameters { realization: Realization::Analog, ..plain },
        Parameters { velocity_source: VelocitySource::Accelerometer { gains }, ..plain },
    ] {
        assert!(!Channel::<f64, 21>::new(&parameters).unwrap().plain, "{parameters:?}");
    }
}

/// With a friction of 800 N beyond the smooth region.
const RUBBING: Parameters = Parameters { friction: 800.0, feedforward: true, protection: None, ..RIG };

#[test]
fn windows_hold_the_force_that_the_oil_carries() {
    let parameters = Parameters { learning: Learning::ADAPTIVE, ..RUBBING };
    let channel = Channel::<f64, 21>::new(&parameters).unwrap();
    let mut state = channel.at_rest();
    for tick in 0..16 {
        // Forth in the first half of the window, back in the second.
        let velocity = if tick < 8 { 0.1 } else { -0.1 };
        let input = Input { command: 2000.0, velocity, force: 1900.0, spool: 0.05, ..Input::default() };
        if let Some(window) = channel.step(&mut state, &input).window {
            assert_eq!((window.end.force, window.end.command), (1100.0, 1200.0));
            assert_eq!((window.sums.force, window.sums.command), (16.0 * 1900.0, 16.0 * 2000.0));
            return;
        }
    }
    panic!("no window");
}

#[test]
fn friction_is_an_equal_force_of_load_and_command_and_outlives_lost_samples() {
    let channel = Channel::<f64, 21>::new(&RUBBING).unwrap();
    let without = Channel::<f64, 21>::new(&Parameters { friction: 0.0, ..RUBBING }).unwrap();
    let [mut state, mut expected] = [channel.at_rest(); 2];
    let moving = |velocity: f64, carried: f64| Input {
        command: 2000.0 + carried,
        velocity,
        force: 1900.0 + carried,
        spool: 0.05,
        ..Input::default()
    };
    let mut same = |velocity: f64, tick: usize| {
        let friction = if velocity > 0.0 { 800.0 } else { -800.0 };
        let out = channel.step(&mut state, &moving(velocity, 0.0)).voltage;
        let like = without.step(&mut expected, &moving(velocity, friction)).voltage;
        assert!((out - like).abs() < 1e-9, "tick {tick}: {out} {like}");
        if tick == 20 {
            // The last friction stays while the velocity is lost.
            let lost = Input { velocity: f64::NAN, ..moving(velocity, 0.0) };
            assert_eq!(channel.step(&mut state, &lost).voltage, out);
            let lost = Input { velocity: f64::NAN, ..moving(velocity, friction) };
            without.step(&mut expected, &lost);
        }
    };
    for tick in 0..40 {
        same(if tick % 20 < 10 { 0.1 } else { -0.1 }, tick);
    }
}

#[test]
fn prime_knows_the_friction() {
    let channel = Channel::<f64, 21>::new(&RUBBING).unwrap();
    let input = Input { command: 2000.0, velocity: 0.1, force: 1900.0, spool: 0.05, ..Input::default() };
    let mut state = channel.at_rest();
    channel.prime(&mut state, &input);
    let first = channel.step(&mut state, &input).voltage;
    assert_eq!(channel.step(&mut state, &input).voltage, first);
}

#[test]
fn an_integral_outlives_lost_samples_and_prime_without_a_bump() {
    let integrating = Parameters { integral_gain: 4.0, feedforward: true, protection: None, ..RIG };
    let channel = Channel::<f32, 21>::new(&integrating).unwrap();
    let without = Channel::<f32, 21>::new(&Parameters { integral_gain: 0.0, ..integrating }).unwrap();
    let resting = Input {
        command: 3000.0,
        next_command: 3000.0,
        velocity: 0.0,
        force: 2000.0,
        spool: 0.0,
        ..Input::default()
    };
    let mut state = channel.at_rest();
    for _ in 0..400 {
        channel.step(&mut state, &resting);
    }
    let held = channel.step(&mut state, &Input { force: 3000.0, ..resting }).voltage;
    // Lost samples hold the output and do not change the integral.
    let kept = channel.step(&mut state.clone(), &Input { force: 3000.0, ..resting }).voltage;
    for _ in 0..100 {
        assert_eq!(channel.step(&mut state, &Input { force: f32::NAN, ..resting }).voltage, held);
    }
    let behind = channel.step(&mut state, &Input { force: 3000.0, ..resting }).voltage;
    assert!((behind - kept).abs() < 1e-3 * kept.abs(), "{behind} {kept}");
    // After priming, each output is that of a channel without an integral part, plus the integral.
    let balanced = Input { force: 3000.0, ..resting };
    channel.prime(&mut state, &balanced);
    let (held, next) = (channel.hold(&state).voltage, channel.step(&mut state.clone(), &balanced).voltage);
    assert!((held - next).abs() < 1e-6, "{held} {next}");
    let mut plain = without.at_rest();
    without.prime(&mut plain, &balanced);
    let difference = |state: &mut ChannelState<f32>, plain: &mut ChannelState<f32>| {
        channel.step(state, &balanced).voltage - without.step(plain, &balanced).voltage
    };
    let first = difference(&mut state, &mut plain);
    // 4·C_F·1000 N over 401 ticks.
    assert!((first / (4.0 * 5.6e-5 * 1000.0 * 401.0 / 4096.0) - 1.0).abs() < 0.01, "{first}");
    for _ in 0..9 {
        assert_eq!(difference(&mut state, &mut plain), first);
    }
}
