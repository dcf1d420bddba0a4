//! Each step of the core, and the constructors that bound its configuration, exported under their own names for the
//! solver.
#![no_std]

use eft_core::*;

/// Longest table of the proofs.
pub const N: usize = 21;

macro_rules! lowered {
    ($suffix:literal: $($name:ident($($argument:ident: $kind:ty),*) $(-> $result:ty)? $body:block)*) => {$(
        #[unsafe(export_name = concat!(stringify!($name), $suffix))]
        pub extern "C" fn $name($($argument: $kind),*) $(-> $result)? $body
    )*};
}

macro_rules! steps {
    ($module:ident, $t:ty, $suffix:literal) => {
        pub mod $module {
            use super::*;
            type T = $t;

            lowered! { $suffix:
            lead(config: &LeadNetwork<T>, state: &mut LeadState<T>, input: T) -> T { config.step(state, input) }
            lead_new(gain: f64, delay: f64, alpha: f64, rate: f64, out: &mut LeadNetwork<T>) -> bool {
                LeadNetwork::<T>::new(gain, delay, alpha, rate).map(|made| *out = made).is_ok()
            }
            limiter(config: &Limiter<T>, command: T, last: T, flags: &mut u32) -> T {
                let (value, raised) = config.apply(command, config.within(last));
                *flags = raised;
                value
            }
            limiter_new(amplitude: f64, rate: f64, sample_rate: f64, out: &mut Limiter<T>) -> bool {
                Limiter::<T>::new(amplitude, rate, sample_rate).map(|made| *out = made).is_ok()
            }
            force_loop(
                config: &ServovalveController<T>,
                state: &mut ServovalveControllerState<T>,
                command: T,
                force: T,
                compensation: T
            ) -> T {
                config.step(state, command, force, compensation)
            }
            root(config: &LoadPressure<T>, force: T, direction: T, supply: T) -> T {
                config.root(force, direction, supply).0
            }
            factor(config: &LoadPressure<T>, force: T, direction: T) -> T { config.factor(force, direction).0 }
            load_pressure_new(area: f64, pressure: f64, out: &mut LoadPressure<T>) -> bool {
                LoadPressure::<T>::new(area, pressure).map(|made| *out = made).is_ok()
            }
            table(config: &PiecewiseLinear<T, N>, x: T, outside: &mut bool) -> T {
                let (value, beyond) = config.eval_flagged(x);
                *outside = beyond;
                value
            }
            search(rows: &[Row<T>; N], x: T, out: &mut Row<T>) {
                // A copy, because the argument's address would hide its name from the solver.
                let at = x + 0.0;
                let [start, value, slope] = Row::search(rows, &at);
                *out = Row { start, value, slope };
            }
            opening(
                config: &InverseFlow<T, N>,
                flow: T,
                force: T,
                spool: T,
                supply: T,
                outside: &mut bool
            ) -> T {
                let (opening, beyond) = config.opening(config.demand(flow, force, spool, supply).0);
                *outside = beyond;
                opening
            }
            feedforward(config: &Feedforward<T>, state: &mut FeedforwardState<T>, command: T, friction: T) -> T {
                config.step(state, command, Some(friction))
            }
            derivative(config: &FilteredDerivative<T>, state: &mut FilteredDerivativeState<T>, displacement: T) -> T {
                config.step(state, displacement)
            }
            derivative_new(corner: f64, rate: f64, out: &mut FilteredDerivative<T>) -> bool {
                FilteredDerivative::<T>::new(corner, rate).map(|made| *out = made).is_ok()
            }
            observer(
                config: &VelocityObserver<T>,
                state: &mut VelocityObserverState<T>,
                displacement: T,
                acceleration: T
            ) -> T {
                config.step(state, displacement, acceleration)
            }
            stuck(config: &StuckWatch, state: &mut StuckWatchState<T>, velocity: T, force: T, spool: T) -> u32 {
                config.step(state, velocity, force, spool)
            }
            protection(
                config: &Protection<T>,
                state: &mut ProtectionState<T>,
                command: T,
                force: T,
                displacement: T,
                velocity: T,
                spool: T,
                alive: T,
                period: T,
                out: &mut Protected<T>
            ) {
                let input = ProtectionInput { command, force, displacement, velocity, spool, alive, period };
                *out = config.step(state, &input);
            }
            watch(config: &Protection<T>, state: &mut ProtectionState<T>, flags: u32) { config.watch(state, flags); }
            preview(config: &Protection<T>, state: &ProtectionState<T>, command: T) -> T {
                config.preview(state, command)
            }
            compensation(
                config: &Compensation<T, N>,
                state: &mut CompensationState<T>,
                input: &CompensationInput<T>,
                calibration: &Calibration<T>,
                out: &mut CompensationOutput<T>
            ) {
                *out = config.step(state, input, calibration);
            }
            controller(
                config: &Controller<T, N>,
                state: &mut ControllerState<T>,
                input: &ControllerInput<T>,
                calibration: &Calibration<T>,
                out: &mut ControllerOutput<T>
            ) {
                *out = config.step(state, input, calibration, |compensation| compensation);
            }
            channel(config: &Channel<T, N>, state: &mut ChannelState<T>, input: &Input<T>, status: &mut u32) -> T {
                let output = config.step(state, input);
                *status = output.status;
                output.voltage
            }
            learner(config: &Learner<T, N>, state: &mut LearnerState<T>, window: &Window<T>, out: &mut Calibration<T>) {
                *out = config.update(state, window);
            }
            publish(config: &Channel<T, N>, state: &mut ChannelState<T>, calibration: &Calibration<T>) {
                config.publish(state, calibration);
            }
            }
        }
    };
}
steps!(single, f32, "_f32");
steps!(double, f64, "_f64");
