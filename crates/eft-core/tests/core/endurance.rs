//! Long tests: sums in `f32` neither drift nor grow. A day at 10 kHz has 864 million ticks. The tick forgets its past,
//! so a day of swings is one swing many times. The learner gets all 27 million windows of a day. Both together run for
//! 100 million noisy ticks.

use eft_core::{
    Channel, Input, Learner, Learning, Levels, Parameters, ProtectionParameters, Realization, VelocitySource,
    Window,
};

use crate::rig::{self, SOUND, Valve};

/// Ticks of one swing: a whole number of windows, at 0.8 Hz.
const SWING: u32 = 12_800;
/// Sample rate (Hz).
const RATE: f64 = 10_240.0;
/// A rig with all estimates, whose valve passes 6 % more than its table.
const RIG: Parameters<'static> = Parameters {
    sample_rate: RATE,
    realization: Realization::Analog,
    learning: Learning { curve_correction: true, ..Learning::ADAPTIVE },
    ..rig::LEARNING
};
/// Number of swings after which the curve is found.
const SETTLED: u32 = 300;
const VALVE: Valve = Valve { flow_gain: 1.06, valve_gain: 1.03, ..SOUND };

fn swing() -> Vec<Input<f32>> {
    (0..SWING).map(|tick| rig::single(&VALVE.swing(f64::from(tick) / RATE, 0.0))).collect()
}

#[test]
fn a_tick_forgets_its_past_within_some_swings() {
    let protection = ProtectionParameters {
        force: Levels { warning: 8e4, trip: 1e5 },
        start_time: 1.0,
        ..ProtectionParameters::DEFAULT
    };
    let gains = [0.07, 10.0, 736.0];
    for velocity_source in [
        VelocitySource::Sensor,
        VelocitySource::Derivative { corner: 80.0 },
        VelocitySource::Observer { gains, mass: 7040.0 },
    ] {
        let p = Parameters {
            realization: Realization::Digital,
            velocity_source,
            learning: Learning::OFF,
            protection: Some(protection),
            stuck_samples: 50,
            ..RIG
        };
        let channel = Channel::<f32, 21>::new(&p).unwrap();
        let mut state = channel.at_rest();
        let mut through = || {
            for (tick, i) in (0..SWING).zip(swing()) {
                let phase = std::f32::consts::TAU * tick as f32 / SWING as f32;
                let (command, force) = (1e3 * phase.cos(), 900.0 * phase.cos());
                rig::tick(
                    &channel,
                    &mut state,
                    &Input { command, force, displacement: 0.05 * phase.sin(), ..i },
                );
            }
            state
        };
        // The first swings still depend on the start. A state that repeats then repeats forever.
        let mut seen = vec![through()];
        let again = (0..300).find(|_| {
            let state = through();
            let before = seen.contains(&state);
            seen.push(state);
            before
        });
        assert!(again.is_some(), "{velocity_source:?}: {:?}", seen.last());
    }
}

#[test]
#[ignore = "ten seconds in a release build"]
fn a_learner_does_not_drift_in_a_day() {
    let channel = Channel::<f32, 21>::new(&RIG).unwrap();
    let learner = Learner::<f32, 21>::new(&RIG).unwrap();
    let mut state = channel.at_rest();
    // The second swing, which has complete windows.
    let twice = swing().into_iter().chain(swing());
    let closed = twice.filter_map(|i| rig::tick(&channel, &mut state, &i).window);
    let windows: Vec<Window<f32>> = closed.skip((SWING / channel.window_ticks()) as usize).collect();
    let day = (24.0 * 3600.0 * RATE / f64::from(channel.window_ticks())) as u32;
    // The window's number wraps in the middle of the day.
    let mut number = (day / 2).wrapping_neg();
    let mut memory = learner.at_rest();
    let mut found = *state.calibration();
    for swing in 0..day / windows.len() as u32 {
        for window in &windows {
            found = learner.update(&mut memory, &Window { number, ..*window });
            number = number.wrapping_add(1);
            assert!(found.status == 0 || swing <= SETTLED, "window {number}: {found:?}");
        }
        if swing > SETTLED {
            let flow = learner.found_flow(&found, 0.2) / rig::table().flow(0.2) as f32;
            assert!((flow - 1.06).abs() < 0.005 && (found.valve_gain - 1.03).abs() < 0.002, "{found:?}");
        }
    }
    assert!(number > 1 << 20 && number < day, "{number}");
}

#[test]
#[ignore = "ten seconds in a release build"]
fn the_estimates_do_not_drift_in_a_hundred_million_noisy_ticks() {
    let channel = Channel::<f32, 21>::new(&RIG).unwrap();
    let learner = Learner::<f32, 21>::new(&RIG).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let swing = swing();
    let mut noise = 1_u32;
    for n in 0..100_000_000 / SWING {
        for i in &swing {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let spool = i.spool + 1e-3 * ((noise >> 8) as f32 / 16_777_216.0 - 0.5);
            let out = rig::tick(&channel, &mut state, &Input { spool, ..*i });
            if n > SETTLED {
                assert_eq!(out.status, 0, "swing {n}");
            }
            if let Some(window) = out.window {
                channel.publish(&mut state, learner.update(&mut memory, &window));
            }
        }
        if n > SETTLED {
            let found = state.calibration();
            let flow = learner.found_flow(found, 0.2) / rig::table().flow(0.2) as f32;
            assert!((flow - 1.06).abs() < 0.005 && (found.valve_gain - 1.03).abs() < 0.002, "{n}: {found:?}");
        }
    }
}
