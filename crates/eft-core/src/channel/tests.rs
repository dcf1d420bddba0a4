#![allow(clippy::float_cmp, reason = "bits are compared on purpose")]

mod belief;

use super::*;
use crate::cause::Cause;
use crate::compensation::Calibration;
use crate::learning::Learner;
use crate::parameters::{Learning, Levels, PlausibilityParameters, ProtectionParameters};
use crate::table::FlowTable;

const RIG: Parameters =
    Parameters { protection: Some(ProtectionParameters::DEFAULT), ..Parameters::ZHAO2005 };

fn swing(tick: u32) -> Input<f64> {
    let x = libm::sin(0.01 * f64::from(tick));
    Input { command: 3e3 * x, velocity: 0.2 * x, force: 2.9e3 * x, spool: 0.15 * x, ..Input::default() }
}

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

#[test]
fn lost_samples_are_waited_for_after_the_windows_have_wrapped() {
    // No calibration is published.
    let learning = Learning { age_limit: f64::MAX, ..Learning::ADAPTIVE };
    let learning = Parameters { learning, ..RIG };
    let channel = Channel::<f64, 21>::new(&learning).unwrap();
    let waited = |first: u32| {
        let mut state = channel.at_rest();
        state.window.number = first;
        let good = |tick| Input { displacement: 0.0, ..swing(tick) };
        let lost = Input { force: f64::NAN, ..good(0) };
        for tick in 0..500 {
            let out = channel.step(&mut state, &good(tick));
            assert_eq!(out.status & status::TRIPPED, 0, "tick {tick}");
            // Gaps too short for the protection.
            for _ in 0..ProtectionParameters::DEFAULT.lost_samples {
                let out = channel.step(&mut state, &lost);
                assert_eq!(out.status & status::TRIPPED, 0, "tick {tick}: {:?}", state.cause());
            }
        }
        (0..100).find(|_| channel.step(&mut state, &lost).status & status::TRIPPED != 0)
    };
    assert_eq!(waited(u32::MAX - 50), waited(0));
    // The last gap counts as well.
    assert_eq!(waited(0), Some(0));
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
    let watched = ProtectionParameters {
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let learning = Parameters { learning: Learning::ADAPTIVE, protection: Some(watched), ..RIG };
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

#[test]
fn after_a_force_level_the_velocity_is_doubted_and_after_another_level_not() {
    let watched = ProtectionParameters {
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let channel = Channel::<f64, 21>::new(&Parameters { protection: Some(watched), ..RIG }).unwrap();
    for (cause, doubted) in
        [(Cause::ForceLevel, true), (Cause::DisplacementLevel, false), (Cause::Request, false)]
    {
        let mut state = channel.at_rest();
        state.protection.trip_by(cause);
        assert_eq!(channel.doubts_velocity(&state), doubted, "{cause:?}");
    }
    // A displacement was blamed. If the loop opens then, the velocity was wrong, unless the force is blamed as well.
    let mut state = channel.at_rest();
    for (blamed, doubted) in [(Cause::DisplacementImplausible, true), (Cause::ForceLost, false)] {
        state.protection.trip_by(blamed);
        state.plausibility.distrust(blamed);
        assert_eq!(channel.doubts_velocity(&state), doubted, "{blamed:?}");
    }
}

/// The outputs of a channel with a protection, until it trips or for a number of ticks.
fn until_tripped(
    state: &mut ChannelState<f64>,
    channel: &Channel<f64, 21>,
    of: impl Fn(u32) -> Input<f64>,
) -> u32 {
    let tripped = |tick: &u32| channel.step(state, &of(*tick)).status & status::TRIPPED != 0;
    (0..20_000).find(tripped).unwrap_or(u32::MAX)
}

// SR-15
#[test]
fn repeated_samples_shut_down_and_samples_at_a_wrong_period_ramp() {
    let channel = Channel::<f64, 21>::new(&RIG).unwrap();
    let good = |tick: u32| Input {
        displacement: 0.0,
        alive: f64::from(tick % 256),
        period: 1.0 / 4096.0,
        ..swing(tick)
    };
    let stands = |tick: u32| if tick < 1000 { good(tick) } else { good(999) };
    let skips = |tick: u32| {
        if tick < 1000 { good(tick) } else { Input { alive: f64::from(tick % 99 * 2), ..good(tick) } }
    };
    let slow =
        |tick: u32| if tick < 1000 { good(tick) } else { Input { period: 1.0 / 4000.0 * 1.3, ..good(tick) } };
    let waits = ProtectionParameters::DEFAULT.lost_samples;
    let faults: [(&dyn Fn(u32) -> Input<f64>, _, _); 4] = [
        (&good, Cause::None, false),
        (&stands, Cause::SamplesOld, true),
        (&skips, Cause::SamplesOld, false),
        (&slow, Cause::SamplePeriod, false),
    ];
    for (input, cause, shuts_down) in faults {
        let mut state = channel.at_rest();
        let tick = until_tripped(&mut state, &channel, input);
        assert_eq!(tick, if cause == Cause::None { u32::MAX } else { 1000 + waits }, "{cause:?}");
        let out = channel.step(&mut state, &input(tick.min(19_999) + 1));
        assert_eq!((state.cause(), status::cause(out.status)), (cause, cause));
        assert_eq!(out.status & status::SHUT_DOWN != 0, shuts_down, "{cause:?}");
        assert_eq!(out.status & status::MISSED_TICK != 0, cause != Cause::None, "{cause:?}");
    }
}

fn still(_: u32) -> Input<f64> {
    Input { displacement: 0.0, ..swing(0) }
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
fn an_invalid_supply_pressure_is_replaced_by_the_last_valid_one() {
    let measured = Parameters { supply_correction: true, protection: None, ..RIG };
    let channel = Channel::<f64, 21>::new(&measured).unwrap();
    let nominal = measured.supply_pressure;
    // A ratio below one returns to one, slowly.
    let held = |ratio: f64| nominal * (1.0 - (1.0 - ratio) * (1.0 - 1.0 / 2048.0));
    for wrong in [f64::NAN, f64::INFINITY, -nominal, 0.0, 0.04 * nominal, 4.1 * nominal] {
        let (mut state, mut sound) = (channel.at_rest(), channel.at_rest());
        // Before any valid one it is the configured pressure.
        let pressures = [nominal, 1.3 * nominal, 1.3 * nominal, 0.8 * nominal, held(0.8), 0.9 * nominal];
        for (tick, pressure) in (0..).zip(pressures) {
            let good = Input { supply_pressure: pressure, ..swing(tick) };
            let lost = tick % 2 == 0;
            let given = if lost { Input { supply_pressure: wrong, ..good } } else { good };
            let (out, like) = (channel.step(&mut state, &given), channel.step(&mut sound, &good));
            assert!((out.voltage - like.voltage).abs() < 1e-12, "{wrong}, tick {tick}: {out:?} {like:?}");
            assert_eq!(out.status, like.status | if lost { status::STUCK_MEASUREMENT } else { 0 });
        }
        // And a prime goes on from it.
        let lost = Input { supply_pressure: wrong, ..swing(6) };
        channel.prime(&mut state, &lost);
        channel.prime(&mut sound, &Input { supply_pressure: held(0.9), ..lost });
        let (out, like) = (channel.step(&mut state, &lost), channel.step(&mut sound, &lost));
        assert!((out.voltage - like.voltage).abs() < 1e-12, "{wrong}: {out:?} {like:?}");
    }
}

#[test]
fn a_held_output_has_the_authority_of_the_last_tick() {
    for realization in [Realization::Digital, Realization::Analog] {
        let channel = Channel::<f64, 21>::new(&Parameters { realization, ..RIG }).unwrap();
        let mut state = channel.at_rest();
        for tick in 0..200 {
            channel.step(&mut state, &Input { displacement: 0.0, ..swing(tick) });
        }
        state.protection.shut_down_by(Cause::Request);
        // A quarter of a shutdown of a tenth of a second.
        let last = (0..102)
            .map(|_| channel.step(&mut state, &Input { displacement: 0.0, ..swing(200) }))
            .last()
            .unwrap();
        let held = channel.hold(&state);
        assert!((held.authority - 0.75).abs() < 3e-3 && held.authority == last.authority, "{held:?}");
        assert!(last.voltage.abs() > 1e-3 && held.voltage == last.voltage, "{held:?}, {last:?}");
        assert_eq!((held.compensation, held.status), (last.compensation, status::HELD));
    }
}

#[test]
fn a_distrusted_force_or_displacement_counts_as_zero() {
    let protection = ProtectionParameters {
        force: Levels { warning: 0.5, trip: 20e3 },
        displacement: Levels { warning: 0.05, trip: 0.115 },
        plausibility: Some(PlausibilityParameters::DEFAULT),
        ..ProtectionParameters::DEFAULT
    };
    let channel = Channel::<f64, 21>::new(&Parameters { protection: Some(protection), ..RIG }).unwrap();
    let away = Input { force: 50.0, displacement: 0.06, velocity: 0.0, spool: 0.0, ..Input::default() };
    for (force, displacement) in [(0.0, 0.06), (50.0, 0.0)] {
        let mut state = channel.at_rest();
        let input = Input { force, displacement, ..away };
        let warns = |state: &mut _| channel.step(state, &input).status & status::PROTECTION_WARNING != 0;
        assert!(warns(&mut state), "{force} {displacement}");
        let sensor = if force > 0.0 { Cause::ForceImplausible } else { Cause::DisplacementImplausible };
        state.plausibility.distrust(sensor);
        assert!(!warns(&mut state), "{force} {displacement}");
    }
}

#[test]
fn a_gap_is_longer_than_its_time() {
    let ticks = |gap_time| Channel::<f64, 21>::new(&Parameters { gap_time, ..RIG }).unwrap().gap_ticks;
    assert_eq!([0.0, 0.25, 0.01, f64::MAX].map(ticks), [1, 1025, 41, u32::MAX]);
}

#[test]
fn a_velocity_estimate_continues_from_the_mean_velocity_of_a_gap_and_not_of_a_shorter_one() {
    let velocity_source = VelocitySource::Derivative { corner: 80.0 };
    let channel = Channel::<f64, 21>::new(&Parameters { velocity_source, protection: None, ..RIG }).unwrap();
    let at = |displacement| Input { displacement, ..swing(0) };
    // 10 ms are more than 40 ticks. After fewer the two low-passes see a step.
    let step = 0.1156239 * 0.1156239 * 0.01 * 4096.0;
    for (lost, expected) in [(41, 0.01 / 42.0 * 4096.0), (40, step), (60, 0.01 / 61.0 * 4096.0)] {
        let mut state = channel.at_rest();
        channel.step(&mut state, &at(0.0));
        for _ in 0..lost {
            assert!(channel.step(&mut state, &at(f64::NAN)).velocity.is_nan());
        }
        let velocity = channel.step(&mut state, &at(0.01)).velocity;
        assert!((velocity - expected).abs() < 1e-5 * expected, "{lost}: {velocity}, not {expected}");
    }
}

#[test]
fn without_a_protection_every_command_is_permitted_and_the_whole_output_passes() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: None, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    for tick in 1..100 {
        let input = swing(tick);
        let out = channel.step(&mut state, &input);
        let held = channel.hold(&state);
        assert_eq!((out.permitted_command, out.authority), (input.command, 1.0));
        assert_eq!((held.voltage, held.authority), (out.voltage, 1.0));
    }
}

/// A protection with a plausibility watch.
const WATCHED: Option<ProtectionParameters> = Some(ProtectionParameters {
    plausibility: Some(PlausibilityParameters::DEFAULT),
    ..ProtectionParameters::DEFAULT
});

#[test]
fn after_a_trip_a_share_of_the_velocity_is_compensated_and_with_an_open_loop_that_of_a_trusted_sensor() {
    // A linear valve without delay: the compensation is A·ẋ/(K_v·G_p·K_s) at once.
    let rig = Parameters { mode: crate::Mode::Linear, response_delay: 0.0, protection: WATCHED, ..RIG };
    let channel = Channel::<f64, 21>::new(&rig).unwrap();
    // The opening passes the piston's flow, so that there is no null bias.
    let spool = FlowTable::<f64, 21>::new(rig.openings, rig.flows).unwrap().opening(rig.piston_area * 0.1);
    let moves =
        Input { command: 0.0, velocity: 0.1, force: 0.0, spool, displacement: 0.0, ..Input::default() };
    // The brake removes a fifth times its share, which is a 2048th in the first tick of a ramp of half a second.
    let closed = 0.95 - 0.95 * 0.2 / 2048.0;
    for (cause, opens, share) in [
        (Cause::Request, false, closed),
        (Cause::ForceLevel, false, closed),
        (Cause::ForceLost, true, 0.93),
        // The velocity may be wrong, so the displacement is followed. It is at rest.
        (Cause::ForceLevel, true, 0.0),
    ] {
        let mut state = channel.at_rest();
        for _ in 0..4 {
            channel.step(&mut state, &moves);
        }
        if opens {
            state.protection.shut_down_by(cause)
        } else {
            state.protection.trip_by(cause)
        }
        let found = channel.step(&mut state, &moves).compensation;
        let whole = rig.piston_area * 0.1 / (rig.flow_gain * rig.proportional_gain * rig.valve_gain);
        assert!((found - share * whole).abs() < 1e-6 * whole, "{cause:?}: {found}, not {}", share * whole);
    }
}

#[test]
fn a_primed_channel_takes_a_new_operating_point_for_no_fault() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let table = FlowTable::<f64, 21>::new(RIG.openings, RIG.flows).unwrap();
    // A piston that swings under a dead load, in balance with the valve's flow.
    let swing = |time: f64, load: f64| {
        let rate = core::f64::consts::TAU * 2.0;
        let velocity = 0.2 * libm::sin(rate * time);
        let root = libm::sqrt(1.0 - velocity.signum() * load / (RIG.piston_area * RIG.supply_pressure));
        let leaked = RIG.leakage / RIG.piston_area * load;
        Input {
            command: load,
            force: load,
            velocity,
            displacement: -0.2 / rate * libm::cos(rate * time),
            spool: table.opening((RIG.piston_area * velocity + leaked) / root),
            ..still(0)
        }
    };
    for distrusts in [false, true] {
        let mut state = channel.at_rest();
        for (start, load) in [(0.0, 0.0), (0.13, 12e3), (0.4, -20e3)] {
            let at = |tick: i32| swing(start + f64::from(tick) / RIG.sample_rate, load);
            channel.prime(&mut state, &at(0));
            let last = (0..4096).map(|tick| channel.step(&mut state, &at(tick))).last().unwrap();
            assert_eq!(state.cause(), Cause::None, "{start}");
            assert_eq!(last.status & status::SPOOL_DISTRUSTED != 0, distrusts && start > 0.0);
            if distrusts {
                state.plausibility.distrust(Cause::SpoolLost);
            }
        }
    }
}

#[test]
fn an_open_loop_does_not_follow_a_piston_that_rests() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    for (velocity, follows) in [(0.005, false), (0.05, true)] {
        let mut state = channel.at_rest();
        let mut compensation = f64::NAN;
        for tick in 0..200 {
            let (displacement, spool) = (velocity * f64::from(tick) / RIG.sample_rate, 0.0);
            let moves = Input { command: 0.0, force: 0.0, velocity, displacement, spool, ..still(0) };
            if tick == 60 {
                state.protection.shut_down_by(Cause::ForceLost);
            }
            compensation = channel.step(&mut state, &moves).compensation;
        }
        assert_eq!(compensation > 0.0, follows, "{velocity}: {compensation}");
    }
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

// SR-10
#[test]
fn an_opened_loop_compensates_for_the_null_bias_and_not_for_a_fault() {
    for integral_gain in [0.0, 4.0] {
        let channel =
            Channel::<f64, 21>::new(&Parameters { integral_gain, protection: WATCHED, ..RIG }).unwrap();
        let mut state = channel.at_rest();
        let mut voltage = |force: f64, spool: f64, ticks: u32, opens: bool| {
            let input = Input { command: 0.0, velocity: 0.0, displacement: 0.0, force, spool, ..still(0) };
            let mut last = f64::NAN;
            for _ in 0..ticks {
                if opens {
                    state.protection.shut_down_by(Cause::ForceLost);
                }
                let out = channel.step(&mut state, &input);
                assert_eq!(out.status & status::TRIPPED != 0, opens, "{integral_gain}");
                last = out.voltage;
            }
            last
        };
        // The piston stands although the spool is open.
        voltage(0.0, 0.01, 5 * 4096, false);
        // A load cell that lies for 0.1 s winds an integral up.
        voltage(800.0, 0.01, 410, false);
        voltage(800.0, 0.01, 200, true);
        // It keeps standing with the opening at which it stood, for which the valve needs 0.1 V.
        let opened = voltage(800.0, 0.01, 200, true);
        assert!((opened - 0.01 / RIG.valve_gain).abs() < 0.003, "{integral_gain}: {opened}");
    }
}

#[test]
fn the_null_bias_of_a_swing_is_its_mean() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    let mut opened = f64::NAN;
    for tick in 0..40_000 {
        // A blocked piston and a spool that swings by a hundredth at 1.3 Hz: a flow gain that is wrong.
        let spool = 0.01 * libm::cos(0.002 * f64::from(tick));
        let input = Input { command: 0.0, velocity: 0.0, displacement: 0.0, force: 0.0, spool, ..still(0) };
        if tick >= 39_500 {
            state.protection.shut_down_by(Cause::ForceLost);
        }
        opened = channel.step(&mut state, &input).voltage;
    }
    assert!(opened.abs() < 0.05 * 0.01 / RIG.valve_gain, "{opened}");
}

#[test]
fn an_opened_loop_has_no_derivative_kick() {
    let channel = Channel::<f64, 21>::new(&Parameters { protection: WATCHED, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    let away =
        Input { command: 0.0, velocity: 0.0, force: 2000.0, spool: 0.0, displacement: 0.0, ..still(0) };
    for _ in 0..100 {
        channel.step(&mut state, &away);
    }
    state.protection.shut_down_by(Cause::ForceLevel);
    // The derivative gain times the change of the error would be 0.09 V.
    let opened = channel.step(&mut state, &away).voltage;
    assert!(opened.abs() < 1e-9, "{opened}");
}
