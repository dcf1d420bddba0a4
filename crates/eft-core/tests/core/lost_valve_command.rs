//! A compensation for an analog force loop whose sampled valve command is lost: only the learner uses it.

use eft_core::{Calibration, Channel, Input, Learner, Learning, Output, Parameters, Realization, status};

use crate::rig;

const BESIDE: Parameters<'static> = Parameters { realization: Realization::Analog, ..rig::LEARNING };

/// A swing of a valve that passes 6 % more than its table, with a varying force.
fn swing(tick: u32, force_per_velocity: f64) -> Input<f64> {
    rig::Valve { flow_gain: 1.06, ..rig::SOUND }
        .swing(f64::from(tick) / BESIDE.sample_rate, force_per_velocity)
}

/// Every tick's output and calibration, with the valve command changed by `lost`.
fn run(
    learning: Learning,
    pump: f64,
    ticks: u32,
    lost: impl Fn(u32, f64) -> f64,
) -> Vec<(Output<f64>, Calibration<f64>)> {
    let p = Parameters { learning, ..BESIDE };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    (0..ticks)
        .map(|tick| {
            let i = swing(tick, pump);
            let i = Input { valve_command: lost(tick, i.valve_command), ..i };
            let out = rig::tick(&channel, &mut state, &i);
            let in_use = *state.calibration();
            if let Some(window) = out.window {
                channel.publish(&mut state, learner.update(&mut memory, &window));
            }
            (out, in_use)
        })
        .collect()
}

#[test]
fn without_estimators_it_has_no_effect() {
    let learning = Learning { adaptive: false, ..Learning::ADAPTIVE };
    let sound = run(learning, 2e4, 12_000, |_, v| v);
    let lost = run(learning, 2e4, 12_000, |tick, v| if tick % 5 == 0 || tick > 2000 { f64::NAN } else { v });
    for (n, (sound, lost)) in sound.iter().zip(&lost).enumerate() {
        let tick = |(out, calibration): &(Output<f64>, Calibration<f64>)| {
            (out.voltage, out.compensation, out.status, calibration.level)
        };
        assert_eq!(tick(sound), tick(lost), "{n}");
    }
    assert!(lost[11_999].1.level < 0.99);
}

#[test]
fn only_learning_stops() {
    let learned = |c: &Calibration<f64>| [c.flow_gain, c.valve_gain, c.response_delay];
    let learning = Learning { guard: false, ..Learning::ADAPTIVE };
    // One window, and the two until its calibration takes effect.
    let late = 3 * 16;
    for value in [f64::NAN, f64::INFINITY, 2e12] {
        // Five seconds; the valve command is lost in the third of them.
        let (from, to, end) = (2 * 4096, 3 * 4096, 5 * 4096);
        let ticks = run(learning, 0.0, end, |tick, v| if (from..to).contains(&tick) { value } else { v });
        let flags = |first: u32, last: u32| {
            ticks[first as usize..last as usize].iter().fold(0, |all, (out, _)| all | out.status)
        };
        let before = learned(&ticks[from as usize - 1].1);
        assert!((before[0] - 1.06).abs() < 0.03, "{before:?}");
        assert_eq!(flags(4096, from) & status::ADAPTATION_FROZEN, 0);
        let (first, last) = (learned(&ticks[from as usize + late].1), learned(&ticks[to as usize - 1].1));
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3 * b);
        assert!(close(first, before) && close(last, first), "{before:?} {first:?} {last:?}");
        let frozen = |(out, _): &(Output<f64>, _)| out.status & status::ADAPTATION_FROZEN != 0;
        assert!(ticks[from as usize + late..to as usize].iter().all(frozen));
        assert_eq!(flags(0, end) & (status::INVALID_MEASUREMENT | status::INVALID_COMMAND), 0);
        // The compensation continues, and the estimates hardly differ.
        let sound = run(learning, 0.0, end, |_, v| v);
        let most = sound.iter().fold(0.0, |most: f64, (out, _)| most.max(out.voltage.abs()));
        for ((lost, _), (sound, _)) in ticks.iter().zip(&sound) {
            assert!((lost.voltage - sound.voltage).abs() < 0.03 * most, "{} {}", lost.voltage, sound.voltage);
        }
        // Learning has resumed.
        assert_eq!(flags(to + 1024, end) & status::ADAPTATION_FROZEN, 0);
        assert!((learned(&ticks[end as usize - 1].1)[0] - 1.06).abs() < 0.01);
    }
}

#[test]
fn a_guard_with_estimators_continues_without_it() {
    let lost = run(Learning::ADAPTIVE, 2e4, 12_000, |tick, v| if tick > 0 { f64::NAN } else { v });
    assert!(lost[11_999].1.level < 0.99, "{}", lost[11_999].1.level);
}
