//! The protection of the specimen in C, around a controller.

use eft_core::{
    ConfigError, ControllerOutput, Levels, Protected, Protection, ProtectionParameters, ProtectionState,
};

use crate::block::{configuration, given, opaque};
use crate::parameters::{eft_error, refuse};
use crate::precision::{eft_output_f32, eft_output_f64};
use crate::status::{EFT_CORRUPT, EFT_NULL_POINTER, EFT_OK};

/// A protection's parameters in SI units. DBL_MAX is no limit; a level that is zero trips at once.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_protection_parameters {
    /// Sample rate, Hz.
    pub sample_rate: f64,
    /// Force that raises EFT_PROTECTION_WARNING, N.
    pub force_warning: f64,
    /// Force that trips the test, N.
    pub force_trip: f64,
    /// Displacement that raises EFT_PROTECTION_WARNING, m.
    pub displacement_warning: f64,
    /// Displacement that trips the test, m.
    pub displacement_trip: f64,
    /// Velocity that raises EFT_PROTECTION_WARNING, m/s.
    pub velocity_warning: f64,
    /// Velocity that trips the test, m/s.
    pub velocity_trip: f64,
    /// Spool opening that raises EFT_PROTECTION_WARNING, 1.
    pub spool_warning: f64,
    /// Spool opening that trips the test, 1.
    pub spool_trip: f64,
    /// Time from zero to the whole command at the start, s; 0 for none.
    pub start_time: f64,
    /// Time from the whole command to zero after a trip or at the end, s.
    pub ramp_time: f64,
    /// Time from the whole valve command to zero in a shutdown, s.
    pub shutdown_time: f64,
    /// Lost or refused samples in a row that are waited for before a shutdown, lost commands before a trip; a whole
    /// number, 1.
    pub lost_samples: f64,
    /// Time for which EFT_ADAPTATION_FROZEN or EFT_STUCK_MEASUREMENT is waited for before a trip, s.
    pub fault_time: f64,
}

impl eft_protection_parameters {
    fn core(&self) -> ProtectionParameters {
        let levels = |warning, trip| Levels { warning, trip };
        ProtectionParameters {
            force: levels(self.force_warning, self.force_trip),
            displacement: levels(self.displacement_warning, self.displacement_trip),
            velocity: levels(self.velocity_warning, self.velocity_trip),
            spool: levels(self.spool_warning, self.spool_trip),
            start_time: self.start_time,
            ramp_time: self.ramp_time,
            shutdown_time: self.shutdown_time,
            lost_samples: self.lost_samples,
            fault_time: self.fault_time,
            sample_rate: self.sample_rate,
        }
    }
}

macro_rules! precision {
    (
        $module:ident, $t:ty,
        $Config:ident $State:ident $Input:ident $Permitted:ident $Output:ident
        $configure:ident $check:ident $reset:ident $step:ident $preview:ident $apply:ident $trip:ident $end:ident $is_down:ident
    ) => {
        mod $module {
            use super::*;

            type Core = Protection<$t>;
            type CoreState = ProtectionState<$t>;

            opaque! {
                /// A protection: opaque, filled by eft_protection_configure only. One drives any number of states.
                $Config, [$t; 24] for Core
            }
            opaque! {
                /// What a protection remembers; all zero bytes are a rig before the start.
                $State, [$t; 16] for CoreState
            }
            /// One tick's command and measurements.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct $Input {
                /// Force command, N.
                pub command: $t,
                /// Force, N.
                pub force: $t,
                /// Displacement, m.
                pub displacement: $t,
                /// Piston velocity, m/s.
                pub velocity: $t,
                /// Spool opening, 1.
                pub spool: $t,
            }
            /// What the protection permits in one tick.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct $Permitted {
                /// The force command for the controller's step, N; finite.
                pub command: $t,
                /// Factor on the valve command, 1; eft_protection_apply puts it there.
                pub authority: $t,
                /// EFT_PROTECTION_WARNING, EFT_TRIPPED, EFT_SHUT_DOWN, EFT_INVALID_COMMAND.
                pub status: u32,
            }

            fn build(p: &eft_protection_parameters) -> Result<Core, ConfigError> {
                Core::new(&p.core())
            }

            configuration! { $Config, Core, eft_protection_parameters, $configure, $check }

            /// A rig before the start, nothing tripped.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $reset(state: *mut $State) -> u8 {
                if state.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, no smaller than the core's state, and aligned.
                unsafe { state.cast::<CoreState>().write(CoreState::default()) };
                EFT_OK
            }

            /// One tick, before the controller's step, which gets permitted->command. A measurement that is NaN or
            /// infinite counts as lost. In place of such a command the last valid one is followed and
            /// EFT_INVALID_COMMAND raised; when it stays lost the test is tripped.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $step(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                permitted: *mut $Permitted,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(mut state.cast::<CoreState>());
                let i = given!(input);
                let permitted = given!(mut permitted);
                let out = core.step(state, i.command, i.force, i.displacement, i.velocity, i.spool);
                *permitted =
                    $Permitted { command: out.command, authority: out.authority, status: out.status };
                EFT_OK
            }

            /// After eft_protection_step: *permitted is what the next one will make of a command, N, known in advance,
            /// if nothing new happens.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $preview(
                config: *const $Config,
                state: *const $State,
                next_command: $t,
                permitted: *mut $t,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(state.cast::<CoreState>());
                let permitted = given!(mut permitted);
                *permitted = core.preview(state, next_command);
                EFT_OK
            }

            /// After the controller's step: puts the authority on output->valve_command and joins the flags. A fault
            /// that persists in output->status trips the test; samples that the controller keeps refusing, so that it
            /// holds its output (EFT_INVALID_MEASUREMENT, EFT_INVALID_COMMAND), shut it down as lost ones do.
            /// *permitted is what the step gave.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $apply(
                config: *const $Config,
                state: *mut $State,
                permitted: *const $Permitted,
                output: *mut $Output,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(mut state.cast::<CoreState>());
                let p = given!(permitted);
                let output = given!(mut output);
                let permitted = Protected { command: p.command, authority: p.authority, status: p.status };
                let before = ControllerOutput {
                    valve_command: output.valve_command,
                    compensation: output.compensation,
                    status: output.status,
                };
                let after = core.apply(state, &permitted, before);
                *output = $Output {
                    valve_command: after.valve_command,
                    compensation: after.compensation,
                    status: after.status,
                };
                EFT_OK
            }

            /// Trips from outside, as an emergency stop does, at the last command. Not while a step runs.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $trip(state: *mut $State) -> u8 {
                let state = given!(mut state.cast::<CoreState>());
                state.trip();
                EFT_OK
            }

            /// Asks for the soft end: the command, still followed, fades along the ramp. Not while a step runs.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $end(state: *mut $State) -> u8 {
                let state = given!(mut state.cast::<CoreState>());
                state.end();
                EFT_OK
            }

            /// Sets *down to 1 where the ramp has reached zero (or the test has not begun), to 0 elsewhere.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $is_down(state: *const $State, down: *mut u8) -> u8 {
                let state = given!(state.cast::<CoreState>());
                let down = given!(mut down);
                *down = u8::from(state.is_down());
                EFT_OK
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32,
    eft_protection_f32 eft_protection_state_f32 eft_protection_input_f32 eft_permitted_f32 eft_output_f32
    eft_protection_configure_f32 eft_protection_check_f32 eft_protection_reset_f32 eft_protection_step_f32
    eft_protection_preview_f32 eft_protection_apply_f32 eft_protection_trip_f32 eft_protection_end_f32 eft_protection_is_down_f32
);
precision!(
    double, f64,
    eft_protection_f64 eft_protection_state_f64 eft_protection_input_f64 eft_permitted_f64 eft_output_f64
    eft_protection_configure_f64 eft_protection_check_f64 eft_protection_reset_f64 eft_protection_step_f64
    eft_protection_preview_f64 eft_protection_apply_f64 eft_protection_trip_f64 eft_protection_end_f64 eft_protection_is_down_f64
);
