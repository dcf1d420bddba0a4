//! The tick over lost samples and behind them.

use eft_core::{Channel, Input, Parameters, ProtectionParameters, VelocitySource, status};

use crate::rig;

/// The largest change of the valve command (V) per tick after a gap of this many ticks, less that of a run without a
/// gap.
fn jump_behind(gap: u32, p: &Parameters) -> f64 {
    let channel = Channel::<f64, 21>::new(p).unwrap();
    let run = |lost: core::ops::Range<u32>| {
        let mut state = channel.at_rest();
        let (mut last, mut largest) = (0.0_f64, 0.0_f64);
        for tick in 0..4096 {
            let (sine, cosine) = (std::f64::consts::TAU * 1.6 * f64::from(tick) / 4096.0).sin_cos();
            let mut input = Input {
                command: 3e3 * sine,
                velocity: 0.5 * sine,
                force: 2.9e3 * sine,
                spool: 0.3 * sine,
                displacement: -0.05 * cosine,
                acceleration: 5.0 * cosine,
                ..Input::default()
            };
            if lost.contains(&tick) {
                (input.velocity, input.displacement, input.command) = (f64::NAN, f64::NAN, f64::NAN);
            }
            let voltage = rig::tick(&channel, &mut state, &input).voltage;
            if tick > lost.start {
                largest = largest.max((voltage - last).abs());
            }
            last = voltage;
        }
        largest
    };
    run(2000..2000 + gap) - run(2000..2000)
}

// SR-14
#[test]
fn after_lost_samples_the_valve_command_jumps_no_further_than_the_motion() {
    let gains = [0.07, 10.0, 736.0];
    let feedforward = Parameters { feedforward: true, ..rig::PARAMETERS };
    let protection = Some(ProtectionParameters::DEFAULT);
    for p in [
        rig::PARAMETERS,
        feedforward,
        rig::LEARNING,
        Parameters { protection, ..rig::PARAMETERS },
        Parameters { protection, ..feedforward },
        Parameters { velocity_source: VelocitySource::Derivative { corner: 80.0 }, ..feedforward },
        Parameters { velocity_source: VelocitySource::Observer { gains, mass: 7040.0 }, ..feedforward },
        Parameters { velocity_source: VelocitySource::Accelerometer { gains }, ..feedforward },
    ] {
        // The change over a gap of up to 2.5 ms counts as that of one tick, also in an estimated velocity.
        let shorter: &[(u32, f64)] = match p.velocity_source {
            VelocitySource::Sensor => &[(1, 0.1), (4, 0.1), (10, 0.3)],
            _ => &[],
        };
        for &(gap, most) in shorter.iter().chain(&[(11, 0.1), (20, 0.1), (41, 0.1)]) {
            let jump = jump_behind(gap, &p);
            assert!(jump < most, "{:?}: {jump} V after {gap} ticks", p.velocity_source);
        }
        // In 55 ms the motion itself changes the command by about a volt.
        let jump = jump_behind(225, &p);
        assert!((0.1..1.5).contains(&jump), "{:?}: {jump} V", p.velocity_source);
    }
}

// SR-14
#[test]
fn a_lost_next_command_after_a_gap_makes_no_jump() {
    let p = Parameters { feedforward: true, look_ahead: true, ..rig::PARAMETERS };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let rests =
        Input { command: 3e3, next_command: 3e3, velocity: 0.0, force: 3e3, spool: 0.0, ..Input::default() };
    let mut state = channel.at_rest();
    let mut after = |input: Input<f64>, ticks: u32| {
        (0..ticks).fold(f64::NAN, |_, _| rig::tick(&channel, &mut state, &input).voltage)
    };
    let rested = after(rests, 4096);
    after(Input { velocity: f64::NAN, ..rests }, 225);
    let lost = after(Input { next_command: f64::NAN, ..rests }, 1);
    let next = after(rests, 1);
    assert!((lost - rested).abs() < 1e-9 && (next - rested).abs() < 1e-9, "{rested} {lost} {next}");
}

#[test]
fn a_lost_next_command_is_flagged_and_does_not_trip() {
    let looks_ahead = Parameters { feedforward: true, look_ahead: true, ..rig::PARAMETERS };
    let protected = Parameters { protection: Some(ProtectionParameters::DEFAULT), ..looks_ahead };
    for (p, flagged) in [(looks_ahead, true), (protected, true), (rig::PARAMETERS, false)] {
        let channel = Channel::<f32, 21>::new(&p).unwrap();
        let mut state = channel.at_rest();
        for tick in 0..100 {
            let command = 10.0 * tick as f32;
            let next_command = [command + 10.0, f32::NAN, f32::INFINITY, 3e38][tick % 4];
            let motion =
                Input { velocity: 0.0, force: command, spool: 0.0, displacement: 0.0, ..Input::default() };
            let out = channel.step(&mut state, &Input { command, next_command, ..motion });
            let lost = flagged && tick % 4 != 0;
            assert_eq!(out.status, if lost { status::INVALID_COMMAND } else { 0 }, "tick {tick} of {p:?}");
        }
    }
}
