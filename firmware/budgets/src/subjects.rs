//! What is measured of the core.

use core::hint::black_box;

use eft_core::{
    AdaptiveController, AdaptiveControllerState, Compensation, CompensationState, Controller,
    ControllerOutput, ControllerState, FilteredDerivative, FilteredDerivativeState, LeadNetwork, LeadState,
    LoadPressure, Measurements, PiecewiseLinear, Protection, ProtectionState, VelocityObserver,
    VelocityObserverState,
};
use eft_rigs::guarded_tick;

use crate::blocks::*;
use crate::inputs::{next, rig};
use crate::probe::{probed, worst};

/// Prints one line a function: name, instructions, bytes of stack.
pub fn run() {
    let mut lead = LeadState::default();
    let f = probed!(lead_step, extern "C" fn(&LeadNetwork<f32>, &mut LeadState<f32>, f32) -> f32);
    worst("lead_step", |r| {
        black_box(f(&LEAD, &mut lead, r.sample(1.0)));
    });
    let f = probed!(table_inverse, extern "C" fn(&PiecewiseLinear<f32, N>, f32) -> f32);
    worst("table_inverse", |r| {
        black_box(f(TABLE.inverse(), r.sample(8.0e-3)));
    });
    let f = probed!(load_pressure_factor, extern "C" fn(&LoadPressure<f32>, f32, f32) -> f32);
    worst("load_pressure_factor", |r| {
        black_box(f(&LOAD_PRESSURE, r.sample(1.5e5), r.sample(1.0)));
    });
    let (mut state, mut status) = (CompensationState::default(), 0);
    let f = probed!(
        compensation_step,
        extern "C" fn(
            &Compensation<f32, N>,
            &mut CompensationState<f32>,
            &mut u32,
            f32,
            f32,
            f32,
            f32,
        ) -> f32
    );
    worst("compensation_step", |r| {
        let (v, f_, x, q) = (r.sample(1.0), r.sample(1.5e5), r.sample(1.0), r.sample(1.0e-3));
        black_box(f(&CONTROLLER.compensation, &mut state, &mut status, v, f_, x, q));
    });
    let mut state = ControllerState::default();
    let f = probed!(
        controller_step,
        extern "C" fn(&Controller<f32, N>, &mut ControllerState<f32>, &mut u32, f32, f32, f32, f32) -> f32
    );
    worst("controller_step", |r| {
        let (c, v, f_, x) = (r.sample(1.0e4), r.sample(1.0), r.sample(1.5e5), r.sample(1.0));
        black_box(f(&CONTROLLER, &mut state, &mut status, c, v, f_, x));
    });

    type Adaptive = extern "C" fn(
        &AdaptiveController<f32, N>,
        &mut AdaptiveControllerState<f32>,
        &mut u32,
        f32,
        &Measurements<f32>,
    ) -> f32;
    type Ahead = extern "C" fn(
        &AdaptiveController<f32, N>,
        &mut AdaptiveControllerState<f32>,
        &mut u32,
        f32,
        f32,
        &Measurements<f32>,
    ) -> f32;
    for (rate, [plain, correcting]) in
        [("", [&ADAPTIVE, &CORRECTING]), (", 2048 Hz", [&SLOW, &SLOW_CORRECTING])]
    {
        for (curve, controller) in [("", plain), (", curve", correcting)] {
            let mut state = controller.at_rest();
            let mut tick = 0_u32;
            let f = probed!(adaptive_step, Adaptive);
            worst(format_args!("adaptive_step{curve}{rate}"), |r| {
                let (command, measured) = rig(&mut tick, r);
                black_box(f(controller, &mut state, &mut status, command, &measured));
            });
            let learned = &state.compensation;
            assert!(learned.flow_gain() != 1.0 && learned.valve_gain() != 1.0, "nothing was learned");
            let mut state = controller.at_rest();
            let f = probed!(adaptive_step_ahead, Ahead);
            worst(format_args!("adaptive_step_ahead{curve}{rate}"), |r| {
                let (command, measured) = rig(&mut tick, r);
                black_box(f(controller, &mut state, &mut status, command, next(command, r), &measured));
            });
        }
    }

    let mut state = FilteredDerivativeState::default();
    let f = probed!(
        derivative_step,
        extern "C" fn(&FilteredDerivative<f32>, &mut FilteredDerivativeState<f32>, f32) -> f32
    );
    worst("derivative_step", |r| {
        black_box(f(&DERIVATIVE, &mut state, r.sample(0.1)));
    });
    let mut state = VelocityObserverState::default();
    let f = probed!(
        observer_step,
        extern "C" fn(&VelocityObserver<f32>, &mut VelocityObserverState<f32>, f32, f32) -> f32
    );
    worst("observer_step", |r| {
        black_box(f(&OBSERVER, &mut state, r.sample(0.1), r.sample(20.0)));
    });

    let output = ControllerOutput { valve_command: 1.0, compensation: 0.5, status: 0 };
    let (mut state, mut out, mut tick) = (ProtectionState::default(), output, 0_u32);
    let f = probed!(
        protection_step,
        extern "C" fn(
            &Protection<f32>,
            &mut ProtectionState<f32>,
            &mut ControllerOutput<f32>,
            f32,
            f32,
            f32,
            f32,
            f32,
        ) -> f32
    );
    worst("protection_step", |r| {
        // A trip is for good: now and then from the start again.
        tick += 1;
        if tick % 64 == 0 {
            (state, out) = (ProtectionState::default(), output);
        }
        let (c, f_, x, v, o) =
            (r.sample(1.0e4), r.sample(3.0e4), r.sample(0.08), r.sample(1.0), r.sample(0.8));
        black_box(f(&PROTECTION, &mut state, &mut out, c, f_, x, v, o));
    });

    let (mut state, mut tick) = (guarded_tick::State::at_rest(), 0_u32);
    let f = probed!(
        guarded_step,
        extern "C" fn(&mut guarded_tick::State, &guarded_tick::Sample, &mut ControllerOutput<f32>)
    );
    worst("guarded_step", |r| {
        let (command, m) = rig(&mut tick, r);
        let displacement = 0.05 * m.velocity;
        let sample = guarded_tick::Sample {
            command,
            displacement,
            force: m.force,
            spool: m.spool,
            supply_pressure: m.supply_pressure,
        };
        f(&mut state, &sample, &mut out);
    });
}
