//! The core's blocks as exported functions of their own, to be measured, and the rigs they are measured with.

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveControllerState, AdaptiveParameters, Compensation,
    CompensationParameters, CompensationState, Controller, ControllerOutput, ControllerState,
    FilteredDerivative, FilteredDerivativeState, FlowTable, LeadNetwork, LeadState, Limiter, LoadPressure,
    Measurements, PiecewiseLinear, Protection, ProtectionState, ServovalveController, Tuning,
    VelocityObserver, VelocityObserverState,
};
use eft_rigs::adaptive::{FLOWS, OPENINGS, PARAMETERS, SAMPLE_RATE};
use eft_rigs::guarded_tick;

pub use eft_rigs::adaptive::CONTROLLER as ADAPTIVE;
/// The same with the flow table corrected.
pub use eft_rigs::guarded::CONTROLLER as CORRECTING;
pub use eft_rigs::guarded::{PROTECTION, VELOCITY as OBSERVER};

/// Either of them where a window has half as many ticks as there are slots: every tick does two.
pub static SLOW: AdaptiveController<f32, N> = slow(false);
pub static SLOW_CORRECTING: AdaptiveController<f32, N> = slow(true);

macro_rules! ok {
    ($e:expr) => {
        match $e {
            Ok(v) => v,
            Err(_) => panic!("refused"),
        }
    };
}
pub const N: usize = eft_rigs::adaptive::POINTS;
pub static TABLE: FlowTable<f32, N> = ok!(FlowTable::<f32, N>::new(&OPENINGS, &FLOWS));
pub static LEAD: LeadNetwork<f32> = ok!(LeadNetwork::<f32>::new(12.4, 5.0e-3, 0.1, SAMPLE_RATE));
pub static LOAD_PRESSURE: LoadPressure<f32> = ok!(LoadPressure::<f32>::new(8.212e-3, 1.9e7));
pub static DERIVATIVE: FilteredDerivative<f32> = ok!(FilteredDerivative::<f32>::new(80.0, SAMPLE_RATE));
/// The paper's controller, with limits.
pub static CONTROLLER: Controller<f32, N> = Controller {
    compensation: ok!(Compensation::<f32, N>::new(&PARAMETERS, &TABLE)),
    servovalve: ADAPTIVE.servovalve,
    limiter: ADAPTIVE.limiter,
};

pub const SLOW_RATE: f64 = 2048.0;

const fn slow(correct_curve: bool) -> AdaptiveController<f32, N> {
    let adaptive = AdaptiveParameters {
        compensation: CompensationParameters { sample_rate: SLOW_RATE, ..PARAMETERS },
        compressibility: 7.56e-13,
        leakage: 1.3e-11,
        velocity_delay: 0.0,
        force_sensitivity: 5.6e-5,
        computation_delay: 0,
        feedforward: true,
        adaptive: true,
        correct_curve,
        guard: true,
        tuning: Tuning::DEFAULT,
    };
    AdaptiveController {
        compensation: ok!(AdaptiveCompensation::<f32, N>::new(&adaptive, &TABLE)),
        servovalve: ok!(ServovalveController::<f32>::new(
            5.6e-5,
            PARAMETERS.proportional_gain,
            2.0e-4,
            SLOW_RATE
        )),
        limiter: ok!(Limiter::<f32>::new(10.0, 2.0e4, SLOW_RATE)),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn adaptive_step(
    c: &AdaptiveController<f32, N>,
    s: &mut AdaptiveControllerState<f32>,
    status: &mut u32,
    r: f32,
    m: &Measurements<f32>,
) -> f32 {
    let out = c.step(s, r, m);
    *status = out.status;
    out.valve_command
}
#[unsafe(no_mangle)]
pub extern "C" fn adaptive_step_ahead(
    c: &AdaptiveController<f32, N>,
    s: &mut AdaptiveControllerState<f32>,
    status: &mut u32,
    r: f32,
    next: f32,
    m: &Measurements<f32>,
) -> f32 {
    let out = c.step_ahead(s, r, next, m);
    *status = out.status;
    out.valve_command
}
#[unsafe(no_mangle)]
pub extern "C" fn lead_step(c: &LeadNetwork<f32>, s: &mut LeadState<f32>, x: f32) -> f32 {
    c.step(s, x)
}
#[unsafe(no_mangle)]
pub extern "C" fn table_inverse(c: &PiecewiseLinear<f32, N>, x: f32) -> f32 {
    c.eval(x)
}
#[unsafe(no_mangle)]
pub extern "C" fn load_pressure_factor(c: &LoadPressure<f32>, f: f32, x: f32) -> f32 {
    c.factor(f, x).0
}
#[unsafe(no_mangle)]
pub extern "C" fn compensation_step(
    c: &Compensation<f32, N>,
    s: &mut CompensationState<f32>,
    status: &mut u32,
    v: f32,
    f: f32,
    x: f32,
    q: f32,
) -> f32 {
    let out = c.step(s, v, f, x, q);
    *status = out.status;
    out.value
}
#[unsafe(no_mangle)]
pub extern "C" fn controller_step(
    c: &Controller<f32, N>,
    s: &mut ControllerState<f32>,
    status: &mut u32,
    r: f32,
    v: f32,
    f: f32,
    x: f32,
) -> f32 {
    let out = c.step(s, r, v, f, x);
    *status = out.status;
    out.valve_command
}
#[unsafe(no_mangle)]
pub extern "C" fn derivative_step(
    c: &FilteredDerivative<f32>,
    s: &mut FilteredDerivativeState<f32>,
    x: f32,
) -> f32 {
    c.step(s, x)
}
#[unsafe(no_mangle)]
pub extern "C" fn observer_step(
    c: &VelocityObserver<f32>,
    s: &mut VelocityObserverState<f32>,
    x: f32,
    a: f32,
) -> f32 {
    c.step(s, x, a)
}
/// Both halves, before and behind the controller.
#[unsafe(no_mangle)]
pub extern "C" fn protection_step(
    c: &Protection<f32>,
    s: &mut ProtectionState<f32>,
    output: &mut ControllerOutput<f32>,
    r: f32,
    f: f32,
    x: f32,
    v: f32,
    o: f32,
) -> f32 {
    let permitted = c.step(s, r, f, x, v, o);
    *output = c.apply(s, &permitted, *output);
    permitted.command
}
/// The whole tick of the rig `guarded`: observer, protection, adaptive controller with the curve corrected.
#[unsafe(no_mangle)]
pub extern "C" fn guarded_step(
    s: &mut guarded_tick::State,
    sample: &guarded_tick::Sample,
    output: &mut ControllerOutput<f32>,
) {
    *output = s.step(sample).1;
}
