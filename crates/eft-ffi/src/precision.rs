//! The functions themselves, once for each precision.

use eft_core::{
    Compensation, CompensationState, Controller, ControllerOutput, ControllerState, FlowTable, Limiter,
    ServovalveController,
};

use crate::block::{configuration, done, given, held, opaque};
use crate::parameters::{EFT_TABLE_CAPACITY, eft_error, eft_parameters, refuse};
use crate::shadow::eft_turn;
use crate::status::{EFT_BUSY, EFT_CORRUPT, EFT_MISSED_TICK, EFT_NULL_POINTER, EFT_OK};

macro_rules! precision {
    (
        $module:ident, $t:ty, controller: $controller_words:literal, state: $state_words:literal,
        $Config:ident $State:ident $Input:ident $Output:ident $Shadow:ident
        $configure:ident $check:ident $reset:ident $prime:ident $hold:ident $missed:ident $step:ident
        $compensation:ident $shadow_init:ident $shadow_offer:ident $shadow_take:ident
    ) => {
        mod $module {
            use super::*;

            type Core = Controller<$t, EFT_TABLE_CAPACITY>;

            opaque! {
                /// A configuration: opaque, filled by eft_configure only. One drives any number of states.
                $Config, [$t; $controller_words] for Core
            }
            opaque! {
                /// What the controller remembers; all zero bytes are a rig at rest.
                $State, [$t; $state_words] for ControllerState<$t>
            }
            /// One tick's command and measurements.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct $Input {
                /// Force command, N.
                pub command: $t,
                /// Piston velocity, m/s.
                pub velocity: $t,
                /// Force, N.
                pub force: $t,
                /// Spool opening, 1.
                pub spool: $t,
                /// Flow wanted on top of the piston's, m³/s; 0 for none.
                pub further_flow: $t,
            }
            /// One tick's result.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct $Output {
                /// Valve command, V.
                pub valve_command: $t,
                /// The part of it that compensates the piston's motion, V.
                pub compensation: $t,
                /// EFT_SPOOL_WARNING and its siblings.
                pub status: u32,
            }
            /// Two configurations: the interrupt steps with one while the other is written.
            #[repr(C)]
            #[derive(Debug)]
            pub struct $Shadow {
                copies: [$Config; 2],
                turn: eft_turn,
            }

            fn build(p: &eft_parameters) -> Result<Core, eft_core::ConfigError> {
                let (openings, flows) = p.table()?;
                let table = FlowTable::<$t, EFT_TABLE_CAPACITY>::new(openings, flows)?;
                Ok(Controller {
                    compensation: Compensation::<$t, EFT_TABLE_CAPACITY>::new(&p.compensation()?, &table)?,
                    servovalve: ServovalveController::<$t>::new(
                        p.force_sensitivity,
                        p.proportional_gain,
                        p.derivative_gain,
                        p.sample_rate,
                    )?,
                    limiter: Limiter::<$t>::new(p.valve_command, p.valve_command_rate, p.sample_rate)?,
                })
            }

            configuration! { $Config, Core, eft_parameters, $configure, $check }

            /// Puts a state to rest.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $reset(state: *mut $State) -> u8 {
                if state.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, and as large and aligned as a state (asserted above).
                unsafe { state.cast::<ControllerState<$t>>().write(ControllerState::default()) };
                EFT_OK
            }

            /// The state of a rig that has long been at this operating point: the next step starts without a bump.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $prime(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
            ) -> u8 {
                // Safety: null or valid.
                let (core, input) = unsafe { (config.cast::<Core>().as_ref(), input.as_ref()) };
                let (Some(core), Some(i), false) = (core, input, state.is_null()) else {
                    return EFT_NULL_POINTER;
                };
                let primed = core.prime(i.command, i.velocity, i.force, i.spool, i.further_flow);
                // Safety: not null, and as large and aligned as a state.
                unsafe { state.cast::<ControllerState<$t>>().write(primed) };
                EFT_OK
            }

            held! { $t, $Config, Core, $State, ControllerState<$t>, $Output, $hold, $missed }

            /// One tick. A measurement or command that is NaN, infinite or out of its range leaves the state as it
            /// was, repeats the last valve command and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the
            /// next good tick continues.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $step(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                output: *mut $Output,
            ) -> u8 {
                if config.is_null() || state.is_null() || input.is_null() || output.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, so valid.
                let (core, state, i, output) =
                    unsafe { (&*config.cast::<Core>(), &mut *state.cast(), &*input, &mut *output) };
                stepped(core, state, output, i.velocity, i.force, i.spool, i.further_flow, i.command)
            }

            // Behind the checks, with what it takes in registers: cheaper than one function for both.
            #[inline(never)]
            #[allow(clippy::too_many_arguments)] // one per wire
            extern "C" fn stepped(
                core: &Core,
                state: &mut ControllerState<$t>,
                output: &mut $Output,
                velocity: $t,
                force: $t,
                spool: $t,
                further_flow: $t,
                command: $t,
            ) -> u8 {
                let out = core.step_via(state, command, velocity, force, spool, further_flow, |v| v);
                give(output, &out);
                done()
            }

            /// The compensation alone, for a force loop that another controller closes: the command does not count,
            /// and output->valve_command is the compensation signal.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $compensation(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                output: *mut $Output,
            ) -> u8 {
                if config.is_null() || state.is_null() || input.is_null() || output.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, so valid.
                let (core, state, i, output) = unsafe {
                    (
                        &*config.cast::<Core>(),
                        &mut *state.cast::<ControllerState<$t>>(),
                        &*input,
                        &mut *output,
                    )
                };
                let (compensation, state) = (&core.compensation, &mut state.compensation);
                compensated(compensation, state, output, i.velocity, i.force, i.spool, i.further_flow)
            }

            #[inline(never)]
            extern "C" fn compensated(
                core: &Compensation<$t, EFT_TABLE_CAPACITY>,
                state: &mut CompensationState<$t>,
                output: &mut $Output,
                velocity: $t,
                force: $t,
                spool: $t,
                further_flow: $t,
            ) -> u8 {
                let out = core.step(state, velocity, force, spool, further_flow);
                *output = $Output { valve_command: out.value, compensation: out.value, status: out.status };
                done()
            }

            /// Both copies become *config, and none waits. Before the interrupt is enabled.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_init(shadow: *mut $Shadow, config: *const $Config) -> u8 {
                // Safety: null or valid.
                let (Some(shadow), Some(config)) = (unsafe { shadow.as_mut() }, unsafe { config.as_ref() })
                else {
                    return EFT_NULL_POINTER;
                };
                shadow.copies = [*config; 2];
                shadow.turn.reset();
                EFT_OK
            }

            /// Offers a configuration to the interrupt; EFT_BUSY while the one before still waits. From one thread at
            /// a time.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_offer(shadow: *mut $Shadow, config: *const $Config) -> u8 {
                let config = given!(config);
                if shadow.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: the turn is atomic, and only the copy that the interrupt does not read is written.
                unsafe {
                    let turn = &(*shadow).turn;
                    let Some(free) = turn.free() else { return EFT_BUSY };
                    (&raw mut (*shadow).copies).cast::<$Config>().add(free).write(*config);
                    turn.offer(free);
                }
                EFT_OK
            }

            /// In the interrupt, before the step: the configuration to step with; null for null.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_take(shadow: *const $Shadow) -> *const $Config {
                if shadow.is_null() {
                    return core::ptr::null();
                }
                // Safety: not null; the index is 0 or 1.
                unsafe { (&raw const (*shadow).copies).cast::<$Config>().add((*shadow).turn.take()) }
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32, controller: 100, state: 5,
    eft_controller_f32 eft_state_f32 eft_input_f32 eft_output_f32 eft_shadow_f32
    eft_configure_f32 eft_check_f32 eft_reset_f32 eft_prime_f32 eft_hold_f32 eft_missed_f32 eft_step_f32
    eft_compensation_step_f32 eft_shadow_init_f32 eft_shadow_offer_f32 eft_shadow_take_f32
);
precision!(
    double, f64, controller: 92, state: 5,
    eft_controller_f64 eft_state_f64 eft_input_f64 eft_output_f64 eft_shadow_f64
    eft_configure_f64 eft_check_f64 eft_reset_f64 eft_prime_f64 eft_hold_f64 eft_missed_f64 eft_step_f64
    eft_compensation_step_f64 eft_shadow_init_f64 eft_shadow_offer_f64 eft_shadow_take_f64
);
