//! What is measured of the C interface.

use core::mem::MaybeUninit;
use core::ptr::null_mut;

use eft_ffi::*;
use eft_rigs::adaptive::{FLOWS, OPENINGS, PARAMETERS};
use eft_rigs::guarded::PER_MASS;

use crate::blocks::N;
use crate::c_adaptive;
use crate::probe::{probed, worst};

pub fn parameters() -> eft_parameters {
    eft_parameters {
        table_length: N as u32,
        mode: 2,
        sign_from: 0,
        reserved: 0,
        level: PARAMETERS.level,
        piston_area: PARAMETERS.piston_area,
        supply_pressure: PARAMETERS.supply_pressure,
        flow_gain: PARAMETERS.flow_gain,
        valve_gain: PARAMETERS.valve_gain,
        response_delay: PARAMETERS.response_delay,
        lead_alpha: PARAMETERS.lead_alpha,
        sample_rate: PARAMETERS.sample_rate,
        force_sensitivity: 5.6e-5,
        proportional_gain: PARAMETERS.proportional_gain,
        derivative_gain: 2.0e-4,
        valve_command: 10.0,
        valve_command_rate: 2.0e4,
        spool_warning: PARAMETERS.spool_warning,
        velocity_range: PARAMETERS.velocity_range,
        force_range: PARAMETERS.force_range,
        spool_range: PARAMETERS.spool_range,
        openings: OPENINGS,
        flows: FLOWS,
    }
}

/// Prints one line a function: name, instructions, bytes of stack.
pub fn run() {
    controllers();
    c_adaptive::run();
    around();
}

fn controllers() {
    type Step = unsafe extern "C" fn(
        *const eft_controller_f32,
        *mut eft_state_f32,
        *const eft_input_f32,
        *mut eft_output_f32,
    ) -> u8;
    let (mut config, mut state) =
        (MaybeUninit::<eft_controller_f32>::uninit(), MaybeUninit::<eft_state_f32>::uninit());
    let mut output = eft_output_f32 { valve_command: 0.0, compensation: 0.0, status: 0 };
    // Safety: every pointer is valid.
    let code = unsafe { eft_configure_f32(&parameters(), config.as_mut_ptr(), null_mut()) };
    assert!(code == 0, "refused");
    for (name, function) in [
        ("eft_compensation_step_f32", eft_compensation_step_f32 as Step),
        ("eft_step_f32", eft_step_f32 as Step),
    ] {
        // Safety: every pointer is valid.
        unsafe { eft_reset_f32(state.as_mut_ptr()) };
        let f = probed!(function, Step);
        worst(name, |r| {
            let input = eft_input_f32 {
                command: r.sample(1.0e4),
                velocity: r.sample(1.0),
                force: r.sample(1.5e5),
                spool: r.sample(1.0),
                further_flow: r.sample(1.0e-3),
            };
            // Safety: every pointer is valid.
            unsafe { f(config.as_ptr(), state.as_mut_ptr(), &input, &mut output) };
        });
    }
}

/// What stands around the controller.
fn around() {
    let observer = eft_observer_parameters {
        sample_rate: PARAMETERS.sample_rate,
        gain_on_displacement: 0.07,
        gain_on_velocity: 10.0,
        gain_on_drift: 736.0,
    };
    let derivative = eft_derivative_parameters { sample_rate: PARAMETERS.sample_rate, corner: 80.0 };
    let protection = eft_protection_parameters {
        sample_rate: PARAMETERS.sample_rate,
        force_warning: 4.0e4,
        force_trip: 6.0e4,
        displacement_warning: 0.1,
        displacement_trip: 0.12,
        velocity_warning: f64::MAX,
        velocity_trip: f64::MAX,
        spool_warning: 0.9,
        spool_trip: 0.95,
        start_time: 0.5,
        ramp_time: 0.3,
        shutdown_time: 0.1,
        lost_samples: 5.0,
        fault_time: 0.5,
    };
    let (mut observer_config, mut observed) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let (mut derivative_config, mut derived) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let stuck = eft_stuck_parameters { repeats: 3 };
    let (mut watch, mut watched) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let (mut config, mut state) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    // Safety: every pointer is valid.
    let codes = unsafe {
        [
            eft_stuck_configure_f32(&stuck, watch.as_mut_ptr(), null_mut()),
            eft_stuck_reset_f32(watched.as_mut_ptr()),
            eft_observer_configure_f32(&observer, observer_config.as_mut_ptr(), null_mut()),
            eft_observer_reset_f32(observer_config.as_ptr(), observed.as_mut_ptr(), 0.0, 0.0),
            eft_derivative_configure_f32(&derivative, derivative_config.as_mut_ptr(), null_mut()),
            eft_derivative_reset_f32(derivative_config.as_ptr(), derived.as_mut_ptr(), 0.0),
            eft_protection_configure_f32(&protection, config.as_mut_ptr(), null_mut()),
            eft_protection_reset_f32(state.as_mut_ptr()),
        ]
    };
    assert!(codes == [0; 8], "refused");
    let mut velocity = 0.0;

    type Derivative =
        unsafe extern "C" fn(*const eft_derivative_f32, *mut eft_derivative_state_f32, f32, *mut f32) -> u8;
    let f = probed!(eft_derivative_step_f32 as Derivative, Derivative);
    worst("eft_derivative_step_f32", |r| {
        // Safety: every pointer is valid.
        unsafe { f(derivative_config.as_ptr(), derived.as_mut_ptr(), r.sample(0.1), &mut velocity) };
    });
    type Observer =
        unsafe extern "C" fn(*const eft_observer_f32, *mut eft_observer_state_f32, f32, f32, *mut f32) -> u8;
    let f = probed!(eft_observer_step_f32 as Observer, Observer);
    worst("eft_observer_step_f32", |r| {
        let (displacement, acceleration) = (r.sample(0.1), PER_MASS * r.sample(1.5e5));
        let config = observer_config.as_ptr();
        // Safety: every pointer is valid.
        unsafe { f(config, observed.as_mut_ptr(), displacement, acceleration, &mut velocity) };
    });

    type Stuck =
        unsafe extern "C" fn(*const eft_stuck_f32, *mut eft_stuck_state_f32, f32, f32, f32, *mut u32) -> u8;
    let mut status = 0;
    let f = probed!(eft_stuck_step_f32 as Stuck, Stuck);
    worst("eft_stuck_step_f32", |r| {
        let (config, state) = (watch.as_ptr(), watched.as_mut_ptr());
        // Safety: every pointer is valid.
        unsafe { f(config, state, r.sample(1.0), r.sample(1.5e5), r.sample(1.0), &mut status) };
    });

    type Step = unsafe extern "C" fn(
        *const eft_protection_f32,
        *mut eft_protection_state_f32,
        *const eft_protection_input_f32,
        *mut eft_permitted_f32,
    ) -> u8;
    let mut permitted = eft_permitted_f32 { command: 0.0, authority: 1.0, status: 0 };
    let mut tick = 0_u32;
    let f = probed!(eft_protection_step_f32 as Step, Step);
    worst("eft_protection_step_f32", |r| {
        tick += 1;
        let input = eft_protection_input_f32 {
            command: r.sample(1.0e4),
            force: r.sample(3.0e4),
            displacement: r.sample(0.08),
            velocity: r.sample(1.0),
            spool: r.sample(0.8),
        };
        // Safety: every pointer is valid. A trip is for good: now and then from the start again.
        unsafe {
            if tick % 64 == 0 {
                eft_protection_reset_f32(state.as_mut_ptr());
            }
            f(config.as_ptr(), state.as_mut_ptr(), &input, &mut permitted)
        };
    });
    type Apply = unsafe extern "C" fn(
        *const eft_protection_f32,
        *mut eft_protection_state_f32,
        *const eft_permitted_f32,
        *mut eft_output_f32,
    ) -> u8;
    let f = probed!(eft_protection_apply_f32 as Apply, Apply);
    worst("eft_protection_apply_f32", |r| {
        tick += 1;
        let fault = if tick & 0x1000 == 0 { 0 } else { EFT_STUCK_MEASUREMENT };
        let mut output = eft_output_f32 { valve_command: r.sample(10.0), compensation: 0.0, status: fault };
        // Safety: every pointer is valid.
        unsafe {
            if tick % 4096 == 0 {
                eft_protection_reset_f32(state.as_mut_ptr());
            }
            f(config.as_ptr(), state.as_mut_ptr(), &permitted, &mut output)
        };
    });
}
