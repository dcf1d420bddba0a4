//! The adaptive controller's C functions, called as C would: the core's own bits, and null pointers refused.
#![allow(clippy::unwrap_used, clippy::float_cmp)]

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveParameters, CompensationParameters, FlowTable, Limiter,
    Measurements, Mode, ServovalveController, SignFrom, Tuning,
};
use eft_ffi::*;

fn parameters() -> eft_adaptive_parameters {
    let mut openings = [0.0; EFT_TABLE_CAPACITY];
    let mut flows = [0.0; EFT_TABLE_CAPACITY];
    for (n, (x, q)) in openings.iter_mut().zip(&mut flows).enumerate() {
        *x = (n as f64 - 10.0) / 10.0;
        *q = 0.01 * *x * (1.5 - 0.5 * x.abs());
    }
    eft_adaptive_parameters {
        rig: eft_parameters {
            table_length: 21,
            mode: EFT_MODE_NONLINEAR,
            sign_from: EFT_SIGN_FROM_SPOOL,
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
        },
        compressibility: 7.56e-13,
        leakage: 1.3e-11,
        velocity_delay: 0.0,
        computation_delay: 0,
        parts: EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD,
    }
}

fn core(p: &eft_adaptive_parameters) -> AdaptiveController<f32, 21> {
    let r = &p.rig;
    let table = FlowTable::<f32, 21>::new(&r.openings, &r.flows).unwrap();
    let compensation = CompensationParameters {
        mode: Mode::Nonlinear,
        level: r.level,
        piston_area: r.piston_area,
        supply_pressure: r.supply_pressure,
        flow_gain: r.flow_gain,
        valve_gain: r.valve_gain,
        proportional_gain: r.proportional_gain,
        response_delay: r.response_delay,
        lead_alpha: r.lead_alpha,
        sample_rate: r.sample_rate,
        sign_from: SignFrom::Spool,
        spool_warning: r.spool_warning,
        velocity_range: r.velocity_range,
        force_range: r.force_range,
        spool_range: r.spool_range,
    };
    let adaptive = AdaptiveParameters {
        compensation,
        compressibility: p.compressibility,
        leakage: p.leakage,
        force_sensitivity: r.force_sensitivity,
        computation_delay: 0,
        velocity_delay: 0.0,
        feedforward: true,
        adaptive: true,
        correct_curve: false,
        guard: true,
        tuning: Tuning::DEFAULT,
    };
    AdaptiveController {
        compensation: AdaptiveCompensation::<f32, 21>::new(&adaptive, &table).unwrap(),
        servovalve: ServovalveController::<f32>::new(
            r.force_sensitivity,
            r.proportional_gain,
            2.0e-4,
            4096.0,
        )
        .unwrap(),
        limiter: Limiter::<f32>::new(10.0, f64::MAX, 4096.0).unwrap(),
    }
}

#[test]
fn the_steps_are_the_cores() {
    let p = parameters();
    let core = core(&p);
    let (mut config, mut state) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let (mut config_alone, mut alone) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let mut output = eft_output_f32 { valve_command: 0.0, compensation: 0.0, status: 0 };
    let mut learned = eft_learned_f32 { flow_gain: 0.0, valve_gain: 0.0, response_delay: 0.0, level: 0.0 };
    let mut expected_state = core.at_rest();
    let mut expected_alone = core.compensation.at_rest();
    // Safety: every pointer is valid.
    unsafe {
        assert_eq!(eft_adaptive_configure_f32(&p, config.as_mut_ptr(), null_mut()), EFT_OK);
        assert_eq!(eft_adaptive_configure_f32(&p, config_alone.as_mut_ptr(), null_mut()), EFT_OK);
        assert_eq!(eft_adaptive_check_f32(config.as_ptr(), &p), EFT_OK);
        assert_eq!(eft_adaptive_reset_f32(config.as_ptr(), state.as_mut_ptr()), EFT_OK);
        assert_eq!(eft_adaptive_reset_f32(config.as_ptr(), alone.as_mut_ptr()), EFT_OK);
        for n in 0..20_000_u32 {
            let swing = (0.006 * n as f32).sin();
            let input = eft_adaptive_input_f32 {
                command: 3.0e3 * swing,
                velocity: if n == 9000 { f32::NAN } else { 0.3 * swing },
                force: 2.9e3 * swing,
                spool: 0.2 * swing,
                supply_pressure: 1.8e7,
                valve_command: output.valve_command,
            };
            let measured = Measurements {
                velocity: input.velocity,
                force: input.force,
                spool: input.spool,
                valve_command: input.valve_command,
                supply_pressure: input.supply_pressure,
            };
            // Half of the time the next command is known.
            let (config, state) = (config.as_ptr(), state.as_mut_ptr());
            let next = 1.01 * input.command;
            let (mut signal, alone) = (output, alone.as_mut_ptr());
            let (code, expected) = if n % 2 == 0 {
                let code = eft_adaptive_compensation_step_f32(config, alone, &input, &mut signal);
                (code, core.compensation.step(&mut expected_alone, input.command, &measured))
            } else {
                let code = eft_adaptive_compensation_step_ahead_f32(config, alone, &input, next, &mut signal);
                (code, core.compensation.step_ahead(&mut expected_alone, input.command, next, &measured))
            };
            assert_eq!(code, EFT_OK);
            assert_eq!(signal.valve_command.to_bits(), expected.value.to_bits());
            assert_eq!(signal.status, expected.status);
            let (code, expected) = if n % 2 == 0 {
                let code = eft_adaptive_step_f32(config, state, &input, &mut output);
                (code, core.step(&mut expected_state, input.command, &measured))
            } else {
                let code = eft_adaptive_step_ahead_f32(config, state, &input, next, &mut output);
                (code, core.step_ahead(&mut expected_state, input.command, next, &measured))
            };
            assert_eq!(code, EFT_OK);
            assert_eq!(output.valve_command.to_bits(), expected.valve_command.to_bits());
            assert_eq!(output.compensation.to_bits(), expected.compensation.to_bits());
            assert_eq!(output.status, expected.status);
            assert_eq!(output.status & EFT_INVALID_MEASUREMENT != 0, n == 9000);
        }
        assert_eq!(eft_adaptive_learned_f32(state.as_ptr(), &mut learned), EFT_OK);
        let last = output.valve_command;
        assert_eq!(eft_adaptive_missed_f32(config.as_ptr(), state.as_ptr(), &mut output), EFT_OK);
        assert_eq!((output.valve_command, output.status), (last, EFT_HELD | EFT_MISSED_TICK));
    }
    assert_eq!(learned.flow_gain, expected_state.compensation.flow_gain());
    assert_ne!(learned.response_delay, 5.0e-3);
}

#[test]
fn the_flow_table_is_corrected_as_the_core_does() {
    let mut p = parameters();
    p.parts |= EFT_CURVE;
    let (openings, flows) = (p.rig.openings, p.rig.flows);
    let (mut config, mut state) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let mut output = eft_output_f64 { valve_command: 0.0, compensation: 0.0, status: 0 };
    let table = FlowTable::<f64, 21>::new(&openings, &flows).unwrap();
    // Safety: every pointer is valid.
    unsafe {
        assert_eq!(eft_adaptive_configure_f64(&p, config.as_mut_ptr(), null_mut()), EFT_OK);
        assert_eq!(eft_adaptive_reset_f64(config.as_ptr(), state.as_mut_ptr()), EFT_OK);
        // The spool comes 5 ms after its command; the valve passes 5 % more forth and 5 % less back.
        // A swing of one size would tell an offset from the bands beside zero but slowly.
        let swing = |tick: f64| (0.25 + 0.15 * (0.000_23 * tick).sin()) * (0.002 * tick).sin();
        for n in 0..160_000_u32 {
            let opening = swing(f64::from(n));
            let side = if opening > 0.0 { 1.05 } else { 0.95 };
            let input = eft_adaptive_input_f64 {
                command: 0.0,
                velocity: side * table.flow(opening) / p.rig.piston_area,
                force: 0.0,
                spool: opening,
                supply_pressure: p.rig.supply_pressure,
                valve_command: swing(f64::from(n) + 5.0e-3 * p.rig.sample_rate) / p.rig.valve_gain,
            };
            eft_adaptive_compensation_step_f64(config.as_ptr(), state.as_mut_ptr(), &input, &mut output);
        }
        for (x, ratio) in [(0.3, 1.05), (-0.3, 0.95)] {
            let mut flow = 0.0;
            assert_eq!(eft_adaptive_flow_f64(config.as_ptr(), state.as_ptr(), x, &mut flow), EFT_OK);
            assert!((flow / table.flow(x) - ratio).abs() < 0.01, "{x}: {}", flow / table.flow(x));
        }
        assert_eq!(eft_adaptive_flow_f64(config.as_ptr(), null(), 0.1, &mut 0.0), EFT_NULL_POINTER);
        let mut flow = 7.0;
        for opening in [f64::NAN, f64::INFINITY] {
            let code = eft_adaptive_flow_f64(config.as_ptr(), state.as_ptr(), opening, &mut flow);
            assert_eq!((code, flow), (EFT_NOT_FINITE, 7.0));
        }
    }
}

#[test]
fn primed_it_holds_its_output() {
    let p = parameters();
    let (mut config, mut state) = (MaybeUninit::uninit(), MaybeUninit::uninit());
    let mut output = eft_output_f64 { valve_command: 0.0, compensation: 0.0, status: 0 };
    let input = eft_adaptive_input_f64 {
        command: 9.0e3,
        velocity: 0.2,
        force: 8.0e3,
        spool: 0.3,
        supply_pressure: 1.8e7,
        valve_command: 0.0,
    };
    // Safety: every pointer is valid.
    unsafe {
        assert_eq!(eft_adaptive_configure_f64(&p, config.as_mut_ptr(), null_mut()), EFT_OK);
        assert_eq!(eft_adaptive_prime_f64(config.as_ptr(), state.as_mut_ptr(), &input), EFT_OK);
        assert_eq!(eft_adaptive_hold_f64(config.as_ptr(), state.as_ptr(), &mut output), EFT_OK);
        let held = output.valve_command;
        assert!(held != 0.0);
        assert_eq!(eft_adaptive_step_f64(config.as_ptr(), state.as_mut_ptr(), &input, &mut output), EFT_OK);
        assert_eq!(output.valve_command, held);
    }
}

#[test]
fn what_is_wrong_is_refused_by_name() {
    let mut config = MaybeUninit::<eft_adaptive_f32>::uninit();
    let mut why = MaybeUninit::<eft_error>::uninit();
    for (change, name) in [
        ((|p| p.parts = 16) as fn(&mut eft_adaptive_parameters), "parts"),
        (|p| p.compressibility = 0.0, "compressibility"),
        (|p| p.computation_delay = u32::MAX, "computation_delay"),
        (|p| p.rig.reserved = 1, "reserved"),
        (|p| p.rig.level = -1.0, "level"),
    ] {
        let mut p = parameters();
        change(&mut p);
        // Safety: every pointer is valid, and a refusal writes the reason.
        let why = unsafe {
            assert_ne!(eft_adaptive_configure_f32(&p, config.as_mut_ptr(), why.as_mut_ptr()), EFT_OK);
            why.assume_init()
        };
        let said: String =
            why.parameter.iter().take_while(|c| **c != 0).map(|c| char::from(*c as u8)).collect();
        assert_eq!(said, name);
    }
    // Safety: null is allowed.
    unsafe {
        assert_eq!(eft_adaptive_configure_f32(null(), config.as_mut_ptr(), null_mut()), EFT_NULL_POINTER);
        assert_eq!(eft_adaptive_reset_f32(null(), null_mut()), EFT_NULL_POINTER);
        assert_eq!(eft_adaptive_step_f32(null(), null_mut(), null(), null_mut()), EFT_NULL_POINTER);
        let ahead = eft_adaptive_step_ahead_f64(null(), null_mut(), null(), 0.0, null_mut());
        assert_eq!(ahead, EFT_NULL_POINTER);
        let ahead = eft_adaptive_compensation_step_ahead_f64(null(), null_mut(), null(), 0.0, null_mut());
        assert_eq!(ahead, EFT_NULL_POINTER);
        assert_eq!(eft_adaptive_learned_f64(null(), null_mut()), EFT_NULL_POINTER);
    }
}
