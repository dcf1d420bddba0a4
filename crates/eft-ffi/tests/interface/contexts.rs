//! Exchanges between contexts: nothing is torn or lost. A learner in a task gives the bits of one after the tick.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;

use eft_core::{Parameters, status};
use eft_ffi::*;

use crate::rig::{GUARDED, LEARNING, at_rest, for_c, nothing_learned, sample, zeroed};

/// A value that two contexts share, by address as in C.
struct Shared<T>(*mut T);
// Safety: the test is of the interface that makes sharing safe.
unsafe impl<T> Sync for Shared<T> {}

impl<T> Shared<T> {
    fn get(&self) -> *mut T {
        self.0
    }
}

/// Ends the other context, also after a failed assertion.
struct Done<'a>(&'a AtomicBool);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

fn input(tick: u32) -> eft_input<f32> {
    let [command, velocity, force, spool, displacement, acceleration, supply_pressure, next_command, _] =
        sample(tick).map(|value| value as f32);
    eft_input {
        command,
        velocity,
        force,
        spool,
        displacement,
        acceleration,
        supply_pressure,
        next_command,
        valve_command: f32::NAN,
        alive: f32::NAN,
        period: f32::NAN,
        load_pressure: f32::NAN,
    }
}

#[test]
fn an_offer_is_taken_once_and_stays_until_the_next() {
    let levels = [1.0, 0.9, 0.8, 0.7];
    let configurations = levels.map(|level| at_rest(&for_c(&Parameters { level, ..LEARNING })).0);
    let is = |channel: *const eft_channel<f32>, n: usize| {
        let parameters = for_c(&Parameters { level: levels[n], ..LEARNING });
        // Safety: null or valid.
        unsafe { eft_check_f32(channel, &parameters) }
    };
    let mut exchange = zeroed();
    // One pointer, as in C: a taken item is read after further offers.
    let exchange = &raw mut *exchange;
    // Safety: every pointer is valid.
    unsafe {
        assert!(eft_take_channel_f32(exchange).is_null());
        assert_eq!(eft_offer_channel_f32(exchange, &*configurations[0]), EFT_OK);
        assert_eq!(eft_offer_channel_f32(exchange, &*configurations[1]), EFT_BUSY);
        let mut held = eft_take_channel_f32(exchange);
        for n in 1..4 {
            assert!(eft_take_channel_f32(exchange).is_null());
            assert_eq!(eft_offer_channel_f32(exchange, &*configurations[n]), EFT_OK);
            // The taker still holds the last item.
            assert_eq!(is(held, n - 1), EFT_OK);
            assert_eq!(eft_offer_channel_f32(exchange, &*configurations[0]), EFT_BUSY);
            held = eft_take_channel_f32(exchange);
            assert_eq!(is(held, n), EFT_OK);
        }
    }
}

#[test]
fn no_configuration_is_torn_between_two_threads() {
    let swaps = if cfg!(miri) { 20 } else { 20_000 };
    // Two configurations that differ in their first and in their last number.
    let other = Parameters {
        level: 0.5,
        derivative_gain: 4.0e-4,
        valve_command: 5.0,
        spool_warning: 0.1,
        ..LEARNING
    };
    let parameters = [LEARNING, other].map(|p| for_c(&p));
    let configurations = parameters.map(|p| at_rest(&p).0);
    let mut exchange: Box<eft_exchange<eft_channel<f32>>> = zeroed();
    let (shared, done) = (Shared(&raw mut *exchange), AtomicBool::new(false));
    let (_, rest) = at_rest(&parameters[0]);
    let answer = |channel: *const eft_channel<f32>| {
        let (mut state, mut output) = (*rest, zeroed::<eft_output<f32>>());
        for tick in 100..110 {
            // Safety: every pointer is valid.
            assert_eq!(unsafe { eft_step_f32(channel, &mut state, &input(tick), &mut *output) }, EFT_OK);
        }
        (output.voltage.to_bits(), output.compensation.to_bits(), output.status)
    };
    let answers = [answer(&*configurations[0]), answer(&*configurations[1])];
    assert_ne!(answers[0], answers[1]);
    thread::scope(|scope| {
        let taker = scope.spawn(|| {
            let mut seen = [0; 2];
            while !done.load(Ordering::Acquire) {
                // Safety: one context takes.
                let channel = unsafe { eft_take_channel_f32(shared.get()) };
                if !channel.is_null() {
                    let got = answer(channel);
                    seen[answers.iter().position(|a| *a == got).expect("a torn configuration")] += 1;
                } else {
                    // On one processor the other context would wait for the rest of this one's turn.
                    thread::yield_now();
                }
            }
            seen
        });
        let home = Done(&done);
        for n in 0..swaps {
            // Safety: one context offers.
            while !taker.is_finished()
                && unsafe { eft_offer_channel_f32(shared.get(), &*configurations[n % 2]) } == EFT_BUSY
            {
                thread::yield_now();
            }
        }
        drop(home);
        let seen: [usize; 2] = taker.join().unwrap();
        // The last one may not have been read.
        assert!(seen.iter().sum::<usize>() + 1 >= swaps, "{seen:?} of {swaps}");
    });
}

/// The results of each tick, with the learner after it.
fn after_the_tick(p: &Parameters, ticks: u32) -> Vec<(u32, u32)> {
    let parameters = for_c(p);
    let ((channel, mut state), (learner, mut learned)) = (at_rest(&parameters), nothing_learned(&parameters));
    let (mut output, mut calibration): (Box<eft_output<f32>>, Box<_>) = (zeroed(), zeroed());
    (0..ticks)
        // Safety: every pointer is valid.
        .map(|tick| unsafe {
            assert_eq!(eft_step_f32(&*channel, &raw mut *state, &input(tick), &mut *output), EFT_OK);
            if output.window_closed != 0 {
                let code = eft_learn_f32(&*learner, &mut *learned, &output.window, &mut *calibration);
                assert_eq!(
                    (code, eft_publish_f32(&*channel, &raw mut *state, &*calibration)),
                    (EFT_OK, EFT_OK)
                );
            }
            (output.voltage.to_bits(), output.status)
        })
        .collect()
}

/// The same with the learner in another thread. The tick waits for its calibration up to `patience` ticks after a
/// window.
fn in_a_task(p: &Parameters, ticks: u32, patience: impl Fn(u32) -> u32) -> Vec<(u32, u32)> {
    let parameters = for_c(p);
    let ((channel, mut state), (learner, mut learned)) = (at_rest(&parameters), nothing_learned(&parameters));
    let mut windows: Box<eft_exchange<eft_window<f32>>> = zeroed();
    let mut calibrations: Box<eft_exchange<eft_calibration<f32>>> = zeroed();
    let (up, down) = (Shared(&raw mut *windows), Shared(&raw mut *calibrations));
    let (done, learner) = (AtomicBool::new(false), &*learner);
    thread::scope(|scope| {
        let task = scope.spawn(|| {
            let mut calibration = zeroed();
            while !done.load(Ordering::Acquire) {
                // Safety: this context takes windows and offers calibrations.
                unsafe {
                    let window = eft_take_window_f32(up.get());
                    if !window.is_null() {
                        assert_eq!(eft_learn_f32(learner, &mut *learned, window, &mut *calibration), EFT_OK);
                        assert_eq!(eft_offer_calibration_f32(down.get(), &*calibration), EFT_OK);
                    }
                }
                thread::yield_now();
            }
        });
        let _home = Done(&done);
        let (mut output, mut due): (Box<eft_output<f32>>, Option<u32>) = (zeroed(), None);
        (0..ticks)
            // Safety: every pointer is valid; this context offers windows and takes calibrations.
            .map(|tick| unsafe {
                assert_eq!(eft_step_f32(&*channel, &raw mut *state, &input(tick), &mut *output), EFT_OK);
                let answer = (output.voltage.to_bits(), output.status);
                if output.window_closed != 0 {
                    assert_eq!(eft_offer_window_f32(up.get(), &output.window), EFT_OK);
                    due = Some(tick + patience(tick));
                }
                while due == Some(tick) {
                    assert!(!task.is_finished());
                    let fresh = eft_take_calibration_f32(down.get());
                    if !fresh.is_null() {
                        assert_eq!(eft_publish_f32(&*channel, &raw mut *state, fresh), EFT_OK);
                        due = None;
                    }
                    thread::yield_now();
                }
                answer
            })
            .collect()
    })
}

#[test]
fn a_learner_in_a_task_gives_the_bits_of_one_after_the_step() {
    let ticks = if cfg!(miri) { 100 } else { 4000 };
    let expected = after_the_tick(&LEARNING, ticks);
    // A window has 16 ticks; the task takes from 0 to 15 of them.
    let patiences: [fn(u32) -> u32; 3] = [|_| 0, |_| 14, |tick| tick.wrapping_mul(2_654_435_761) >> 28];
    for (n, patience) in patiences.into_iter().enumerate() {
        let patience = |tick| patience(tick).min(14);
        assert!(in_a_task(&LEARNING, ticks, patience) == expected, "patience {n}");
    }
    assert!(expected.iter().all(|(_, status)| status & status::CALIBRATION_LATE == 0));
}

// SR-13
#[test]
fn a_requested_trip_is_never_lost_while_steps_run() {
    let rounds = if cfg!(miri) { 3 } else { 500 };
    let parameters = for_c(&GUARDED);
    let (channel, mut state) = at_rest(&parameters);
    let shared = Shared(&raw mut *state);
    // The round in which the other context may request, and the last round in which it has.
    let (round, asked, done) = (AtomicU32::new(0), AtomicU32::new(0), AtomicBool::new(false));
    thread::scope(|scope| {
        scope.spawn(|| {
            for n in 1..=rounds {
                while round.load(Ordering::Acquire) != n {
                    if done.load(Ordering::Acquire) {
                        return;
                    }
                    thread::yield_now();
                }
                for _ in 0..n.wrapping_mul(2_654_435_761) >> 24 {
                    std::hint::spin_loop();
                }
                // Safety: a request may come at any moment.
                assert_eq!(unsafe { eft_request_trip_f32(shared.get()) }, EFT_OK);
                asked.store(n, Ordering::Release);
            }
        });
        let (_home, mut output) = (Done(&done), zeroed::<eft_output<f32>>());
        for n in 1..=rounds {
            // Safety: the other context waits for its round, and then only requests.
            let mut step = || unsafe {
                assert_eq!(eft_step_f32(&*channel, shared.get(), &input(1), &mut *output), EFT_OK);
                output.status & status::TRIPPED != 0
            };
            // Safety: the same.
            assert_eq!(unsafe { eft_reset_f32(&*channel, shared.get()) }, EFT_OK);
            assert!(!step(), "no trip was requested");
            round.store(n, Ordering::Release);
            while asked.load(Ordering::Acquire) != n {
                step();
            }
            assert!(step(), "round {n}: lost");
        }
    });
}
