//! The tick of one actuator: configuration, state, step, and what may be asked of it.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU8, Ordering};

use eft_core::{Calibration, Channel, ChannelState, Input, Output, Window};

use crate::codes::{EFT_MISSED_TICK, EFT_NO_STEP, EFT_NULL_POINTER};
use crate::exchange::exchange;
use crate::parameters::{EFT_TABLE_CAPACITY, check, configure, eft_error, eft_parameters};
use crate::place::{give, given, made, make};
use crate::tables::{data, functions, opaque};

/// A channel's state beside what was asked of it from another context. Requests are never withdrawn, since a trip and
/// an end are final: so none is lost, and no atomic exchange is needed.
pub struct Running<S> {
    /// Behind either of the others, so that a tick looks at one byte.
    asked: AtomicU8,
    trip: AtomicU8,
    end: AtomicU8,
    state: UnsafeCell<S>,
}

impl<S> Running<S> {
    fn new(state: S) -> Self {
        let nothing = || AtomicU8::new(0);
        Self { asked: nothing(), trip: nothing(), end: nothing(), state: UnsafeCell::new(state) }
    }

    /// Asks for what the byte stands for.
    fn ask(&self, of: &AtomicU8) {
        of.store(1, Ordering::Relaxed);
        self.asked.store(1, Ordering::Relaxed);
    }
}

macro_rules! precision {
    (
        $module:ident, $t:ty, words: $channel:literal $state:literal $window:literal $calibration:literal,
        $Channel:ident $State:ident $Window:ident $Calibration:ident $Input:ident $Output:ident
        $Channels:ident $Windows:ident $Calibrations:ident
        $configure:ident $check:ident $integrity:ident $state_integrity:ident $reset:ident $input_init:ident $prime:ident $step:ident $hold:ident $missed:ident
        $publish:ident $calibration_in_use:ident $request_trip:ident $request_end:ident $is_down:ident $take_over:ident
        $offer_channel:ident $take_channel:ident $offer_window:ident $take_window:ident
        $offer_calibration:ident $take_calibration:ident
    ) => {
        mod $module {
            use super::*;

            opaque! {
                /// A channel's configuration. One drives any number of actuators.
                $Channel, $channel, 0x5c, Channel<$t, EFT_TABLE_CAPACITY>;
                /// What a channel remembers: one for each actuator.
                $State, $state, 0xa5, Running<ChannelState<$t>>;
                /// A window that has closed: what the learner is given.
                $Window, $window, 0x3a, Window<$t>;
                /// What the learner has found, as the tick uses it.
                $Calibration, $calibration, 0xc3, Calibration<$t>;
            }

            data! {
                /// One tick's command and measurements. What is never given stays NaN, by eft_input_init: nothing looks at
                /// it, or the tick is flagged.
                $Input {
                    command: $t, "N";
                    velocity: $t, "m/s; where a sensor measures it";
                    force: $t, "N";
                    spool: $t, "1";
                    displacement: $t, "m; for a protection, and where the velocity is made of it";
                    acceleration: $t, "m/s2; for EFT_VELOCITY_ACCELEROMETER";
                    supply_pressure: $t, "Pa; where its departures are corrected";
                    next_command: $t, "N; of the next tick, where the feedforward looks ahead";
                    valve_command: $t, "V; that stood meanwhile, for learning beside an analog controller";
                    alive: $t, "1; counts the samples; for a protection, NaN: not watched";
                    period: $t, "s; since the last sample; for a protection, NaN: not watched";
                }
            }
            data! {
                /// One tick's result.
                $Output {
                    voltage: $t, "V; to the converter: valve command, or compensation signal for an analog loop";
                    compensation: $t, "V; the compensation signal";
                    velocity: $t, "m/s; measured or estimated";
                    permitted_command: $t, "N; the command that an analog controller may follow";
                    authority: $t, "1; the protection's factor; an analog controller has to apply it";
                    status: u32, "EFT_SPOOL_WARNING and its siblings";
                    window_closed: u32, "1 where a window has closed with this tick, else 0";
                    window: $Window, "for eft_learn, where one has closed";
                }
            }

            exchange! {
                /// Configurations on their way from a task to the interrupt; zero bytes are none.
                $Channels, $Channel:
                $offer_channel " Offers a configuration to the interrupt; EFT_BUSY while the one before waits.",
                $take_channel " The configuration that was offered, to step with until the next is taken, after \
eft_take_over; null where there is no new one."
            }
            exchange! {
                /// Windows on their way from the interrupt to the learner's task; zero bytes are none.
                $Windows, $Window:
                $offer_window " Offers output->window to the learner's task; EFT_BUSY while the one before waits: it then \
counts as lost samples.",
                $take_window " The window that was offered, until the next is taken; null where there is no new one."
            }
            exchange! {
                /// Calibrations on their way from the learner's task to the interrupt; zero bytes are none.
                $Calibrations, $Calibration:
                $offer_calibration " Offers a calibration to the interrupt; EFT_BUSY while the one before waits.",
                $take_calibration " The calibration that was offered, for eft_publish, until the next is taken; null where \
there is no new one."
            }

            const NO_STEP: Output<$t> = Output {
                voltage: 0.0,
                compensation: 0.0,
                velocity: 0.0,
                permitted_command: 0.0,
                authority: 0.0,
                status: EFT_NO_STEP,
                window: None,
            };

            /// Lets a tick write its result; where it is refused that is 0 V.
            #[inline(always)]
            unsafe fn answer(
                output: *mut $Output,
                tick: impl FnOnce(&mut $Output) -> Result<(), u8>,
            ) -> Result<(), u8> {
                // Safety: null or valid.
                let output = unsafe { output.as_mut() }.ok_or(EFT_NULL_POINTER)?;
                let result = tick(output);
                if result.is_err() {
                    write(output, &NO_STEP);
                }
                result
            }

            /// Writes a tick's result, with a window only where one has closed.
            // By reference: a result behind an error's byte in one enum would be moved byte by byte.
            #[inline(always)]
            fn write(output: &mut $Output, out: &Output<$t>) {
                output.voltage = out.voltage;
                output.compensation = out.compensation;
                output.velocity = out.velocity;
                output.permitted_command = out.permitted_command;
                output.authority = out.authority;
                output.status = out.status;
                output.window_closed = u32::from(out.window.is_some());
                if let Some(window) = &out.window {
                    // Safety: a reference is valid, and not null.
                    _ = unsafe { make(&mut output.window, *window) };
                }
            }

            functions! {
                /// Checks the parameters and makes a configuration of them. On refusal the configuration stays as it was and
                /// *why (may be null) says what was wrong. Not for the interrupt.
                fn $configure(parameters: *const eft_parameters, channel: *mut $Channel, why: *mut eft_error) {
                    configure(|p, take| Channel::<$t, EFT_TABLE_CAPACITY>::lend(p, take), parameters, channel, why)
                }

                /// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
                /// after a memory fault. Not for the interrupt.
                fn $check(channel: *const $Channel, parameters: *const eft_parameters) {
                    check(|p, take| Channel::<$t, EFT_TABLE_CAPACITY>::lend(p, take), channel, parameters)
                }

                /// Sets *word to a word over every number of a configuration: keep the one behind eft_configure, and compare
                /// each second. One that differs says that memory has changed. Not for the interrupt.
                fn $integrity(channel: *const $Channel, word: *mut u32) {
                    give(word, made(channel)?.integrity())
                }

                /// The same of a state, to compare behind one tick and before the next. In the context of the step.
                fn $state_integrity(state: *const $State, word: *mut u32) {
                    give(word, (*made(state)?.state.get()).integrity())
                }

                /// A rig at rest, nothing learned, tripped or asked for yet.
                fn $reset(channel: *const $Channel, state: *mut $State) {
                    make(state, Running::new(made(channel)?.at_rest()))
                }

                /// Nothing is given: every field is NaN.
                fn $input_init(input: *mut $Input) {
                    give(input.cast(), Input::<$t>::default())
                }

                /// Between eft_reset and the first step, or between two: a rig that has long been at this operating point,
                /// so that the next step has no bump. What was learned stays in use, and the protection goes on where it is.
                /// An invalid input gives a rig at rest.
                fn $prime(channel: *const $Channel, state: *mut $State, input: *const $Input) {
                    let state = &mut *made(state)?.state.get();
                    made(channel)?.prime(state, given(input.cast::<Input<$t>>())?);
                    Ok(())
                }

                /// One tick, in the interrupt. Where it is refused (a null pointer, a channel or state that was never made)
                /// the output is 0 V with EFT_NO_STEP. A measurement or command that is NaN, infinite or out of its range
                /// repeats the last output and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the first good tick
                /// continues.
                fn $step(channel: *const $Channel, state: *mut $State, input: *const $Input, output: *mut $Output) {
                    answer(output, |output| {
                        let (core, running, input) = (made(channel)?, made(state)?, given(input.cast())?);
                        let state = &mut *running.state.get();
                        if running.asked.load(Ordering::Relaxed) != 0 {
                            if running.trip.load(Ordering::Relaxed) != 0 {
                                state.trip();
                            }
                            if running.end.load(Ordering::Relaxed) != 0 {
                                state.end();
                            }
                        }
                        write(output, &core.step(state, input));
                        Ok(())
                    })
                }

                /// In place of a tick: repeats the last output and raises EFT_HELD; the state stays. For several ticks give
                /// eft_step a measurement that is NaN instead, so that nothing is learned of the gap. Refused as eft_step is.
                fn $hold(channel: *const $Channel, state: *const $State, output: *mut $Output) {
                    answer(output, |output| {
                        write(output, &made(channel)?.hold(&*made(state)?.state.get()));
                        Ok(())
                    })
                }

                /// As eft_hold, for a tick that was missed: raises EFT_MISSED_TICK as well.
                fn $missed(channel: *const $Channel, state: *const $State, output: *mut $Output) {
                    answer(output, |output| {
                        let out = made(channel)?.hold(&*made(state)?.state.get());
                        write(output, &Output { status: out.status | EFT_MISSED_TICK, ..out });
                        Ok(())
                    })
                }

                /// Gives a calibration to the tick: that of window k takes effect with the first tick of window k + 2. A
                /// later one takes effect with the next window, and until then each tick raises EFT_CALIBRATION_LATE. In the
                /// context of the step.
                fn $publish(channel: *const $Channel, state: *mut $State, calibration: *const $Calibration) {
                    let state = &mut *made(state)?.state.get();
                    made(channel)?.publish(state, made(calibration)?);
                    Ok(())
                }

                /// The calibration in use. In the context of the step.
                fn $calibration_in_use(state: *const $State, calibration: *mut $Calibration) {
                    make(calibration, *(*made(state)?.state.get()).calibration())
                }

                /// Asks for a trip, as an emergency stop does, or another actuator of the same specimen: the next step trips
                /// at the last command, and no request is lost. From any context, at any moment.
                fn $request_trip(state: *mut $State) {
                    let running = made(state)?;
                    running.ask(&running.trip);
                    Ok(())
                }

                /// Asks for the soft end: from the next step on the command, still followed, fades along the ramp. From any
                /// context, at any moment.
                fn $request_end(state: *mut $State) {
                    let running = made(state)?;
                    running.ask(&running.end);
                    Ok(())
                }

                /// Sets *down to 1 where the protection's ramp has reached zero, or the test has not begun, to 0 elsewhere.
                /// In the context of the step.
                fn $is_down(state: *const $State, down: *mut u8) {
                    give(down, u8::from((*made(state)?.state.get()).is_down()))
                }

                /// After eft_take_channel, for each state that goes on under the new configuration: no bump. Where nothing
                /// is learned it holds at once, else what was learned stays in use until the new learner publishes.
                fn $take_over(channel: *const $Channel, state: *mut $State) {
                    made(channel)?.take_over(&mut *made(state)?.state.get());
                    Ok(())
                }
            }

            // An input is the core's, field by field.
            const _: () = assert!(size_of::<$Input>() == size_of::<Input<$t>>());
        }
        pub use $module::*;
    };
}
precision!(
    single, f32, words: 156 200 8 28,
    eft_channel_f32 eft_state_f32 eft_window_f32 eft_calibration_f32 eft_input_f32 eft_output_f32
    eft_channels_f32 eft_windows_f32 eft_calibrations_f32
    eft_configure_f32 eft_check_f32 eft_integrity_f32 eft_state_integrity_f32 eft_reset_f32 eft_input_init_f32 eft_prime_f32 eft_step_f32 eft_hold_f32
    eft_missed_f32 eft_publish_f32 eft_calibration_in_use_f32 eft_request_trip_f32 eft_request_end_f32
    eft_is_down_f32 eft_take_over_f32 eft_offer_channel_f32 eft_take_channel_f32 eft_offer_window_f32 eft_take_window_f32
    eft_offer_calibration_f32 eft_take_calibration_f32
);
precision!(
    double, f64, words: 280 400 16 56,
    eft_channel_f64 eft_state_f64 eft_window_f64 eft_calibration_f64 eft_input_f64 eft_output_f64
    eft_channels_f64 eft_windows_f64 eft_calibrations_f64
    eft_configure_f64 eft_check_f64 eft_integrity_f64 eft_state_integrity_f64 eft_reset_f64 eft_input_init_f64 eft_prime_f64 eft_step_f64 eft_hold_f64
    eft_missed_f64 eft_publish_f64 eft_calibration_in_use_f64 eft_request_trip_f64 eft_request_end_f64
    eft_is_down_f64 eft_take_over_f64 eft_offer_channel_f64 eft_take_channel_f64 eft_offer_window_f64 eft_take_window_f64
    eft_offer_calibration_f64 eft_take_calibration_f64
);
