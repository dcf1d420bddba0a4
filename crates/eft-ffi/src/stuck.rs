//! The watch for sensors that repeat themselves, in C.

use eft_core::{ConfigError, StuckWatch, StuckWatchState};

use crate::block::{configuration, given, opaque};
use crate::parameters::{eft_error, refuse};
use crate::status::{EFT_CORRUPT, EFT_NULL_POINTER, EFT_OK};

/// What a watch for stuck sensors is made from.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_stuck_parameters {
    /// Samples for which a measurement may repeat itself to the last bit before it counts as stuck, 1.
    pub repeats: u32,
}

macro_rules! precision {
    (
        $module:ident, $t:ty, $Config:ident $State:ident
        $configure:ident $check:ident $reset:ident $step:ident
    ) => {
        mod $module {
            use super::*;

            type Core = StuckWatch<$t>;
            type CoreState = StuckWatchState<$t>;

            opaque! {
                /// A watch for stuck sensors: opaque, filled by eft_stuck_configure only.
                $Config, [$t; 2] for Core
            }
            opaque! {
                /// The last measurements and how often each has repeated itself; all zero bytes have seen nothing.
                $State, [$t; 8] for CoreState
            }

            fn build(p: &eft_stuck_parameters) -> Result<Core, ConfigError> {
                Core::new(p.repeats)
            }

            configuration! { $Config, Core, eft_stuck_parameters, $configure, $check }

            /// Forgets what was seen.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $reset(state: *mut $State) -> u8 {
                if state.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, no smaller than the core's state, and aligned.
                unsafe { state.cast::<CoreState>().write(CoreState::default()) };
                EFT_OK
            }

            /// One sample of piston velocity, m/s (or displacement, m, where the velocity is made of it), force, N, and
            /// spool opening, 1: *status is EFT_STUCK_MEASUREMENT where one of them has repeated itself too often, 0
            /// elsewhere. NaN is never stuck.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $step(
                config: *const $Config,
                state: *mut $State,
                velocity: $t,
                force: $t,
                spool: $t,
                status: *mut u32,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(mut state.cast::<CoreState>());
                let status = given!(mut status);
                *status = core.step(state, velocity, force, spool);
                EFT_OK
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32, eft_stuck_f32 eft_stuck_state_f32
    eft_stuck_configure_f32 eft_stuck_check_f32 eft_stuck_reset_f32 eft_stuck_step_f32
);
precision!(
    double, f64, eft_stuck_f64 eft_stuck_state_f64
    eft_stuck_configure_f64 eft_stuck_check_f64 eft_stuck_reset_f64 eft_stuck_step_f64
);
