//! Lost, repeated and irregular samples.

use super::*;

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

#[test]
fn a_command_passes_to_an_analog_controller_as_given_unless_there_is_a_protection() {
    let rig = Parameters { realization: Realization::Analog, ..RIG };
    for (protection, [valid, lost]) in
        [(None, [30.0, f64::NAN]), (Some(ProtectionParameters::DEFAULT), [30.0; 2])]
    {
        let channel = Channel::<f64, 21>::new(&Parameters { protection, ..rig }).unwrap();
        let mut state = channel.at_rest();
        for (command, velocity, permitted) in [(30.0, 0.02, valid), (f64::NAN, f64::INFINITY, lost)] {
            let output = channel.step(&mut state, &Input { command, velocity, ..still(0) });
            assert_eq!(output.permitted_command.to_bits(), permitted.to_bits(), "{command}");
            assert_eq!(output.velocity, velocity);
            assert_eq!(output.status & status::INVALID_COMMAND != 0, command.is_nan());
        }
    }
}

// SR-15
#[test]
fn a_gap_of_lost_samples_trips_by_its_length_also_if_counter_and_period_are_measured() {
    let channel = Channel::<f64, 21>::new(&RIG).unwrap();
    let waits = ProtectionParameters::DEFAULT.lost_samples;
    for length in [1, waits, waits + 1] {
        let mut state = channel.at_rest();
        let tick = until_tripped(&mut state, &channel, |tick: u32| {
            let timed = |period| Input { displacement: 0.0, alive: f64::from(tick), period, ..swing(tick) };
            match tick {
                _ if (500..500 + length).contains(&tick) => Input::default(),
                _ if tick == 500 + length => timed(f64::from(length + 1) / 4096.0),
                _ => timed(1.0 / 4096.0),
            }
        });
        assert_eq!(tick, if length > waits { 500 + waits } else { u32::MAX }, "{length}");
    }
}

#[test]
fn an_invalid_supply_pressure_is_replaced_by_the_last_valid_one() {
    let measured = Parameters { supply_correction: true, protection: None, ..RIG };
    let channel = Channel::<f64, 21>::new(&measured).unwrap();
    let nominal = measured.supply_pressure;
    // A ratio below one returns to one, slowly.
    let held = |ratio: f64| nominal * (1.0 - (1.0 - ratio) * (1.0 - 1.0 / 2048.0));
    for wrong in [f64::NAN, f64::INFINITY, -nominal, 0.0, 0.04 * nominal, 4.1 * nominal] {
        let (mut state, mut healthy) = (channel.at_rest(), channel.at_rest());
        // Before any valid one it is the configured pressure.
        let pressures = [nominal, 1.3 * nominal, 1.3 * nominal, 0.8 * nominal, held(0.8), 0.9 * nominal];
        for (tick, pressure) in (0..).zip(pressures) {
            let good = Input { supply_pressure: pressure, ..swing(tick) };
            let lost = tick % 2 == 0;
            let given = if lost { Input { supply_pressure: wrong, ..good } } else { good };
            let (out, like) = (channel.step(&mut state, &given), channel.step(&mut healthy, &good));
            assert!((out.voltage - like.voltage).abs() < 1e-12, "{wrong}, tick {tick}: {out:?} {like:?}");
            assert_eq!(out.status, like.status | if lost { status::STUCK_MEASUREMENT } else { 0 });
        }
        // And a prime goes on from it.
        let lost = Input { supply_pressure: wrong, ..swing(6) };
        channel.prime(&mut state, &lost);
        channel.prime(&mut healthy, &Input { supply_pressure: held(0.9), ..lost });
        let (out, like) = (channel.step(&mut state, &lost), channel.step(&mut healthy, &lost));
        assert!((out.voltage - like.voltage).abs() < 1e-12, "{wrong}: {out:?} {like:?}");
    }
}

#[test]
fn a_gap_is_longer_than_its_time() {
    let ticks = |gap_time| Channel::<f64, 21>::new(&Parameters { gap_time, ..RIG }).unwrap().gap_ticks;
    assert_eq!([0.0, 0.25, 0.01, f64::MAX].map(ticks), [1, 1025, 41, u32::MAX]);
}

#[test]
fn a_velocity_estimate_continues_from_the_mean_velocity_of_a_gap() {
    let velocity_source = VelocitySource::Derivative { corner: 80.0 };
    let p = Parameters { velocity_source, protection: None, gap_time: 0.01, ..RIG };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let at = |displacement| Input { displacement, ..swing(0) };
    // 10 ms are more than 40 ticks. After fewer the two low-passes get the mean once.
    let once = |lost: f64| 0.1156239 * 0.1156239 * 0.01 / (lost + 1.0) * 4096.0;
    let long = |lost: f64| 0.01 / (lost + 1.0) * 4096.0;
    for (lost, expected) in [(41, long(41.0)), (40, once(40.0)), (1, once(1.0)), (60, long(60.0))] {
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
fn a_velocity_estimate_starts_at_rest_from_the_first_displacement() {
    let gains = [0.05, 5.0, 50.0];
    let mass = 4000.0;
    let lost = |tick: u32| {
        let displacement = if tick.is_multiple_of(2) { f64::NAN } else { -1.001 * crate::LARGEST };
        Input { displacement, force: f64::NAN, ..swing(0) }
    };
    let still = Input { displacement: 0.03, force: 700.0, acceleration: 700.0 / mass, ..swing(0) };
    for velocity_source in [
        VelocitySource::Derivative { corner: 80.0 },
        VelocitySource::Observer { gains, mass },
        VelocitySource::Accelerometer { gains },
    ] {
        for gap_time in [0.01, f64::MAX] {
            let p = Parameters { velocity_source, protection: None, gap_time, ..RIG };
            let channel = Channel::<f64, 21>::new(&p).unwrap();
            let (at_rest, mut primed) = (channel.at_rest(), channel.at_rest());
            channel.step(&mut primed, &Input { displacement: -0.08, ..still });
            channel.prime(&mut primed, &lost(1));
            let mut told = at_rest;
            channel.prime(&mut told, &still);
            assert_eq!(told.velocity_gap, 0);
            for mut state in [at_rest, primed, told] {
                for tick in 0..300 {
                    // The first samples are lost.
                    let input = if tick < 100 { &lost(tick) } else { &still };
                    let velocity = channel.step(&mut state, input).velocity;
                    let stands = if tick < 100 { velocity.is_nan() } else { velocity.abs() < 1e-12 };
                    assert!(stands, "{velocity_source:?} {gap_time} {tick}: {velocity}");
                }
            }
        }
    }
}

#[test]
fn a_velocity_estimate_goes_on_under_another_configuration() {
    let velocity_source = VelocitySource::Derivative { corner: 80.0 };
    let channel = Channel::<f64, 21>::new(&Parameters { velocity_source, protection: None, ..RIG }).unwrap();
    let mut state = channel.at_rest();
    for tick in 0..400 {
        let moved = Input { displacement: 1e-5 * f64::from(tick), ..swing(0) };
        let velocity = channel.step(&mut state, &moved).velocity;
        assert!(tick < 200 || (velocity - 1e-5 * 4096.0).abs() < 1e-9, "{tick}: {velocity}");
        if tick == 300 {
            channel.take_over(&mut state);
        }
    }
}
