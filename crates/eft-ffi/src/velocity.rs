//! Velocity for rigs that measure only displacement.

use eft_core::{
    ConfigError, FilteredDerivative, FilteredDerivativeState, VelocityObserver, VelocityObserverState,
};

use crate::block::{configuration, given, opaque};
use crate::parameters::{eft_error, refuse};
use crate::status::{EFT_CORRUPT, EFT_NULL_POINTER, EFT_OK};

/// What a filtered derivative is made from.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_derivative_parameters {
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// Corner of its two low-passes, Hz.
    pub corner: f64,
}

/// What a steady-state Kalman observer is made from.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_observer_parameters {
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// Gain on the displacement, 1.
    pub gain_on_displacement: f64,
    /// Gain on the velocity, 1/s.
    pub gain_on_velocity: f64,
    /// Gain on the drift of the acceleration, 1/s².
    pub gain_on_drift: f64,
}

macro_rules! precision {
    (
        $module:ident, $t:ty,
        $Derivative:ident $DerivativeState:ident
        $derivative_configure:ident $derivative_check:ident $derivative_reset:ident $derivative_step:ident
        $Observer:ident $ObserverState:ident
        $observer_configure:ident $observer_check:ident $observer_reset:ident $observer_step:ident
    ) => {
        mod $module {
            pub use derivative::*;
            pub use observer::*;

            mod derivative {
                use super::super::*;

                type Core = FilteredDerivative<$t>;
                type CoreState = FilteredDerivativeState<$t>;

                opaque! {
                    /// A filtered derivative: opaque, filled by eft_derivative_configure only.
                    $Derivative, [$t; 4] for Core
                }
                opaque! {
                    /// What a filtered derivative remembers; all zero bytes are a rig at rest at zero displacement.
                    $DerivativeState, [$t; 4] for CoreState
                }

                fn build(p: &eft_derivative_parameters) -> Result<Core, ConfigError> {
                    Core::new(p.corner, p.sample_rate)
                }

                configuration! {
                    $Derivative, Core, eft_derivative_parameters, $derivative_configure, $derivative_check
                }

                /// A rig that has long been at rest at this displacement, m: no kick in the next step.
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $derivative_reset(
                    config: *const $Derivative,
                    state: *mut $DerivativeState,
                    displacement: $t,
                ) -> u8 {
                    let core = given!(config.cast::<Core>());
                    if state.is_null() {
                        return EFT_NULL_POINTER;
                    }
                    // Safety: not null, no smaller than the core's state, and aligned.
                    unsafe { state.cast::<CoreState>().write(core.at_rest(displacement)) };
                    EFT_OK
                }

                /// One sample: *velocity, m/s, for the measured displacement, m. A displacement that is NaN or infinite
                /// leaves the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $derivative_step(
                    config: *const $Derivative,
                    state: *mut $DerivativeState,
                    displacement: $t,
                    velocity: *mut $t,
                ) -> u8 {
                    let core = given!(config.cast::<Core>());
                    let state = given!(mut state.cast::<CoreState>());
                    let velocity = given!(mut velocity);
                    *velocity = core.step(state, displacement);
                    EFT_OK
                }
            }

            mod observer {
                use super::super::*;

                type Core = VelocityObserver<$t>;
                type CoreState = VelocityObserverState<$t>;

                opaque! {
                    /// A velocity observer: opaque, filled by eft_observer_configure only.
                    $Observer, [$t; 8] for Core
                }
                opaque! {
                    /// What a velocity observer remembers; all zero bytes are a rig at rest at zero displacement and
                    /// acceleration.
                    $ObserverState, [$t; 8] for CoreState
                }

                fn build(p: &eft_observer_parameters) -> Result<Core, ConfigError> {
                    let gains = [p.gain_on_displacement, p.gain_on_velocity, p.gain_on_drift];
                    Core::new(gains, p.sample_rate)
                }

                configuration! {
                    $Observer, Core, eft_observer_parameters, $observer_configure, $observer_check
                }

                /// A rig that has long been at rest at this displacement, m, and with this acceleration, m/s², as the
                /// step will get it: it is taken as balanced, as that of a steady force on a standing piston is.
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $observer_reset(
                    config: *const $Observer,
                    state: *mut $ObserverState,
                    displacement: $t,
                    acceleration: $t,
                ) -> u8 {
                    let core = given!(config.cast::<Core>());
                    if state.is_null() {
                        return EFT_NULL_POINTER;
                    }
                    // Safety: not null, no smaller than the core's state, and aligned.
                    unsafe { state.cast::<CoreState>().write(core.at_rest(displacement, acceleration)) };
                    EFT_OK
                }

                /// One sample: *velocity, m/s, for the measured displacement, m, and an acceleration, m/s²: an
                /// accelerometer's, or the measured force over the mass that it moves. What is NaN or infinite leaves
                /// the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $observer_step(
                    config: *const $Observer,
                    state: *mut $ObserverState,
                    displacement: $t,
                    acceleration: $t,
                    velocity: *mut $t,
                ) -> u8 {
                    let core = given!(config.cast::<Core>());
                    let state = given!(mut state.cast::<CoreState>());
                    let velocity = given!(mut velocity);
                    *velocity = core.step(state, displacement, acceleration);
                    EFT_OK
                }
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32,
    eft_derivative_f32 eft_derivative_state_f32
    eft_derivative_configure_f32 eft_derivative_check_f32 eft_derivative_reset_f32 eft_derivative_step_f32
    eft_observer_f32 eft_observer_state_f32
    eft_observer_configure_f32 eft_observer_check_f32 eft_observer_reset_f32 eft_observer_step_f32
);
precision!(
    double, f64,
    eft_derivative_f64 eft_derivative_state_f64
    eft_derivative_configure_f64 eft_derivative_check_f64 eft_derivative_reset_f64 eft_derivative_step_f64
    eft_observer_f64 eft_observer_state_f64
    eft_observer_configure_f64 eft_observer_check_f64 eft_observer_reset_f64 eft_observer_step_f64
);
