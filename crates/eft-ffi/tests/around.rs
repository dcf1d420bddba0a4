//! What stands around the controller in C, called as C would: the core's own bits in the order of the simulator's tick,
//! and null pointers refused.
#![allow(clippy::unwrap_used)]

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use eft_core::{
    ControllerOutput, FilteredDerivative, Levels, Protection, ProtectionParameters, ProtectionState,
    StuckWatch, StuckWatchState, VelocityObserver, status,
};
use eft_ffi::*;

const GAINS: [f64; 3] = [0.05, 5.0, 50.0];
const OBSERVER: eft_observer_parameters = eft_observer_parameters {
    sample_rate: 4096.0,
    gain_on_displacement: GAINS[0],
    gain_on_velocity: GAINS[1],
    gain_on_drift: GAINS[2],
};
const DERIVATIVE: eft_derivative_parameters = eft_derivative_parameters { sample_rate: 4096.0, corner: 80.0 };
const PROTECTION: eft_protection_parameters = eft_protection_parameters {
    sample_rate: 4096.0,
    force_warning: 8.0e3,
    force_trip: 1.2e4,
    displacement_warning: 0.05,
    displacement_trip: 0.1,
    velocity_warning: f64::MAX,
    velocity_trip: f64::MAX,
    spool_warning: 0.6,
    spool_trip: 0.8,
    start_time: 0.01,
    ramp_time: 0.02,
    shutdown_time: 0.01,
    lost_samples: 3.0,
    fault_time: 0.005,
};

fn protection() -> Protection<f32> {
    Protection::<f32>::new(&ProtectionParameters {
        force: Levels { warning: 8.0e3, trip: 1.2e4 },
        displacement: Levels { warning: 0.05, trip: 0.1 },
        velocity: Levels::NONE,
        spool: Levels { warning: 0.6, trip: 0.8 },
        start_time: 0.01,
        ramp_time: 0.02,
        shutdown_time: 0.01,
        lost_samples: 3.0,
        fault_time: 0.005,
        sample_rate: 4096.0,
    })
    .unwrap()
}

/// Bit for bit; the bits of a NaN are nobody's business.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Configures and checks by a block's functions.
macro_rules! configured {
    ($parameters:expr, $configure:ident, $check:ident) => {{
        let mut config = MaybeUninit::uninit();
        assert_eq!($configure($parameters, config.as_mut_ptr(), null_mut()), EFT_OK);
        assert_eq!($check(config.as_ptr(), $parameters), EFT_OK);
        config.assume_init()
    }};
}

#[test]
fn velocities_are_the_cores() {
    let observer = VelocityObserver::<f32>::new(GAINS, 4096.0).unwrap();
    let derivative = FilteredDerivative::<f32>::new(80.0, 4096.0).unwrap();
    let (mut observed, mut derived) = (observer.at_rest(0.01, 2.0), derivative.at_rest(0.01));
    let (mut state, mut velocity) = (MaybeUninit::uninit(), 0.0_f32);
    let mut derivative_state = MaybeUninit::uninit();
    // Safety: every pointer is valid.
    unsafe {
        let config = configured!(&OBSERVER, eft_observer_configure_f32, eft_observer_check_f32);
        assert_eq!(eft_observer_reset_f32(&config, state.as_mut_ptr(), 0.01, 2.0), EFT_OK);
        let by_difference = configured!(&DERIVATIVE, eft_derivative_configure_f32, eft_derivative_check_f32);
        assert_eq!(eft_derivative_reset_f32(&by_difference, derivative_state.as_mut_ptr(), 0.01), EFT_OK);
        for n in 0..300_u16 {
            let swing = (0.02 * f32::from(n)).sin();
            let displacement = if n == 90 { f32::NAN } else { 0.01 + 0.03 * swing };
            let acceleration = if n == 200 { f32::INFINITY } else { 2.0 - 3.0 * swing };
            let code =
                eft_observer_step_f32(&config, state.as_mut_ptr(), displacement, acceleration, &mut velocity);
            let expected = observer.step(&mut observed, displacement, acceleration);
            assert!(code == EFT_OK && same(velocity, expected), "{n}: {velocity} {expected}");
            assert_eq!(velocity.is_nan(), n == 90 || n == 200);
            let state = derivative_state.as_mut_ptr();
            let code = eft_derivative_step_f32(&by_difference, state, displacement, &mut velocity);
            let expected = derivative.step(&mut derived, displacement);
            assert!(code == EFT_OK && same(velocity, expected), "{n}: {velocity} {expected}");
            assert_eq!(velocity.is_nan(), n == 90);
        }
        assert!(velocity.abs() > 0.1);
        // Of zero bytes: at rest at zero.
        let mut fresh = MaybeUninit::<eft_observer_state_f32>::zeroed();
        eft_observer_step_f32(&config, fresh.as_mut_ptr(), 0.0, 0.0, &mut velocity);
        assert_eq!(velocity.to_bits(), 0);
    }
}

#[test]
fn what_may_pass_is_the_cores() {
    let core = protection();
    let mut expected_state = ProtectionState::default();
    let (mut state, mut permitted) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let mut seen = 0;
    // Safety: every pointer is valid.
    unsafe {
        let config = configured!(&PROTECTION, eft_protection_configure_f32, eft_protection_check_f32);
        assert_eq!(eft_protection_reset_f32(state.as_mut_ptr()), EFT_OK);
        for n in 0..400_u16 {
            let swing = (0.1 * f32::from(n)).sin();
            let input = eft_protection_input_f32 {
                command: if n == 60 { f32::NAN } else { 7.0e3 * swing },
                // From 300 on the load cell is lost.
                force: if n < 300 { 8.1e3 * swing } else { f32::NAN },
                displacement: 0.04 * swing,
                velocity: 0.3 * swing,
                spool: 0.2 * swing,
            };
            assert_eq!(
                eft_protection_step_f32(&config, state.as_mut_ptr(), &input, permitted.as_mut_ptr()),
                EFT_OK
            );
            let allowed = core.step(
                &mut expected_state,
                input.command,
                input.force,
                input.displacement,
                input.velocity,
                input.spool,
            );
            let mut next = 0.0;
            assert_eq!(
                eft_protection_preview_f32(&config, state.as_ptr(), 0.9 * input.command, &mut next),
                EFT_OK
            );
            assert_eq!(next.to_bits(), core.preview(&expected_state, 0.9 * input.command).to_bits());
            // From 150 on the estimators distrust what they read.
            let flags = if n < 150 { 0 } else { status::ADAPTATION_FROZEN };
            let mut output = eft_output_f32 { valve_command: 5.0 * swing, compensation: 3.0, status: flags };
            let expected = core.apply(
                &mut expected_state,
                &allowed,
                ControllerOutput { valve_command: 5.0 * swing, compensation: 3.0, status: flags },
            );
            let code = eft_protection_apply_f32(&config, state.as_mut_ptr(), permitted.as_ptr(), &mut output);
            let p = permitted.assume_init();
            assert_eq!((code, p.command.to_bits()), (EFT_OK, allowed.command.to_bits()));
            assert_eq!(output.valve_command.to_bits(), expected.valve_command.to_bits());
            assert_eq!(output.compensation.to_bits(), expected.compensation.to_bits());
            assert_eq!(output.status, expected.status);
            seen |= output.status;
            // The fault has lasted for 5 ms and a sample.
            assert_eq!(output.status & EFT_TRIPPED != 0, n > 150 + 20, "{n}");
        }
        let all = EFT_PROTECTION_WARNING | EFT_TRIPPED | EFT_SHUT_DOWN | EFT_ADAPTATION_FROZEN;
        assert_eq!(seen, all | EFT_INVALID_COMMAND);
    }
}

#[test]
fn a_controller_that_keeps_refusing_is_shut_down() {
    let (mut state, mut permitted) = (MaybeUninit::zeroed(), MaybeUninit::uninit());
    let input =
        eft_protection_input_f32 { command: 4.0e3, force: 0.0, displacement: 0.0, velocity: 0.0, spool: 0.0 };
    // Safety: every pointer is valid; a state of zero bytes is one.
    unsafe {
        let config = configured!(&PROTECTION, eft_protection_configure_f32, eft_protection_check_f32);
        for n in 0..100 {
            eft_protection_step_f32(&config, state.as_mut_ptr(), &input, permitted.as_mut_ptr());
            let status = if n < 50 { 0 } else { EFT_INVALID_MEASUREMENT };
            let mut output = eft_output_f32 { valve_command: 5.0, compensation: 3.0, status };
            eft_protection_apply_f32(&config, state.as_mut_ptr(), permitted.as_ptr(), &mut output);
            // Three are waited for.
            assert_eq!(output.status & EFT_SHUT_DOWN != 0, n >= 54, "{n}");
            assert_eq!(output.valve_command < 5.0, n >= 54, "{n}");
            assert!(n < 95 || output.valve_command.abs() <= 0.0, "{n}");
        }
    }
}

#[test]
fn from_outside_it_trips_and_ends() {
    let (mut state, mut down) = (MaybeUninit::zeroed(), 2_u8);
    let mut permitted = MaybeUninit::uninit();
    let input =
        eft_protection_input_f64 { command: 4.0e3, force: 0.0, displacement: 0.0, velocity: 0.0, spool: 0.0 };
    // Safety: every pointer is valid; a state of zero bytes is one.
    unsafe {
        let config = configured!(&PROTECTION, eft_protection_configure_f64, eft_protection_check_f64);
        let mut run = |state: *mut eft_protection_state_f64, ticks| {
            for _ in 0..ticks {
                eft_protection_step_f64(&config, state, &input, permitted.as_mut_ptr());
            }
            permitted.assume_init()
        };
        for end in [false, true] {
            eft_protection_reset_f64(state.as_mut_ptr());
            assert!(run(state.as_mut_ptr(), 50).command >= 4.0e3);
            let code = if end {
                eft_protection_end_f64(state.as_mut_ptr())
            } else {
                eft_protection_trip_f64(state.as_mut_ptr())
            };
            assert_eq!(code, EFT_OK);
            assert_eq!(eft_protection_is_down_f64(state.as_ptr(), &mut down), EFT_OK);
            assert_eq!(down, 0);
            let last = run(state.as_mut_ptr(), 100);
            assert!(last.command <= 0.0);
            assert_eq!(last.status, if end { 0 } else { EFT_TRIPPED });
            assert_eq!(eft_protection_is_down_f64(state.as_ptr(), &mut down), EFT_OK);
            assert_eq!(down, 1);
        }
    }
}

#[test]
fn stuck_sensors_are_seen_as_the_core_sees_them() {
    let core = StuckWatch::<f32>::new(4).unwrap();
    let mut expected_state = StuckWatchState::default();
    let (mut state, mut flag) = (MaybeUninit::uninit(), 0_u32);
    // Safety: every pointer is valid.
    unsafe {
        let parameters = eft_stuck_parameters { repeats: 4 };
        let config = configured!(&parameters, eft_stuck_configure_f32, eft_stuck_check_f32);
        assert_eq!(eft_stuck_reset_f32(state.as_mut_ptr()), EFT_OK);
        for n in 0..40_u16 {
            let spool = if (10..20).contains(&n) { 0.1 } else { f32::from(n) };
            let (v, f) = (0.5 + f32::from(n), -f32::from(n));
            assert_eq!(eft_stuck_step_f32(&config, state.as_mut_ptr(), v, f, spool, &mut flag), EFT_OK);
            assert_eq!(flag, core.step(&mut expected_state, v, f, spool));
            assert_eq!(flag == EFT_STUCK_MEASUREMENT, (14..20).contains(&n), "{n}");
        }
    }
}

#[test]
fn what_is_wrong_is_refused() {
    // Safety: null is allowed.
    unsafe {
        let mut observer = MaybeUninit::<eft_observer_f32>::uninit();
        let wrong = eft_observer_parameters { gain_on_displacement: 1.5, ..OBSERVER };
        let mut why = MaybeUninit::<eft_error>::uninit();
        let code = eft_observer_configure_f32(&wrong, observer.as_mut_ptr(), why.as_mut_ptr());
        assert_eq!(code, EFT_OUT_OF_RANGE);
        let name = why.assume_init().parameter.map(|c| c as u8);
        assert_eq!(&name[..21], b"gain_on_displacement\0");
        let wrong = eft_derivative_parameters { corner: 0.0, ..DERIVATIVE };
        let mut derivative = MaybeUninit::<eft_derivative_f64>::uninit();
        let code = eft_derivative_configure_f64(&wrong, derivative.as_mut_ptr(), null_mut());
        assert_eq!(code, EFT_NOT_POSITIVE);
        let wrong = eft_protection_parameters { force_warning: 2.0e4, ..PROTECTION };
        let mut protection = MaybeUninit::<eft_protection_f32>::uninit();
        let code = eft_protection_configure_f32(&wrong, protection.as_mut_ptr(), null_mut());
        assert_eq!(code, EFT_OUT_OF_RANGE);
        let wrong = eft_protection_parameters { lost_samples: 0.5, ..PROTECTION };
        let code = eft_protection_configure_f32(&wrong, protection.as_mut_ptr(), why.as_mut_ptr());
        let why = why.assume_init();
        assert_eq!((code, why.value.to_bits()), (EFT_NOT_WHOLE, 0.5_f64.to_bits()));
        assert_eq!(&why.parameter.map(|c| c as u8)[..13], b"lost_samples\0");
        let config = configured!(&PROTECTION, eft_protection_configure_f32, eft_protection_check_f32);
        let other = eft_protection_parameters { ramp_time: 1.0, ..PROTECTION };
        assert_eq!(eft_protection_check_f32(&config, &other), EFT_CORRUPT);
        let null_pointer = [
            eft_derivative_configure_f32(null(), null_mut(), null_mut()),
            eft_derivative_check_f64(null(), null()),
            eft_derivative_reset_f32(null(), null_mut(), 0.0),
            eft_derivative_step_f32(null(), null_mut(), 0.0, null_mut()),
            eft_observer_configure_f32(&OBSERVER, null_mut(), null_mut()),
            eft_observer_check_f32(null(), &OBSERVER),
            eft_observer_reset_f64(null(), null_mut(), 0.0, 0.0),
            eft_observer_step_f64(null(), null_mut(), 0.0, 0.0, null_mut()),
            eft_protection_configure_f64(null(), null_mut(), null_mut()),
            eft_protection_check_f32(&config, null()),
            eft_protection_reset_f32(null_mut()),
            eft_protection_step_f32(&config, null_mut(), null(), null_mut()),
            eft_protection_apply_f32(&config, null_mut(), null(), null_mut()),
            eft_protection_preview_f32(&config, null(), 0.0, null_mut()),
            eft_protection_trip_f32(null_mut()),
            eft_protection_end_f32(null_mut()),
            eft_protection_is_down_f32(null(), null_mut()),
            eft_stuck_configure_f32(null(), null_mut(), null_mut()),
            eft_stuck_check_f32(null(), null()),
            eft_stuck_reset_f32(null_mut()),
            eft_stuck_step_f32(null(), null_mut(), 0.0, 0.0, 0.0, null_mut()),
        ];
        assert!(null_pointer.iter().all(|&code| code == EFT_NULL_POINTER), "{null_pointer:?}");
    }
}
