//! The C functions, called as C would.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp)]

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use eft_ffi::*;

type Config = eft_controller_f32;
type State = eft_state_f32;
type Input = eft_input_f32;
type Output = eft_output_f32;
type Shadow = eft_shadow_f32;

fn parameters() -> eft_parameters {
    let mut openings = [0.0; EFT_TABLE_CAPACITY];
    let mut flows = [0.0; EFT_TABLE_CAPACITY];
    for (n, (x, q)) in openings.iter_mut().zip(&mut flows).enumerate() {
        *x = (n as f64 - 10.0) / 10.0;
        *q = 0.01 * *x * (1.5 - 0.5 * x.abs());
    }
    eft_parameters {
        table_length: 21,
        mode: 2,
        sign_from: 0,
        reserved: 0,
        level: 1.0,
        piston_area: 8.212e-3,
        supply_pressure: 1.9e7,
        flow_gain: 1.64e-2,
        valve_gain: 0.1,
        response_delay: 5.0e-3,
        lead_alpha: 0.1,
        sample_rate: 4096.0,
        force_sensitivity: 5.6e-5,
        proportional_gain: 0.8059,
        derivative_gain: 2.0e-4,
        valve_command: 10.0,
        valve_command_rate: f64::MAX,
        spool_warning: 0.6,
        velocity_range: 3.0,
        force_range: 2.0e5,
        spool_range: 1.2,
        openings,
        flows,
    }
}

fn configured(p: &eft_parameters) -> Config {
    let mut config = MaybeUninit::uninit();
    // Safety: all pointers are valid.
    unsafe {
        assert_eq!(eft_configure_f32(p, config.as_mut_ptr(), null_mut()), EFT_OK);
        config.assume_init()
    }
}

const GOOD: Input = Input { command: 1000.0, velocity: 0.2, force: 900.0, spool: 0.2, further_flow: 0.0 };
const EMPTY: Output = Output { valve_command: 0.0, compensation: 0.0, status: 0 };

fn rest() -> State {
    let mut state = MaybeUninit::uninit();
    // Safety: the pointer is valid.
    unsafe {
        assert_eq!(eft_reset_f32(state.as_mut_ptr()), EFT_OK);
        state.assume_init()
    }
}

#[test]
fn steps_hold_prime_and_recover() {
    let config = configured(&parameters());
    let (mut state, mut out) = (rest(), EMPTY);
    // Safety: all pointers are valid.
    unsafe {
        assert_eq!(eft_prime_f32(&config, &mut state, &GOOD), EFT_OK);
        assert_eq!(eft_step_f32(&config, &mut state, &GOOD, &mut out), EFT_OK);
        let (first, bits) = (out.valve_command, out.status);
        assert!(first > 0.0 && bits == 0);
        eft_step_f32(&config, &mut state, &GOOD, &mut out);
        assert_eq!(out.valve_command.to_bits(), first.to_bits());
        let bad = Input { force: f32::NAN, ..GOOD };
        eft_step_f32(&config, &mut state, &bad, &mut out);
        assert_eq!((out.valve_command.to_bits(), out.status), (first.to_bits(), 1 << 5));
        eft_missed_f32(&config, &state, &mut out);
        assert_eq!((out.valve_command.to_bits(), out.status), (first.to_bits(), 1 << 7 | 1 << 11));
        eft_step_f32(&config, &mut state, &GOOD, &mut out);
        assert_eq!((out.valve_command.to_bits(), out.status), (first.to_bits(), 0));
        let compensation = out.compensation;
        eft_compensation_step_f32(&config, &mut state, &GOOD, &mut out);
        assert_eq!(out.valve_command.to_bits(), compensation.to_bits());
    }
}

#[test]
fn null_pointers_give_a_status() {
    let (config, mut state, mut out) = (configured(&parameters()), rest(), EMPTY);
    // Safety: every pointer is null or valid.
    unsafe {
        let null_pointer = [
            eft_configure_f32(null(), null_mut(), null_mut()),
            eft_configure_f32(&parameters(), null_mut(), null_mut()),
            eft_reset_f32(null_mut()),
            eft_check_f32(null(), &parameters()),
            eft_check_f32(&config, null()),
            eft_prime_f32(null(), &mut state, &GOOD),
            eft_prime_f32(&config, &mut state, null()),
            eft_step_f32(null(), &mut state, &GOOD, &mut out),
            eft_step_f32(&config, null_mut(), &GOOD, &mut out),
            eft_step_f32(&config, &mut state, null(), &mut out),
            eft_step_f32(&config, &mut state, &GOOD, null_mut()),
            eft_compensation_step_f32(&config, &mut state, &GOOD, null_mut()),
            eft_hold_f32(&config, null(), &mut out),
            eft_missed_f32(&config, &state, null_mut()),
            eft_shadow_init_f32(null_mut(), &config),
            eft_shadow_offer_f32(null_mut(), &config),
        ];
        assert!(null_pointer.iter().all(|&code| code == EFT_NULL_POINTER), "{null_pointer:?}");
        assert!(eft_shadow_take_f32(null()).is_null());
    }
}

#[test]
fn refusals_say_what_was_wrong() {
    let mut p = parameters();
    p.flows[3] = p.flows[2];
    let mut why = MaybeUninit::<eft_error>::zeroed();
    let mut config = MaybeUninit::<Config>::zeroed();
    // Safety: all pointers are valid; an error of zero bytes is one.
    let why = unsafe {
        assert_eq!(eft_configure_f32(&p, config.as_mut_ptr(), why.as_mut_ptr()), EFT_NOT_INCREASING);
        why.assume_init()
    };
    let name = why.parameter.map(|c| c as u8);
    assert_eq!((why.index, &name[..6]), (3, &b"flows\0"[..]));
    for (p, code) in [
        (eft_parameters { mode: 3, ..parameters() }, EFT_OUT_OF_RANGE),
        (eft_parameters { reserved: 1, ..parameters() }, EFT_OUT_OF_RANGE),
        (eft_parameters { table_length: 22, ..parameters() }, EFT_LENGTH),
        (eft_parameters { piston_area: 0.0, ..parameters() }, EFT_NOT_POSITIVE),
        (eft_parameters { sample_rate: f64::NAN, ..parameters() }, EFT_NOT_FINITE),
    ] {
        // Safety: all pointers are valid or null.
        assert_eq!(unsafe { eft_configure_f32(&p, config.as_mut_ptr(), null_mut()) }, code);
    }
}

#[test]
fn a_configuration_is_checked_against_its_parameters() {
    let p = parameters();
    let mut config = configured(&p);
    // Safety: all pointers are valid; a configuration of zero bytes is none, but one may be there.
    unsafe {
        assert_eq!(eft_check_f32(&config, &p), EFT_OK);
        assert_eq!(eft_check_f32(&config, &eft_parameters { level: 0.9, ..p }), EFT_CORRUPT);
        assert_eq!(eft_check_f32(&config, &eft_parameters { level: -1.0, ..p }), EFT_OUT_OF_RANGE);
        // One bit of one number.
        let word = (&raw mut config).cast::<u32>().add(5);
        *word ^= 1;
        assert_eq!(eft_check_f32(&config, &p), EFT_CORRUPT);
        assert_eq!(eft_check_f32(MaybeUninit::zeroed().as_ptr(), &p), EFT_CORRUPT);
    }
}

#[test]
fn offered_configuration_is_taken_over_at_the_next_tick() {
    let first = configured(&parameters());
    let second = configured(&eft_parameters { level: 0.5, ..parameters() });
    let mut shadow = MaybeUninit::<Shadow>::zeroed();
    let command = |config: *const Config| {
        let (mut state, mut out) = (rest(), EMPTY);
        // Safety: all pointers are valid.
        unsafe { eft_step_f32(config, &mut state, &GOOD, &mut out) };
        out.valve_command.to_bits()
    };
    // Safety: all pointers are valid; a shadow of zero bytes is one.
    unsafe {
        let shadow = shadow.assume_init_mut();
        assert_eq!(eft_shadow_init_f32(shadow, &first), EFT_OK);
        assert_eq!(command(eft_shadow_take_f32(shadow)), command(&first));
        assert_eq!(eft_shadow_offer_f32(shadow, &second), EFT_OK);
        assert_eq!(eft_shadow_offer_f32(shadow, &first), EFT_BUSY);
        assert_eq!(command(eft_shadow_take_f32(shadow)), command(&second));
        assert_eq!(eft_shadow_offer_f32(shadow, &first), EFT_OK);
        assert_eq!(command(eft_shadow_take_f32(shadow)), command(&first));
    }
}
