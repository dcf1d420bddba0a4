//! What is measured of the adaptive controller in C.

use core::mem::MaybeUninit;
use core::ptr::null_mut;

use eft_ffi::*;

use crate::blocks::SLOW_RATE;
use crate::c_subjects::parameters;
use crate::inputs::{Random, next, rig};
use crate::probe::{probed, worst};

type Step = unsafe extern "C" fn(
    *const eft_adaptive_f32,
    *mut eft_adaptive_state_f32,
    *const eft_adaptive_input_f32,
    *mut eft_output_f32,
) -> u8;
type Ahead = unsafe extern "C" fn(
    *const eft_adaptive_f32,
    *mut eft_adaptive_state_f32,
    *const eft_adaptive_input_f32,
    f32,
    *mut eft_output_f32,
) -> u8;

fn input(tick: &mut u32, r: &mut Random) -> eft_adaptive_input_f32 {
    let (command, m) = rig(tick, r);
    eft_adaptive_input_f32 {
        command,
        velocity: m.velocity,
        force: m.force,
        spool: m.spool,
        supply_pressure: m.supply_pressure,
        // As an analog controller has it, which opens the valve by a tenth a volt.
        valve_command: 10.0 * m.spool,
    }
}

/// Prints one line a function and setting: name, instructions, bytes of stack.
pub fn run() {
    let slow = eft_parameters { sample_rate: SLOW_RATE, ..parameters() };
    for (rate, rig) in [("", parameters()), (", 2048 Hz", slow)] {
        for (curve, part) in [("", 0), (", curve", EFT_CURVE)] {
            let parameters = eft_adaptive_parameters {
                rig,
                compressibility: 7.56e-13,
                leakage: 1.3e-11,
                velocity_delay: 0.0,
                computation_delay: 0,
                parts: EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD | part,
            };
            let mut config = MaybeUninit::uninit();
            // Safety: every pointer is valid.
            let code = unsafe { eft_adaptive_configure_f32(&parameters, config.as_mut_ptr(), null_mut()) };
            assert!(code == 0, "refused");
            let config = config.as_ptr();
            for (name, function) in [
                ("eft_adaptive_step_f32", eft_adaptive_step_f32 as Step),
                ("eft_adaptive_compensation_step_f32", eft_adaptive_compensation_step_f32 as Step),
            ] {
                let f = probed!(function, Step);
                measure(format_args!("{name}{curve}{rate}"), config, |state, input, _, output| {
                    // Safety: every pointer is valid.
                    unsafe { f(config, state, input, output) };
                });
            }
            for (name, function) in [
                ("eft_adaptive_step_ahead_f32", eft_adaptive_step_ahead_f32 as Ahead),
                (
                    "eft_adaptive_compensation_step_ahead_f32",
                    eft_adaptive_compensation_step_ahead_f32 as Ahead,
                ),
            ] {
                let f = probed!(function, Ahead);
                measure(format_args!("{name}{curve}{rate}"), config, |state, input, next, output| {
                    // Safety: every pointer is valid.
                    unsafe { f(config, state, input, next, output) };
                });
            }
        }
    }
}

fn measure(
    name: core::fmt::Arguments,
    config: *const eft_adaptive_f32,
    mut step: impl FnMut(*mut eft_adaptive_state_f32, &eft_adaptive_input_f32, f32, &mut eft_output_f32),
) {
    let mut state = MaybeUninit::uninit();
    let mut output = eft_output_f32 { valve_command: 0.0, compensation: 0.0, status: 0 };
    let mut learned = eft_learned_f32 { flow_gain: 1.0, valve_gain: 1.0, response_delay: 0.0, level: 1.0 };
    // Safety: every pointer is valid.
    let code = unsafe { eft_adaptive_reset_f32(config, state.as_mut_ptr()) };
    assert!(code == 0, "refused");
    let mut tick = 0_u32;
    worst(name, |r| {
        let input = input(&mut tick, r);
        step(state.as_mut_ptr(), &input, next(input.command, r), &mut output);
    });
    // Safety: every pointer is valid.
    let code = unsafe { eft_adaptive_learned_f32(state.as_ptr(), &mut learned) };
    assert!(code == 0 && learned.flow_gain != 1.0 && learned.valve_gain != 1.0, "nothing was learned");
}
