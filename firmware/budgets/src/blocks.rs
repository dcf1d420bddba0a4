//! The core's blocks as exported functions of their own, to be measured, and the rigs they are measured with.

use eft_core::{
    AdaptiveController, AdaptiveControllerState, Compensation, CompensationState, Controller,
    ControllerOutput, ControllerState, FilteredDerivative, FilteredDerivativeState, FlowTable, LeadNetwork,
    LeadState, LoadPressure, Measurements, PiecewiseLinear, Protection, ProtectionState, VelocityObserver,
    VelocityObserverState,
};
use eft_rigs::adaptive::{FLOWS, OPENINGS, PARAMETERS, SAMPLE_RATE};
use eft_rigs::guarded_tick;

pub use eft_rigs::adaptive::CONTROLLER as ADAPTIVE;
/// The same with the flow table corrected.
pub use eft_rigs::guarded::CONTROLLER as CORRECTING;
pub use eft_rigs::guarded::{PROTECTION, VELOCITY as OBSERVER};

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
// The same under another name, for the budgets.
#[unsafe(no_mangle)]
pub extern "C" fn adaptive_curve_step(
    c: &AdaptiveController<f32, N>,
    s: &mut AdaptiveControllerState<f32>,
    status: &mut u32,
    r: f32,
    m: &Measurements<f32>,
) -> f32 {
    adaptive_step(c, s, status, r, m)
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
