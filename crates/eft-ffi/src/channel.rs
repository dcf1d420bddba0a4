//! The tick of one actuator: configuration, state, step, and requests.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU8, Ordering};

use eft_core::{Calibration, Channel, ChannelState, Input, Output, Real, Window, status};

use crate::codes::{EFT_NO_STEP, EFT_NULL_POINTER};
use crate::macros::{data, functions, opaque};
use crate::opaque::{give, given, made, make};
use crate::parameters::{EFT_TABLE_CAPACITY, check, configure, eft_error, eft_parameters};

/// A channel's state and the requests from other contexts. A trip and an end are final, so a request is never
/// withdrawn. Loads and stores therefore lose none, without an atomic exchange.
pub struct Running<S> {
    /// Set after either of the others, so that a tick reads one byte.
    requested: AtomicU8,
    trip: AtomicU8,
    end: AtomicU8,
    state: UnsafeCell<S>,
}

impl<S> Running<S> {
    fn new(state: S) -> Self {
        let none = || AtomicU8::new(0);
        Self { requested: none(), trip: none(), end: none(), state: UnsafeCell::new(state) }
    }

    fn request(&self, what: &AtomicU8) -> Result<(), u8> {
        what.store(1, Ordering::Relaxed);
        self.requested.store(1, Ordering::Relaxed);
        Ok(())
    }
}

opaque! {
    /// A channel's configuration. One drives any number of actuators.
    eft_channel[337], 0x5c, Channel<T, EFT_TABLE_CAPACITY>;
    /// The state of a channel. Each actuator has one.
    eft_state[431], 0xa5, Running<ChannelState<T>>;
    /// The sums of a closed window, for the learner.
    eft_window[14], 0x3a, Window<T>;
    /// The learner's result for the tick.
    eft_calibration[54], 0xc3, Calibration<T>;
}

/// A tick's input has the same struct in C as in the core. The header takes its comments from there.
pub use eft_core::Input as eft_input;

data! {
    /// One tick's result.
    eft_output<T: Copy> {
        voltage: T, "V; to the converter: valve command, or compensation signal for an analog loop";
        compensation: T, "V; the compensation signal";
        velocity: T, "m/s; measured or estimated, not finite if a measurement for it is not";
        permitted_command: T, "N; an analog controller may follow it; without a protection the given command";
        authority: T, "1; the protection's factor, which an analog controller must apply";
        status: u32, "the flags and the cause above";
        window_closed: u32, "1 if a window has closed with this tick, else 0";
        window: eft_window<T>, "for eft_learn, if window_closed is 1";
    }
}

/// Writes a tick's result, with the window if one has closed.
// By reference: in an enum with an error code the result would be copied byte by byte.
#[inline(always)]
fn write<T: Real>(output: &mut eft_output<T>, out: &Output<T>) {
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

/// Passes on the code of a tick. The result of a refused tick is 0 V.
#[inline(always)]
unsafe fn answer<T: Real>(output: *mut eft_output<T>, code: Result<(), u8>) -> Result<(), u8> {
    if code.is_err() && !output.is_null() {
        // Safety: valid, and zeros are valid in every field.
        unsafe {
            output.write_bytes(0, 1);
            (*output).status = EFT_NO_STEP;
        }
    }
    code
}

/// A tick of a running channel.
#[inline(always)]
unsafe fn step<T: Real>(
    channel: *const eft_channel<T>,
    state: *const eft_state<T>,
    input: *const Input<T>,
    output: *mut eft_output<T>,
) -> Result<(), u8> {
    // Safety: null or valid; one context alone calls the functions that change the state.
    unsafe {
        let output = output.as_mut().ok_or(EFT_NULL_POINTER)?;
        let (core, running, input) = (made(channel)?, made(state)?, given(input)?);
        let state = &mut *running.state.get();
        if running.requested.load(Ordering::Relaxed) != 0 {
            if running.trip.load(Ordering::Relaxed) != 0 {
                state.trip();
            }
            if running.end.load(Ordering::Relaxed) != 0 {
                state.end();
            }
        }
        write(output, &core.step(state, input));
        Ok(())
    }
}

/// In place of a tick, with further flags.
unsafe fn hold<T: Real>(
    channel: *const eft_channel<T>,
    state: *const eft_state<T>,
    output: *mut eft_output<T>,
    flags: u32,
) -> Result<(), u8> {
    // Safety: null or valid.
    unsafe {
        let output = output.as_mut().ok_or(EFT_NULL_POINTER)?;
        let out = made(channel)?.hold(&*made(state)?.state.get());
        write(output, &Output { status: out.status | flags, ..out });
        Ok(())
    }
}

functions! {
    /// Checks the parameters and makes a configuration from them. After a refusal every function refuses *channel, and
    /// *why (may be null) has the reason.
    fn eft_configure_f32 eft_configure_f64(parameters: *const eft_parameters, channel: *mut eft_channel<T>, why: *mut eft_error) {
        configure(parameters, channel, why)
    }

    /// Makes a configuration again and compares it with *channel. Returns EFT_CORRUPT if any number differs, for
    /// example after a memory fault.
    fn eft_check_f32 eft_check_f64(channel: *const eft_channel<T>, parameters: *const eft_parameters) {
        check(channel, parameters)
    }

    /// Sets *word to a checksum of a configuration. Keep the first checksum and compare it each second. A difference
    /// means that memory has changed.
    fn eft_integrity_f32 eft_integrity_f64(channel: *const eft_channel<T>, word: *mut u32) {
        give(word, made(channel)?.integrity())
    }

    /// Sets *word to a checksum of a state. Compare the checksum after a tick with that before the next tick.
    fn eft_state_integrity_f32 eft_state_integrity_f64(state: *const eft_state<T>, word: *mut u32) {
        give(word, (*made(state)?.state.get()).integrity())
    }

    /// Makes the state of a rig at rest, with the nominal calibration and without trip or request. An estimated
    /// velocity starts at zero from the first displacement.
    fn eft_reset_f32 eft_reset_f64(channel: *const eft_channel<T>, state: *mut eft_state<T>) {
        make(state, Running::new(made(channel)?.at_rest()))
    }

    /// Like eft_reset, with the valve at the null of a calibration from eft_first_calibration, which is in use from the
    /// first tick.
    fn eft_reset_with_f32 eft_reset_with_f64(channel: *const eft_channel<T>, calibration: *const eft_calibration<T>, state: *mut eft_state<T>) {
        make(state, Running::new(made(channel)?.at_rest_with(made(calibration)?)))
    }

    /// Sets every field to NaN, for signals that the rig does not have.
    fn eft_input_init_f32 eft_input_init_f64(input: *mut Input<T>) {
        give(input, Input::default())
    }

    /// Sets the state to that of a rig that has long been at this operating point, so that the valve command does not
    /// jump. The calibration in use and the state of the protection do not change. An invalid input gives a rig at
    /// rest.
    fn eft_prime_f32 eft_prime_f64(channel: *const eft_channel<T>, state: *mut eft_state<T>, input: *const Input<T>) {
        let state = &mut *made(state)?.state.get();
        made(channel)?.prime(state, given(input)?);
        Ok(())
    }

    /// One tick, in the interrupt. A null pointer, or a channel or state that was never made, is refused: the output is
    /// then 0 V with EFT_NO_STEP. A measurement or command that is NaN, infinite or out of its range repeats the last
    /// output and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND. The first good tick continues. After a trip the
    /// plausibility watch replaces a lost measurement by its last one, without this flag. The last valid supply pressure
    /// replaces an invalid one and raises EFT_STUCK_MEASUREMENT. The last valid next_command replaces an invalid one
    /// and raises EFT_INVALID_COMMAND, if the rig looks ahead.
    fn eft_step_f32 eft_step_f64(channel: *const eft_channel<T>, state: *mut eft_state<T>, input: *const Input<T>, output: *mut eft_output<T>) = {
        answer(output, step(channel, state, input, output))
    }

    /// In place of a tick: repeats the last output and raises EFT_HELD. The state does not change. For several ticks
    /// call eft_step with a measurement of NaN instead, so that nothing is learned from the gap. velocity and
    /// permitted_command are NaN: an analog controller keeps its last command. Refused like eft_step.
    fn eft_hold_f32 eft_hold_f64(channel: *const eft_channel<T>, state: *const eft_state<T>, output: *mut eft_output<T>) {
        answer(output, hold(channel, state, output, 0))
    }

    /// Like eft_hold, for a missed tick. It raises EFT_MISSED_TICK as well.
    fn eft_missed_f32 eft_missed_f64(channel: *const eft_channel<T>, state: *const eft_state<T>, output: *mut eft_output<T>) {
        answer(output, hold(channel, state, output, status::MISSED_TICK))
    }

    /// Gives a calibration to the tick. The calibration from window k takes effect with the first tick of window k + 2.
    /// A later one takes effect with the next window, and until then each tick raises EFT_CALIBRATION_LATE. One from a
    /// window that has not begun is of another test, and has no effect.
    fn eft_publish_f32 eft_publish_f64(channel: *const eft_channel<T>, state: *mut eft_state<T>, calibration: *const eft_calibration<T>) {
        let state = &mut *made(state)?.state.get();
        made(channel)?.publish(state, made(calibration)?);
        Ok(())
    }

    /// Copies the calibration in use.
    fn eft_calibration_in_use_f32 eft_calibration_in_use_f64(state: *const eft_state<T>, calibration: *mut eft_calibration<T>) {
        make(calibration, *(*made(state)?.state.get()).calibration())
    }

    /// Requests a trip, for an emergency stop or another actuator of the specimen. The next step trips at the last
    /// command. No effect if the rig's protection is off.
    fn eft_request_trip_f32 eft_request_trip_f64(state: *mut eft_state<T>) {
        let running = made(state)?;
        running.request(&running.trip)
    }

    /// Requests the soft end. From the next step on, the force follows a command that fades along the ramp. No effect
    /// if the rig's protection is off.
    fn eft_request_end_f32 eft_request_end_f64(state: *mut eft_state<T>) {
        let running = made(state)?;
        running.request(&running.end)
    }

    /// Sets *down to 1 if the protection's ramp has reached zero or the test has not begun, else to 0.
    fn eft_is_down_f32 eft_is_down_f64(state: *const eft_state<T>, down: *mut u8) {
        give(down, u8::from((*made(state)?.state.get()).is_down()))
    }

    /// Continues a state under a new configuration of the same sample rate, without a jump unless the last valve
    /// command is beyond the new limit. Another level, mode or flow table is a step of the compensation, which the lead
    /// network enlarges up to 1/lead_alpha times, so change these at rest. Call it after eft_take_channel for each
    /// state. An estimate of the velocity from another source starts at rest from the next displacement, so change the
    /// source at rest. Only an observer keeps its drift from the one before it, with or without an accelerometer. The
    /// calibration stays in use until the new learner publishes, unless the new configuration learns nothing. It keeps
    /// 1/(G_p*K_s) of its own configuration, so change these gains at rest or while nothing is learned. A trip stays in
    /// the state, but a configuration without a protection follows the command again.
    fn eft_take_over_f32 eft_take_over_f64(channel: *const eft_channel<T>, state: *mut eft_state<T>) {
        made(channel)?.take_over(&mut *made(state)?.state.get());
        Ok(())
    }
}
