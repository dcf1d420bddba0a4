//! Windows, calibrations, and a learner that has stopped.

use super::*;
use crate::compensation::Calibration;
use crate::learning::Learner;
use crate::parameters::Levels;

#[test]
fn window_numbers_wrap() {
    // The curve is updated in odd windows, so it would differ with an odd first number.
    let learning = Learning { curve_correction: false, ..Learning::ADAPTIVE };
    let learning = Parameters { feedforward: true, learning, ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    let learner = Learner::<f64, 21>::new(&learning).unwrap();
    let run = |first: u32| {
        let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
        state.window.number = first;
        let mut sum = 0.0;
        for tick in 0..8000 {
            let x = libm::sin(0.0015 * f64::from(tick));
            let input =
                Input { command: 0.0, velocity: 0.2 * x, force: 0.0, spool: 0.1 * x, ..Input::default() };
            let out = channel.step(&mut state, &input);
            assert_eq!(out.status & status::CALIBRATION_LATE, 0);
            sum += out.voltage;
            if let Some(window) = out.window {
                channel.publish(&mut state, learner.update(&mut memory, &window));
            }
        }
        (sum, state.window.number.wrapping_sub(first), state.calibration().flow_gain)
    };
    assert_eq!(run(0), run(u32::MAX - 50));
    assert!((run(0).2 - 1.0).abs() > 1e-3, "nothing was learned");
}

/// The flow gain from the window of this number.
fn gain(window: u32) -> f64 {
    1.0 + 1e-4 * f64::from(window)
}

/// A tick with its learner; whether the protection has tripped.
fn taught(
    channel: &Channel<f64, 21>,
    nominal: &Calibration<f64>,
    state: &mut ChannelState<f64>,
    input: &Input<f64>,
) -> bool {
    let out = channel.step(state, input);
    if let Some(window) = out.window {
        let mut found = *nominal;
        (found.flow_gain, found.window) = (gain(window.number), window.number);
        channel.publish(state, found);
    }
    out.status & status::TRIPPED != 0
}

// SR-10
#[test]
fn a_calibration_from_a_wrong_sensor_is_reverted() {
    let learning = Parameters { learning: Learning::ADAPTIVE, protection: WATCHED, ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    let mut state = channel.at_rest();
    let rest =
        Input { command: 0.0, velocity: 0.0, force: 0.0, spool: 0.0, displacement: 0.0, ..Input::default() };
    let nominal = *state.calibration();
    for _ in 0..1000 * channel.window_ticks() {
        assert!(!taught(&channel, &nominal, &mut state, &rest));
    }
    let before = state.calibration().flow_gain;
    assert!((before - gain(998)).abs() < 3e-4, "{before}");
    let lost = Input { velocity: f64::NAN, ..rest };
    for _ in 0..2000 {
        taught(&channel, &nominal, &mut state, &lost);
    }
    // The older one of the last two, the 768th and the 896th. It is older than any unnoticed fault.
    assert_eq!((state.cause(), state.calibration().flow_gain), (Cause::VelocityLost, gain(768)));
}

// SR-10
#[test]
fn a_calibration_from_a_force_that_opens_the_loop_by_its_level_is_reverted() {
    let protection = ProtectionParameters {
        force: Levels { warning: 20e3, trip: 20e3 },
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let learning = Parameters { learning: Learning::ADAPTIVE, protection: Some(protection), ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    // A force far from its command may be wrong, and one near it is followed.
    for (command, reverts) in [(0.0, true), (20e3, false)] {
        let (mut state, nominal) = (channel.at_rest(), *channel.at_rest().calibration());
        for tick in 0..1000 * channel.window_ticks() {
            taught(&channel, &nominal, &mut state, &still(tick));
        }
        // It approaches its level without a jump.
        for force in (0..210).map(|step| 100.0 * f64::from(step)) {
            let input = Input { command: if reverts { 0.0 } else { force }, force, ..still(0) };
            taught(&channel, &nominal, &mut state, &input);
        }
        let older = if reverts { gain(768) } else { state.calibration().flow_gain };
        assert_eq!((state.cause(), state.calibration().flow_gain), (Cause::ForceLevel, older), "{command}");
        assert_eq!(reverts, older < gain(900));
    }
}

/// The first tick with an expired calibration, up to a number of ticks, with or without a running learner.
fn expires(
    channel: &Channel<f64, 21>,
    state: &mut ChannelState<f64>,
    ticks: u32,
    publishes: bool,
) -> Option<u32> {
    let mut first = None;
    for tick in 0..ticks {
        let out = channel.step(state, &still(tick));
        if let (Some(window), true) = (out.window, publishes) {
            let found = Calibration { flow_gain: 1.1, window: window.number, ..*state.calibration() };
            channel.publish(state, found);
        }
        if out.status & status::CALIBRATION_EXPIRED != 0 {
            assert_ne!(out.status & status::CALIBRATION_LATE, 0);
            first = first.or(Some(tick));
        }
    }
    first
}

// SR-16
#[test]
fn a_stopped_learner_is_noticed_and_its_estimates_stay() {
    let learning = Parameters { learning: Learning::ADAPTIVE, ..RIG };
    let guarded = Channel::<f64, 21>::new(&learning).unwrap();
    let mut state = guarded.at_rest();
    let tripped = until_tripped(&mut state, &guarded, still);
    // After a second, at the start of a window.
    assert!((4096..4096 + 64).contains(&tripped), "{tripped}");
    assert_eq!(state.cause(), Cause::CalibrationExpired);
    let alone = Channel::<f64, 21>::new(&Parameters { protection: None, ..learning }).unwrap();
    let mut state = alone.at_rest();
    assert_eq!(expires(&alone, &mut state, 8192, true), None);
    let stopped = expires(&alone, &mut state, 8192, false);
    assert!(stopped.is_some_and(|tick| (4000..4200).contains(&tick)), "{stopped:?}");
    assert!(state.calibration().flow_gain > 1.05);
    // The learner runs again.
    expires(&alone, &mut state, 64, true);
    assert_eq!(expires(&alone, &mut state, 8192, true), None);
}

#[test]
fn an_age_limit_that_a_calibration_in_time_would_reach_is_refused() {
    for age_limit in [0.0, 0.01, -1.0, f64::NAN] {
        let p = Parameters { learning: Learning { age_limit, ..Learning::ADAPTIVE }, ..RIG };
        assert!(Channel::<f64, 21>::new(&p).is_err(), "{age_limit}");
    }
    let never = Parameters { learning: Learning { age_limit: f64::MAX, ..Learning::ADAPTIVE }, ..RIG };
    let channel = Channel::<f64, 21>::new(&never).unwrap();
    let tripped =
        until_tripped(&mut channel.at_rest(), &channel, |_| Input { displacement: 0.0, ..swing(0) });
    assert_eq!(tripped, u32::MAX);
}

#[test]
fn after_a_trip_under_a_watch_every_tick_is_lost_for_the_learner() {
    let learning = Parameters { learning: Learning::ADAPTIVE, protection: WATCHED, ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    let mut state = channel.at_rest();
    let lost = |state: &mut _| (0..).find_map(|_| channel.step(state, &still(0)).window).unwrap().lost;
    assert_eq!(lost(&mut state), 1);
    state.trip();
    for _ in 0..3 {
        assert_eq!(lost(&mut state), channel.window_ticks());
    }
}
