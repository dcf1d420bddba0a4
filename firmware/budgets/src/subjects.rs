//! The functions that are measured, and their settings.

use core::hint::black_box;

use eft_core::*;
use eft_rigs::{guarded, worn};
use semihosting::println;

use crate::blocks::*;
use crate::inputs::{Random, rig};
use crate::probe::{Cost, cost, probed, worst};
use crate::rigs::{CROWDED, CURVE, LONGEST, PAPER, ROBUST, SELF_CALIBRATING, WATCHED, WORN, made};

/// A window's calibration is published after this many ticks, so that the next window has begun. Now and then there are
/// too many, so that the calibration is late.
pub fn later(window: u32) -> u32 {
    if window % 8 == 7 { 70 } else { 5 }
}

type Step = extern "C" fn(&Channel<f32, N>, &mut ChannelState<f32>, &Input<f32>, &mut Answer);
type Update = extern "C" fn(&Learner<f32, N>, &mut LearnerState<f32>, &Window<f32>, &mut Calibration<f32>);
type Publish = extern "C" fn(&Channel<f32, N>, &mut ChannelState<f32>, &Calibration<f32>);

/// Prints one line a function and setting: name, instructions, bytes of stack.
pub fn run() {
    static PLAIN: Channel<f32, N> = made!(Channel::<f32, N>::new(&PAPER));
    static LEARNING: Channel<f32, N> = made!(Channel::<f32, N>::new(&SELF_CALIBRATING));
    static INTEGRATING: Channel<f32, N> = made!(Channel::<f32, N>::new(&ROBUST));
    static WITH_WEAR: Channel<f32, N> = made!(Channel::<f32, N>::new(&WORN));
    static CORRECTING: Channel<f32, N> = made!(Channel::<f32, N>::new(&CURVE));
    static NEAR_NULL: Channel<f32, N> = made!(Channel::<f32, N>::new(&CROWDED));
    static WATCHING: Channel<f32, N> = made!(Channel::<f32, N>::new(&WATCHED));
    static LEARNER: Learner<f32, N> = made!(Learner::<f32, N>::new(&SELF_CALIBRATING));
    static CORRECTOR: Learner<f32, N> = made!(Learner::<f32, N>::new(&CURVE));
    static NEAR_NULL_LEARNER: Learner<f32, N> = made!(Learner::<f32, N>::new(&CROWDED));
    blocks();
    let (learner, corrector, near_null) = (Some(&LEARNER), Some(&CORRECTOR), Some(&NEAR_NULL_LEARNER));
    for (name, step, channel, learner) in [
        ("paper_tick", paper_tick as Step, &PLAIN, None),
        ("self_calibrating_tick", self_calibrating_tick, &LEARNING, learner),
        ("robust_tick", robust_tick, &INTEGRATING, learner),
        ("worn_tick", worn_tick, &WITH_WEAR, Some(&worn::LEARNER)),
        ("every_part_tick", every_part_tick, &worn::CHANNEL, Some(&worn::LEARNER)),
        ("self_calibrating_curve_tick", self_calibrating_curve_tick, &CORRECTING, corrector),
        ("crowded_tick", crowded_tick, &NEAR_NULL, near_null),
        ("guarded_tick", guarded_tick, &guarded::CHANNEL, Some(&guarded::LEARNER)),
        ("watched_tick", watched_tick, &WATCHING, corrector),
        ("channel_step, paper", channel_step, &PLAIN, None),
        ("channel_step, self-calibrating", channel_step, &LEARNING, learner),
        ("channel_step, curve", channel_step, &CORRECTING, corrector),
        ("channel_step, crowded", channel_step, &NEAR_NULL, near_null),
        ("channel_step, guarded", channel_step, &guarded::CHANNEL, Some(&guarded::LEARNER)),
        ("channel_step, watched", channel_step, &WATCHING, corrector),
    ] {
        let cost = ticks(step, channel, learner);
        println!("{name} {}", cost.step);
        // The cost of the learner does not depend on the caller of the tick.
        match name {
            "self_calibrating_tick" => println!("learner_update {}", cost.update),
            "self_calibrating_curve_tick" => {
                println!("learner_update, curve {}", cost.update);
                println!("channel_publish {}", cost.publish);
            }
            "crowded_tick" => println!("learner_update, crowded {}", cost.update),
            _ => {}
        }
    }
}

#[derive(Default)]
struct Costs {
    step: Cost,
    update: Cost,
    publish: Cost,
}

/// The highest costs in a run with its learner, the start and the end of windows included.
fn ticks(function: Step, channel: &Channel<f32, N>, learner: Option<&Learner<f32, N>>) -> Costs {
    let (mut random, mut worst) = (Random(12345), Costs::default());
    let (mut position, mut learned) = (0.0, false);
    let mut state = channel.at_rest();
    let mut memory = learner.map(Learner::at_rest);
    let mut answer = Answer::default();
    let mut calibration = *state.calibration();
    let mut wait = 0;
    for tick in 0..20_000 {
        // A trip is final, so the run starts again now and then.
        if tick & 0x7f == 0 && tick & 0x1fff <= 0x800 {
            state = channel.at_rest();
            memory = learner.map(Learner::at_rest);
            wait = 0;
        }
        let input = rig(tick, &mut position, &mut random);
        let f = probed!(function, Step);
        f(channel, &mut state, &input, &mut answer);
        worst.step.raise(cost());
        if let (Some(learner), Some(memory), Some(window)) = (learner, &mut memory, &answer.window.take()) {
            let f = probed!(learner_update, Update);
            f(learner, memory, window, &mut calibration);
            worst.update.raise(cost());
            learned |= calibration.flow_gain != 1.0 && calibration.valve_gain != 1.0;
            wait = later(window.number);
        } else if wait > 0 {
            wait -= 1;
            if wait == 0 {
                let f = probed!(channel_publish, Publish);
                f(channel, &mut state, &calibration);
                worst.publish.raise(cost());
            }
        }
    }
    assert!(learner.is_none() || learned, "nothing was learned");
    worst
}

/// The single parts.
fn blocks() {
    static COMPENSATION: Compensation<f32, N> = made!(Compensation::<f32, N>::new(&PAPER));
    static TABLE: FlowTable<f32, N> = made!(FlowTable::<f32, N>::new(PAPER.openings, PAPER.flows));
    static CROWDED_TABLE: FlowTable<f32, N> =
        made!(FlowTable::<f32, N>::new(CROWDED.openings, CROWDED.flows));
    static LONGEST_TABLE: PiecewiseLinear<f32, 255> =
        made!(PiecewiseLinear::<f32, 255>::new("x", &LONGEST, "y", &LONGEST));
    static LEAD: LeadNetwork<f32> = made!(LeadNetwork::<f32>::new(12.4, 5.0e-3, 0.1, PAPER.sample_rate));
    static LOAD_PRESSURE: LoadPressure<f32> =
        made!(LoadPressure::<f32>::new(PAPER.piston_area, PAPER.supply_pressure));
    static DERIVATIVE: FilteredDerivative<f32> =
        made!(FilteredDerivative::<f32>::new(80.0, PAPER.sample_rate));
    static OBSERVER: VelocityObserver<f32> =
        made!(VelocityObserver::<f32>::new([0.07, 10.0, 736.0], PAPER.sample_rate));
    const LEVELS: Option<ProtectionParameters> = guarded::PARAMETERS.protection;
    static PROTECTION: Protection<f32> = match LEVELS {
        Some(levels) => made!(Protection::<f32>::new(&levels, PAPER.sample_rate)),
        None => panic!("the rig has a protection"),
    };
    // At this rate a window of the watch closes in every second tick.
    static WATCHING: Protection<f32> = match LEVELS {
        Some(levels) => {
            made!(Protection::<f32>::new(&ProtectionParameters { oscillation_limit: 400.0, ..levels }, 60.0))
        }
        None => panic!("the rig has a protection"),
    };

    let calibration = COMPENSATION.nominal();
    let mut state = CompensationState::default();
    let mut flags = 0;
    let f = probed!(
        compensation_step,
        extern "C" fn(
            &Compensation<f32, N>,
            &mut CompensationState<f32>,
            &Calibration<f32>,
            &mut u32,
            f32,
            f32,
            f32,
            f32,
        ) -> f32
    );
    worst("compensation_step", |r| {
        let (v, f_, x, q) = (r.sample(1.0), r.sample(1.5e5), r.sample(1.0), r.sample(1.0e-3));
        black_box(f(&COMPENSATION, &mut state, &calibration, &mut flags, v, f_, x, q));
    });
    let mut lead = LeadState::default();
    let f = probed!(lead_step, extern "C" fn(&LeadNetwork<f32>, &mut LeadState<f32>, f32) -> f32);
    worst("lead_step", |r| {
        black_box(f(&LEAD, &mut lead, r.sample(1.0)));
    });
    let f = probed!(table_inverse, extern "C" fn(&PiecewiseLinear<f32, N>, f32) -> f32);
    worst("table_inverse", |r| {
        black_box(f(TABLE.inverse(), r.sample(8.0e-3)));
    });
    worst("table_inverse, crowded", |r| {
        black_box(f(CROWDED_TABLE.inverse(), r.sample(1.0e-3)));
    });
    let f = probed!(longest_table, extern "C" fn(&PiecewiseLinear<f32, 255>, f32) -> f32);
    worst("longest_table", |r| {
        black_box(f(&LONGEST_TABLE, r.sample(0.1)));
    });
    let f = probed!(load_pressure_factor, extern "C" fn(&LoadPressure<f32>, f32, f32) -> f32);
    worst("load_pressure_factor", |r| {
        black_box(f(&LOAD_PRESSURE, r.sample(1.5e5), r.sample(1.0)));
    });
    let mut state = FilteredDerivativeState::default();
    let f = probed!(
        derivative_step,
        extern "C" fn(&FilteredDerivative<f32>, &mut FilteredDerivativeState<f32>, f32) -> f32
    );
    worst("derivative_step", |r| {
        black_box(f(&DERIVATIVE, &mut state, r.sample(0.1)));
    });
    let mut state = VelocityObserverState::default();
    let f = probed!(
        observer_step,
        extern "C" fn(&VelocityObserver<f32>, &mut VelocityObserverState<f32>, f32, f32) -> f32
    );
    worst("observer_step", |r| {
        black_box(f(&OBSERVER, &mut state, r.sample(0.1), r.sample(20.0)));
    });
    let (mut state, mut tick) = (ProtectionState::default(), 0_u32);
    let mut protected = Protected { command: 0.0, authority: 1.0, level: 1.0, open: false, status: 0 };
    let f = probed!(
        protection_step,
        extern "C" fn(
            &Protection<f32>,
            &mut ProtectionState<f32>,
            &mut Protected<f32>,
            u32,
            f32,
            f32,
            f32,
            f32,
            f32,
            f32,
            f32,
        )
    );
    for (name, protection) in [("protection_step", &PROTECTION), ("protection_step, oscillation", &WATCHING)]
    {
        worst(name, |r| {
            // A trip is final, so the run starts again now and then.
            tick += 1;
            if tick % 64 == 0 {
                state = ProtectionState::default();
            }
            let flags = r.next() & status::STUCK_MEASUREMENT;
            let (c, f_, x, v, o) =
                (r.sample(1.0e4), r.sample(3.0e4), r.sample(0.08), r.sample(1.0), r.sample(0.8));
            let (n, t) = (r.sample(10.0), r.sample(2.5e-4));
            f(protection, &mut state, &mut protected, flags, c, f_, x, v, o, n, t);
        });
    }
}
