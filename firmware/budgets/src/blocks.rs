//! The functions that are measured, each as an exported function.

use eft_core::{
    Calibration, Channel, ChannelState, Compensation, CompensationInput, CompensationState,
    FilteredDerivative, FilteredDerivativeState, Input, LeadNetwork, LeadState, Learner, LearnerState,
    LoadPressure, Output, PiecewiseLinear, Protected, Protection, ProtectionInput, ProtectionState,
    VelocityObserver, VelocityObserverState, Window,
};
use eft_rigs::{guarded, worn};

use crate::rigs::{CROWDED, CURVE, PAPER, ROBUST, SELF_CALIBRATING, WATCHED, WORN, made};

/// Points of the flow table.
pub const N: usize = guarded::POINTS;

/// The numbers that firmware takes from a tick.
#[derive(Default)]
pub struct Answer {
    pub voltage: f32,
    pub status: u32,
    /// The last window that has closed.
    pub window: Option<Window<f32>>,
}

impl Answer {
    #[inline(always)]
    fn take(&mut self, output: &Output<f32>) {
        (self.voltage, self.status) = (output.voltage, output.status);
        if output.window.is_some() {
            self.window = output.window;
        }
    }
}

/// One tick of a channel by reference: the cost of a C interface without its own checks.
#[unsafe(no_mangle)]
pub extern "C" fn channel_step(
    channel: &Channel<f32, N>,
    state: &mut ChannelState<f32>,
    input: &Input<f32>,
    answer: &mut Answer,
) {
    answer.take(&channel.step(state, input));
}

/// One tick of a rig in a `static`, as `eft export` writes it.
macro_rules! tick {
    ($name:ident, $parameters:expr) => {
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(
            _: &Channel<f32, N>,
            state: &mut ChannelState<f32>,
            input: &Input<f32>,
            answer: &mut Answer,
        ) {
            static CHANNEL: Channel<f32, N> = made!(Channel::<f32, N>::new(&$parameters));
            answer.take(&CHANNEL.step(state, input));
        }
    };
}
tick!(paper_tick, PAPER);
tick!(self_calibrating_tick, SELF_CALIBRATING);
tick!(robust_tick, ROBUST);
tick!(worn_tick, WORN);
tick!(every_part_tick, worn::PARAMETERS);
tick!(self_calibrating_curve_tick, CURVE);
tick!(crowded_tick, CROWDED);
tick!(guarded_tick, guarded::PARAMETERS);
tick!(watched_tick, WATCHED);

/// The next calibration.
#[unsafe(no_mangle)]
pub extern "C" fn learner_update(
    learner: &Learner<f32, N>,
    state: &mut LearnerState<f32>,
    window: &Window<f32>,
    calibration: &mut Calibration<f32>,
) {
    *calibration = learner.update(state, window);
}
#[unsafe(no_mangle)]
pub extern "C" fn channel_publish(
    channel: &Channel<f32, N>,
    state: &mut ChannelState<f32>,
    calibration: &Calibration<f32>,
) {
    channel.publish(state, *calibration);
}
#[unsafe(no_mangle)]
pub extern "C" fn compensation_step(
    compensation: &Compensation<f32, N>,
    state: &mut CompensationState<f32>,
    calibration: &Calibration<f32>,
    status: &mut u32,
    velocity: f32,
    force: f32,
    spool: f32,
    further_flow: f32,
) -> f32 {
    let input = CompensationInput { velocity, force, spool, supply: 1.0, further_flow };
    let output = compensation.step(state, &input, calibration);
    *status = output.status;
    output.value
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
pub extern "C" fn longest_table(c: &PiecewiseLinear<f32, 255>, x: f32) -> f32 {
    c.eval(x)
}
#[unsafe(no_mangle)]
pub extern "C" fn load_pressure_factor(c: &LoadPressure<f32>, f: f32, x: f32) -> f32 {
    c.factor(f, x).0
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
/// The protection's steps before and after the controller, whose flags are `flags`.
#[unsafe(no_mangle)]
pub extern "C" fn protection_step(
    c: &Protection<f32>,
    s: &mut ProtectionState<f32>,
    protected: &mut Protected<f32>,
    flags: u32,
    r: f32,
    f: f32,
    x: f32,
    v: f32,
    o: f32,
    n: f32,
    t: f32,
) {
    let input =
        ProtectionInput { command: r, force: f, displacement: x, velocity: v, spool: o, alive: n, period: t };
    *protected = c.step(s, &input);
    c.watch(s, flags);
}
