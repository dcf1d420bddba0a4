#![no_main]
//! The functions of the C interface in any order, with parameters and samples of any bits.

use std::ptr::null_mut;

use eft_ffi::*;
use rig::{RIGS, for_c, zeroed};

#[allow(dead_code, reason = "what the interface's tests need besides")]
#[path = "../../crates/eft-ffi/tests/interface/rig.rs"]
mod rig;

/// The input, read from its front, with zeros after its end.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (mut taken, length) = ([0; N], N.min(self.0.len()));
        let (first, rest) = self.0.split_at(length);
        taken[..length].copy_from_slice(first);
        self.0 = rest;
        taken
    }

    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    /// A number of the size of a measurement, or random bits.
    fn number(&mut self, scale: f32) -> f32 {
        let bits = f32::from_bits(u32::from_le_bytes(self.take()));
        if self.byte() % 4 == 0 { bits } else { scale * (bits.to_bits() as i32 as f32 / 2_147_483_648.0) }
    }
}

/// A rig with random bits in some of its numbers. Every field is a number, so all bits are valid.
fn parameters(bytes: &mut Bytes) -> eft_parameters {
    let mut parameters = for_c(&RIGS[usize::from(bytes.byte()) % RIGS.len()]);
    for _ in 0..bytes.byte() % 4 {
        let place = usize::from(u16::from_le_bytes(bytes.take())) % (size_of::<eft_parameters>() / 4);
        let changed: [u8; 4] = bytes.take();
        // Safety: within the struct.
        unsafe { *(&raw mut parameters).cast::<[u8; 4]>().add(place) = changed };
    }
    parameters
}

fn input(bytes: &mut Bytes) -> eft_input<f32> {
    eft_input {
        command: bytes.number(1e4),
        velocity: bytes.number(1.0),
        force: bytes.number(2e4),
        spool: bytes.number(1.0),
        displacement: bytes.number(0.1),
        acceleration: bytes.number(20.0),
        supply_pressure: bytes.number(2.5e7),
        next_command: bytes.number(1e4),
        valve_command: bytes.number(10.0),
        alive: bytes.number(1e6),
        period: bytes.number(1e-3),
        load_pressure: bytes.number(2e7),
    }
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let bytes = &mut Bytes(bytes);
    let mut parameters = parameters(bytes);
    let (mut channel, mut state, mut learner, mut learned) = (zeroed(), zeroed(), zeroed(), zeroed());
    let (mut output, mut calibration, mut why) = (zeroed::<eft_output<f32>>(), zeroed(), zeroed());
    let (mut channels, mut windows, mut calibrations) = (zeroed(), zeroed(), zeroed());
    // The largest limit of the channels so far, because a state continues under the next one.
    let mut limit = 0.0_f64;
    while !bytes.0.is_empty() {
        let mut word = 0;
        // Safety: every pointer is null or valid, and zero bytes are no channel, state or learner.
        let code = unsafe {
            match bytes.byte() % 24 {
                0 => {
                    let code = eft_configure_f32(&parameters, &mut *channel, &mut *why);
                    let digital = parameters.realization == EFT_REALIZATION_DIGITAL;
                    let most = if digital { parameters.valve_command } else { f64::MAX };
                    limit = if code == EFT_OK { limit.max(most) } else { limit };
                    let end = why.parameter.iter().position(|c| *c == 0);
                    assert!(end.is_some(), "a name without an end");
                    code
                }
                1 => eft_reset_f32(&*channel, &mut *state),
                2 => eft_learner_configure_f32(&parameters, &mut *learner, null_mut()),
                3 => eft_learner_reset_f32(&*learner, &mut *learned),
                4 => eft_prime_f32(&*channel, &mut *state, &input(bytes)),
                5 => eft_hold_f32(&*channel, &*state, &mut *output),
                6 => eft_missed_f32(&*channel, &*state, &mut *output),
                7 => eft_learn_f32(&*learner, &mut *learned, &output.window, &mut *calibration),
                8 => eft_publish_f32(&*channel, &mut *state, &*calibration),
                9 => eft_calibration_in_use_f32(&*state, &mut *calibration),
                10 => eft_request_trip_f32(&raw mut *state),
                11 => eft_request_end_f32(&raw mut *state),
                12 => eft_offer_channel_f32(&raw mut *channels, &*channel),
                13 => {
                    let taken = eft_take_channel_f32(&raw mut *channels);
                    if taken.is_null() { EFT_OK } else { eft_take_over_f32(taken, &mut *state) }
                }
                14 => eft_offer_window_f32(&raw mut *windows, &output.window),
                15 => {
                    let taken = eft_take_window_f32(&raw mut *windows);
                    eft_learn_f32(&*learner, &mut *learned, taken, &mut *calibration)
                }
                16 => eft_offer_calibration_f32(&raw mut *calibrations, &*calibration),
                17 => {
                    eft_publish_f32(&*channel, &mut *state, eft_take_calibration_f32(&raw mut *calibrations))
                }
                18 => {
                    eft_integrity_f32(&*channel, &mut word).max(eft_state_integrity_f32(&*state, &mut word))
                }
                19 => {
                    let mut flow = 0.0;
                    eft_found_flow_f32(&*learner, &*calibration, bytes.number(1.0), &mut flow)
                }
                20 => eft_check_f32(&*channel, &parameters),
                21 => {
                    parameters = self::parameters(bytes);
                    EFT_OK
                }
                _ => {
                    // More equal samples than a window has.
                    let (input, mut code) = (input(bytes), EFT_OK);
                    for _ in 0..=bytes.byte() {
                        code = eft_step_f32(&*channel, &mut *state, &input, &mut *output);
                    }
                    let out = &*output;
                    assert!(
                        out.voltage.is_finite() && f64::from(out.voltage.abs()) <= 1.000_001 * limit,
                        "{}",
                        out.voltage
                    );
                    assert!((0.0..=1.0).contains(&out.authority) || code != EFT_OK, "{}", out.authority);
                    assert!(code == EFT_OK || out.voltage == 0.0);
                    code
                }
            }
        };
        assert!(code <= EFT_NOT_MADE, "{code}");
    }
});
