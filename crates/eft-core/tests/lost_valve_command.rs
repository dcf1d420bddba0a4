//! A compensation alone whose measured valve command is lost: only the estimators look at it.
// A failed index or unwrap is a failed test; bits are compared on purpose.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, clippy::float_cmp)]

mod rig;

use eft_core::{
    AdaptiveCompensation, AdaptiveCompensationState, AdaptiveParameters, FlowTable, Lanes, Measurements,
    Output, Scalar, status,
};

const RATE: f64 = rig::PARAMETERS.sample_rate;

fn compensation(p: &AdaptiveParameters) -> AdaptiveCompensation<f64, 21> {
    let table = FlowTable::<f64, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
    AdaptiveCompensation::<f64, 21>::new(p, &table).unwrap()
}

/// A swing at a tick, of a valve that passes 6 % more than its table, with a force that pumps.
fn swing(tick: u32, force_per_velocity: f64) -> Measurements<f64> {
    let wave = |time: f64| 0.3 * (std::f64::consts::TAU * 0.8 * time).sin();
    let time = f64::from(tick) / RATE;
    let spool = wave(time - rig::PARAMETERS.response_delay);
    let table = FlowTable::<f64, 21>::new(&rig::OPENINGS, &rig::flows()).unwrap();
    let velocity = 1.06 * table.flow(spool) / rig::PARAMETERS.piston_area;
    Measurements {
        velocity,
        force: force_per_velocity * velocity,
        spool,
        valve_command: wave(time) / rig::PARAMETERS.valve_gain,
        supply_pressure: 1.9e7,
    }
}

type Tick = (Output<f64>, AdaptiveCompensationState<f64>);

/// Every tick's output and state, with what `lost` makes of the valve command.
fn run(p: &AdaptiveParameters, pump: f64, ticks: u32, lost: impl Fn(u32, f64) -> f64) -> Vec<Tick> {
    let c = compensation(p);
    let mut state = c.at_rest();
    (0..ticks)
        .map(|tick| {
            let m = swing(tick, pump);
            let m = Measurements { valve_command: lost(tick, m.valve_command), ..m };
            (c.step(&mut state, 0.0, &m), state)
        })
        .collect()
}

#[test]
fn without_estimators_nobody_misses_it() {
    for guard in [false, true] {
        let p = AdaptiveParameters { adaptive: false, guard, ..rig::ADAPTIVE };
        let sound = run(&p, 2e4, 12_000, |_, v| v);
        let lost = run(&p, 2e4, 12_000, |tick, v| if tick % 5 == 0 || tick > 2000 { f64::NAN } else { v });
        for (n, (sound, lost)) in sound.iter().zip(&lost).enumerate() {
            assert_eq!((sound.0, sound.1.level()), (lost.0, lost.1.level()), "{n}");
        }
        assert_eq!(lost[11_999].1.level() < 0.99, guard);
    }
}

#[test]
fn only_learning_waits_for_it() {
    let learned = |state: &AdaptiveCompensationState<f64>| {
        [state.flow_gain(), state.valve_gain(), state.response_delay()]
    };
    for value in [f64::NAN, f64::INFINITY, 2e12] {
        // Five seconds; the valve command is lost in the third of them.
        let (from, to, end) = (2 * 4096, 3 * 4096, 5 * 4096);
        let p = AdaptiveParameters { guard: false, ..rig::ADAPTIVE };
        let ticks = run(&p, 0.0, end, |tick, v| if (from..to).contains(&tick) { value } else { v });
        let flags = |first: u32, last: u32| {
            ticks[first as usize..last as usize].iter().fold(0, |all, (out, _)| all | out.status)
        };
        let before = learned(&ticks[from as usize - 1].1);
        assert!((before[0] - 1.06).abs() < 0.03, "{before:?}");
        assert_eq!(flags(4096, from) & status::ADAPTATION_FROZEN, 0);
        // A window may still be under way.
        let (first, last) = (learned(&ticks[from as usize + 32].1), learned(&ticks[to as usize - 1].1));
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3 * b);
        assert!(close(first, before) && close(last, first), "{before:?} {first:?} {last:?}");
        assert!(
            ticks[from as usize + 32..to as usize]
                .iter()
                .all(|(out, _)| out.status & status::ADAPTATION_FROZEN != 0)
        );
        assert_eq!(flags(0, end) & (status::INVALID_MEASUREMENT | status::INVALID_COMMAND), 0);
        // The compensation goes on as if nothing had been: what was learned hardly differs.
        let sound = run(&p, 0.0, end, |_, v| v);
        let most = sound.iter().fold(0.0, |most: f64, (out, _)| most.max(out.value.abs()));
        for (lost, sound) in ticks.iter().zip(&sound) {
            assert!((lost.0.value - sound.0.value).abs() < 0.03 * most, "{} {}", lost.0.value, sound.0.value);
        }
        // And it is believed again.
        assert_eq!(flags(to + 1024, end) & status::ADAPTATION_FROZEN, 0);
        assert!((learned(&ticks[end as usize - 1].1)[0] - 1.06).abs() < 0.01);
    }
}

#[test]
fn a_guard_beside_estimators_goes_on_without_it() {
    let lost = run(&rig::ADAPTIVE, 2e4, 12_000, |tick, v| if tick > 0 { f64::NAN } else { v });
    assert!(lost[11_999].1.level() < 0.99, "{}", lost[11_999].1.level());
}

#[test]
fn lanes_lose_it_one_by_one() {
    type Wide = Lanes<f64, 4>;
    let rigs = [true, false, true, false].map(|adaptive| AdaptiveParameters { adaptive, ..rig::ADAPTIVE });
    let single = rigs.map(|p| compensation(&p));
    let wide = AdaptiveCompensation::<Wide, 21>::pack(|i| &single[i]);
    let (mut states, mut packed) = (single.map(|c| c.at_rest()), wide.at_rest());
    for tick in 0..6000_u32 {
        let m = swing(tick, 0.0);
        let given = |lane: usize| if lane < 2 && tick / 700 % 3 == 1 { f64::NAN } else { m.valve_command };
        let all = Measurements {
            velocity: Wide::splat(m.velocity),
            force: Wide::splat(m.force),
            spool: Wide::splat(m.spool),
            valve_command: Wide::from_lanes(given),
            supply_pressure: Wide::splat(m.supply_pressure),
        };
        let together = wide.step(&mut packed, Wide::splat(0.0), &all);
        for (lane, (c, state)) in single.iter().zip(&mut states).enumerate() {
            let alone = c.step(state, 0.0, &Measurements { valve_command: given(lane), ..m });
            assert_eq!(together.value.lane(lane).to_bits(), alone.value.to_bits(), "{tick} {lane}");
            assert_eq!(eft_core::Flags::lane(together.status, lane), alone.status, "{tick} {lane}");
            assert_eq!(packed.flow_gain().lane(lane).to_bits(), state.flow_gain().to_bits());
        }
    }
}
