//! The time at which a calibration is made does not matter, only the window in which it takes effect. The learner may
//! run inline, or in a task that takes up to a whole window.

use eft_core::{
    Calibration, Cause, Channel, ChannelState, Input, Learner, LearnerState, Learning, Output, Parameters,
    ProtectionParameters, Realization, status,
};

use crate::rig::{self, SOUND, Valve};

const TICKS: u32 = 6000;

/// A tick's output, and the calibration that it used.
type Tick = (Output<f32>, Calibration<f32>);

struct Task {
    channel: Channel<f32, 21>,
    state: ChannelState<f32>,
    learner: Learner<f32, 21>,
    memory: LearnerState<f32>,
    /// Calibrations that are not published yet, each with its remaining ticks.
    on_the_way: Vec<(u32, Calibration<f32>)>,
    /// The window for which the learner repeats its last calibration.
    repeats: u32,
    last: Calibration<f32>,
}

impl Task {
    fn new() -> Self {
        Self::of(Realization::Analog)
    }

    fn of(realization: Realization) -> Self {
        let learning = Learning { curve_correction: true, ..Learning::ADAPTIVE };
        let p = Parameters { realization, supply_correction: true, learning, ..rig::LEARNING };
        let channel = Channel::<f32, 21>::new(&p).unwrap();
        let learner = Learner::<f32, 21>::new(&p).unwrap();
        let (state, memory) = (channel.at_rest(), learner.at_rest());
        let last = *state.calibration();
        Self { channel, state, learner, memory, on_the_way: Vec::new(), repeats: u32::MAX, last }
    }

    /// One tick; a window that closes with it takes `delay` ticks to its calibration.
    fn tick(&mut self, tick: u32, delay: u32) -> Tick {
        let valve = Valve { flow_gain: 1.06, valve_gain: 1.03, delay: 6e-3 };
        let mut i = rig::single(&valve.swing(f64::from(tick) / 4096.0, 0.0));
        // Some samples are lost.
        if tick % 1777 == 1776 {
            i.spool = f32::NAN;
        }
        let out = rig::tick(&self.channel, &mut self.state, &i);
        let in_use = *self.state.calibration();
        if let Some(window) = out.window {
            let mut found = self.learner.update(&mut self.memory, &window);
            if window.number == self.repeats {
                found = Calibration { window: window.number, ..self.last };
            }
            self.last = found;
            self.on_the_way.push((tick + delay, found));
        }
        while self.on_the_way.first().is_some_and(|(ready, _)| *ready <= tick) {
            self.channel.publish(&mut self.state, self.on_the_way.remove(0).1);
        }
        (out, in_use)
    }
}

/// Every tick's bits and flags.
fn bits((out, _): &Tick) -> [u32; 4] {
    [out.voltage.to_bits(), out.compensation.to_bits(), out.velocity.to_bits(), out.status]
}

fn run(realization: Realization, delay: impl Fn(u32) -> u32) -> Vec<[u32; 4]> {
    let mut task = Task::of(realization);
    (0..TICKS).map(|tick| bits(&task.tick(tick, delay(tick)))).collect()
}

#[test]
fn a_task_of_any_delay_up_to_a_window_gives_the_bits_of_inline() {
    for realization in [Realization::Analog, Realization::Digital] {
        let inline = run(realization, |_| 0);
        assert!(inline.iter().all(|tick| tick[3] & status::CALIBRATION_LATE == 0));
        let window = Task::new().channel.window_ticks();
        for delay in 1..=window {
            assert!(run(realization, |_| delay) == inline, "{delay} ticks");
        }
        // And for a task of varying duration.
        assert!(run(realization, |tick| tick / window * 7 % (window + 1)) == inline);
    }
}

#[test]
fn a_calibration_takes_effect_with_the_window_after_the_next() {
    let mut task = Task::new();
    let window = task.channel.window_ticks();
    for tick in 0..TICKS {
        let (_, in_use) = task.tick(tick, tick % 5);
        let number = tick / window;
        let expected = if number < 2 { u32::MAX } else { number - 2 };
        assert_eq!(in_use.window, expected, "tick {tick}");
    }
    assert!((task.state.calibration().valve_gain - 1.03).abs() < 0.01, "{:?}", task.state.calibration());
}

#[test]
fn a_late_calibration_is_flagged_and_takes_effect_with_the_next_window() {
    // One window in the middle, when the valve has long been learned.
    const LATE: u32 = 200;
    let window = Task::new().channel.window_ticks();
    for delay in [window + 1, window + 5, 2 * window - 1, 2 * window] {
        let (mut late, mut repeating) = (Task::new(), Task { repeats: LATE, ..Task::new() });
        for tick in 0..TICKS {
            let number = tick / window;
            let (out, in_use) = late.tick(tick, if number == LATE { delay } else { 0 });
            // Equal except for the flag: a learner that repeats its last calibration for that window.
            let (expected, repeated) = repeating.tick(tick, 0);
            let waits = number == LATE + 2;
            assert_eq!(out.status & status::CALIBRATION_LATE != 0, waits, "{delay}: tick {tick}");
            assert_eq!(out.status & !status::CALIBRATION_LATE, expected.status);
            assert_eq!(out.voltage.to_bits(), expected.voltage.to_bits());
            assert_eq!(in_use.window, if waits { LATE - 1 } else { repeated.window });
        }
    }
}

#[test]
fn a_stopped_learner_is_flagged_and_the_last_calibration_stays() {
    let mut task = Task::new();
    for tick in 0..4096 {
        task.tick(tick, 3);
    }
    let last = *task.state.calibration();
    for tick in 4096..TICKS {
        let i = rig::single(&SOUND.swing(f64::from(tick) / 4096.0, 0.0));
        let out = rig::tick(&task.channel, &mut task.state, &i);
        if tick >= 4096 + 2 * 16 {
            assert_ne!(out.status & status::CALIBRATION_LATE, 0);
            assert!(task.state.calibration().window <= last.window + 2);
        }
    }
}

#[test]
fn priming_keeps_what_was_learned_and_is_not_late() {
    let (mut at_once, mut later) = (Task::new(), Task::new());
    for tick in 0..TICKS {
        let (one, other) = (at_once.tick(tick, 0), later.tick(tick, 7));
        assert_eq!(bits(&one), bits(&other), "tick {tick}");
        assert_eq!(one.0.status & status::CALIBRATION_LATE, 0, "tick {tick}");
        if tick % 1501 == 1500 {
            let i = rig::single(&SOUND.swing(f64::from(tick + 1) / 4096.0, 0.0));
            for task in [&mut at_once, &mut later] {
                task.channel.prime(&mut task.state, &i);
            }
        }
    }
    assert!((at_once.state.calibration().valve_gain - 1.03).abs() < 0.02);
}

/// A channel that begins anew while the learner's task still has a window of the last test.
#[test]
fn a_calibration_of_the_last_test_has_no_effect_on_the_next() {
    let p = Parameters {
        realization: Realization::Digital,
        learning: Learning { curve_correction: true, ..Learning::ADAPTIVE },
        protection: Some(ProtectionParameters::DEFAULT),
        ..rig::LEARNING
    };
    let channel = Channel::<f64, 21>::new(&p).unwrap();
    let learner = Learner::<f64, 21>::new(&p).unwrap();
    let valve = Valve { flow_gain: 1.06, valve_gain: 1.03, delay: 6e-3 };
    let sample = |tick: u32| Input { displacement: 0.0, ..valve.swing(f64::from(tick) / 4096.0, 0.0) };
    let (mut state, mut memory) = (channel.at_rest(), learner.at_rest());
    let mut last = *state.calibration();
    for tick in 0..2 * 4096 {
        if let Some(window) = rig::tick(&channel, &mut state, &sample(tick)).window {
            last = learner.update(&mut memory, &window);
            channel.publish(&mut state, last);
        }
    }
    assert!((last.flow_gain - 1.06).abs() < 0.02 && last.window > 500, "{last:?}");
    for late in 0..=channel.window_ticks() {
        let ([mut state, mut undisturbed], mut memory) = ([channel.at_rest(); 2], learner.at_rest());
        let mut ready = None;
        for tick in 0..4 * channel.window_ticks() {
            let out = rig::tick(&channel, &mut state, &sample(tick));
            assert_eq!(out, rig::tick(&channel, &mut undisturbed, &sample(tick)), "{late}: {tick}");
            if tick == late {
                channel.publish(&mut state, last);
            }
            // A task that takes three ticks.
            if let Some(window) = out.window {
                ready = Some((tick + 3, learner.update(&mut memory, &window)));
            }
            if let Some((_, found)) = ready.take_if(|(at, _)| *at <= tick) {
                channel.publish(&mut state, found);
                channel.publish(&mut undisturbed, found);
            }
        }
        assert_eq!(state.cause(), Cause::None, "{late}");
    }
}
