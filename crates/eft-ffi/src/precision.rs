//! The functions themselves, once for each precision.

use core::mem::{MaybeUninit, align_of, size_of};

use eft_core::{Compensation, Controller, ControllerState, FlowTable, Limiter, ServovalveController};

use crate::parameters::{TABLE_CAPACITY, eft_error, eft_parameters, refuse};
use crate::shadow::Turn;
use crate::status;

macro_rules! precision {
    (
        $module:ident, $t:ty, controller: $controller_words:literal, state: $state_words:literal,
        $configure:ident $reset:ident $prime:ident $hold:ident $missed:ident $step:ident $compensation:ident
        $shadow_init:ident $shadow_offer:ident $shadow_take:ident
    ) => {
        /// One precision of the interface.
        pub mod $module {
            use super::*;

            type Core = Controller<$t, TABLE_CAPACITY>;

            /// A configuration; opaque, filled by `configure` only.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct Config {
                words: [MaybeUninit<$t>; $controller_words],
            }
            /// What the controller remembers; all zero bytes are a rig at rest.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct State {
                words: [MaybeUninit<$t>; $state_words],
            }
            /// One tick's command and measurements.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct Input {
                /// Force command (N).
                pub command: $t,
                /// Piston velocity (m/s).
                pub velocity: $t,
                /// Force (N).
                pub force: $t,
                /// Spool opening (1).
                pub spool: $t,
                /// Further flow (m³/s) wanted on top of the piston's.
                pub further_flow: $t,
            }
            /// One tick's result.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct Output {
                /// Valve command (V).
                pub valve_command: $t,
                /// Compensation signal (V) in it.
                pub compensation: $t,
                /// Bits of `eft_core::status`.
                pub status: u32,
            }
            /// Two configurations, one in use and one in waiting.
            #[repr(C)]
            #[derive(Debug)]
            pub struct Shadow {
                copies: [Config; 2],
                turn: Turn,
            }

            const _: () = assert!(size_of::<Config>() == size_of::<Core>());
            const _: () = assert!(align_of::<Config>() >= align_of::<Core>());
            const _: () = assert!(size_of::<State>() == size_of::<ControllerState<$t>>());
            const _: () = assert!(align_of::<State>() >= align_of::<ControllerState<$t>>());

            fn build(p: &eft_parameters) -> Result<Core, eft_core::ConfigError> {
                let (openings, flows) = p.table()?;
                let table = FlowTable::<$t, TABLE_CAPACITY>::new(openings, flows)?;
                Ok(Controller {
                    compensation: Compensation::<$t, TABLE_CAPACITY>::new(&p.compensation()?, &table)?,
                    servovalve: ServovalveController::<$t>::new(
                        p.force_sensitivity,
                        p.proportional_gain,
                        p.derivative_gain,
                        p.sample_rate,
                    )?,
                    limiter: Limiter::<$t>::new(p.valve_command, p.valve_command_rate, p.sample_rate)?,
                })
            }

            /// Checks parameters and makes a configuration of them; on refusal `config` stays as it was and `why`,
            /// if not null, says what was wrong. Not for the interrupt: it computes in double precision.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $configure(
                parameters: *const eft_parameters,
                config: *mut Config,
                why: *mut eft_error,
            ) -> u8 {
                // Safety: null or valid, as the crate asks of its callers.
                let (parameters, why) = unsafe { (parameters.as_ref(), why.as_mut()) };
                let Some(parameters) = parameters else { return status::NULL_POINTER };
                if config.is_null() {
                    return status::NULL_POINTER;
                }
                match build(parameters) {
                    Ok(core) => {
                        // Safety: not null, and as large and aligned as a `Core` (asserted above).
                        unsafe { config.cast::<Core>().write(core) };
                        status::OK
                    }
                    Err(error) => refuse(&error, why),
                }
            }

            /// Puts a state to rest.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $reset(state: *mut State) -> u8 {
                if state.is_null() {
                    return status::NULL_POINTER;
                }
                // Safety: not null, and as large and aligned as a state (asserted above).
                unsafe { state.cast::<ControllerState<$t>>().write(ControllerState::default()) };
                status::OK
            }

            /// The state of a rig that has long been at this operating point: the next step starts without a bump.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $prime(
                config: *const Config,
                state: *mut State,
                input: *const Input,
            ) -> u8 {
                // Safety: null or valid.
                let (core, input) = unsafe { (config.cast::<Core>().as_ref(), input.as_ref()) };
                let (Some(core), Some(i), false) = (core, input, state.is_null()) else {
                    return status::NULL_POINTER;
                };
                let primed = core.prime(i.command, i.velocity, i.force, i.spool, i.further_flow);
                // Safety: not null, and as large and aligned as a state.
                unsafe { state.cast::<ControllerState<$t>>().write(primed) };
                status::OK
            }

            /// Repeats the last valve command; the state stays.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $hold(
                config: *const Config,
                state: *const State,
                output: *mut Output,
            ) -> u8 {
                // Safety: null or valid.
                let (core, state, output) = unsafe {
                    (
                        config.cast::<Core>().as_ref(),
                        state.cast::<ControllerState<$t>>().as_ref(),
                        output.as_mut(),
                    )
                };
                let (Some(core), Some(state), Some(output)) = (core, state, output) else {
                    return status::NULL_POINTER;
                };
                let out = core.hold(state);
                *output = Output {
                    valve_command: out.valve_command,
                    compensation: out.compensation,
                    status: out.status,
                };
                status::OK
            }

            /// For a tick that was missed, in its place: the last valve command stays, and the output says so.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $missed(
                config: *const Config,
                state: *const State,
                output: *mut Output,
            ) -> u8 {
                // Safety: as the caller promises.
                let code = unsafe { $hold(config, state, output) };
                // Safety: null or valid.
                if code == status::OK
                    && let Some(output) = unsafe { output.as_mut() }
                {
                    output.status |= eft_core::status::MISSED_TICK;
                }
                code
            }

            /// One tick.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $step(
                config: *const Config,
                state: *mut State,
                input: *const Input,
                output: *mut Output,
            ) -> u8 {
                // Safety: null or valid.
                let (core, state, input, output) = unsafe {
                    (
                        config.cast::<Core>().as_ref(),
                        state.cast::<ControllerState<$t>>().as_mut(),
                        input.as_ref(),
                        output.as_mut(),
                    )
                };
                let (Some(core), Some(state), Some(i), Some(output)) = (core, state, input, output) else {
                    return status::NULL_POINTER;
                };
                let out =
                    core.step_via(state, i.command, i.velocity, i.force, i.spool, i.further_flow, |v| v);
                *output = Output {
                    valve_command: out.valve_command,
                    compensation: out.compensation,
                    status: out.status,
                };
                status::OK
            }

            /// The compensation alone, for a force loop that another controller closes; `input->command` does not
            /// count, and `output->valve_command` is the compensation signal.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $compensation(
                config: *const Config,
                state: *mut State,
                input: *const Input,
                output: *mut Output,
            ) -> u8 {
                // Safety: null or valid.
                let (core, state, input, output) = unsafe {
                    (
                        config.cast::<Core>().as_ref(),
                        state.cast::<ControllerState<$t>>().as_mut(),
                        input.as_ref(),
                        output.as_mut(),
                    )
                };
                let (Some(core), Some(state), Some(i), Some(output)) = (core, state, input, output) else {
                    return status::NULL_POINTER;
                };
                let out = core.compensation.step(
                    &mut state.compensation,
                    i.velocity,
                    i.force,
                    i.spool,
                    i.further_flow,
                );
                *output = Output { valve_command: out.value, compensation: out.value, status: out.status };
                status::OK
            }

            /// Both copies become `config`, and none waits. Before the interrupt is enabled.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_init(shadow: *mut Shadow, config: *const Config) -> u8 {
                // Safety: null or valid.
                let (Some(shadow), Some(config)) = (unsafe { shadow.as_mut() }, unsafe { config.as_ref() })
                else {
                    return status::NULL_POINTER;
                };
                shadow.copies = [*config; 2];
                shadow.turn.reset();
                status::OK
            }

            /// Offers a configuration to the interrupt; `BUSY` while the one before still waits.
            ///
            /// # Safety
            /// See the crate; one thread offers at a time.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_offer(shadow: *mut Shadow, config: *const Config) -> u8 {
                // Safety: null or valid.
                let Some(config) = (unsafe { config.as_ref() }) else { return status::NULL_POINTER };
                if shadow.is_null() {
                    return status::NULL_POINTER;
                }
                // Safety: the turn is atomic, and only the copy that the interrupt does not read is written.
                unsafe {
                    let turn = &(*shadow).turn;
                    let Some(free) = turn.free() else { return status::BUSY };
                    (&raw mut (*shadow).copies).cast::<Config>().add(free).write(*config);
                    turn.offer(free);
                }
                status::OK
            }

            /// In the interrupt, before the step: the configuration to step with; null for null.
            ///
            /// # Safety
            /// See the crate.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $shadow_take(shadow: *const Shadow) -> *const Config {
                if shadow.is_null() {
                    return core::ptr::null();
                }
                // Safety: not null; the index is 0 or 1.
                unsafe { (&raw const (*shadow).copies).cast::<Config>().add((*shadow).turn.take()) }
            }
        }
    };
}
precision!(
    single, f32, controller: 100, state: 5,
    eft_configure_f32 eft_reset_f32 eft_prime_f32 eft_hold_f32 eft_missed_f32 eft_step_f32 eft_compensation_step_f32
    eft_shadow_init_f32 eft_shadow_offer_f32 eft_shadow_take_f32
);
precision!(
    double, f64, controller: 92, state: 5,
    eft_configure_f64 eft_reset_f64 eft_prime_f64 eft_hold_f64 eft_missed_f64 eft_step_f64 eft_compensation_step_f64
    eft_shadow_init_f64 eft_shadow_offer_f64 eft_shadow_take_f64
);
