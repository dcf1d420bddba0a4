//! The adaptive controller in C: compensation that calibrates itself, with feedforward and guard.

use eft_core::{
    AdaptiveCompensation, AdaptiveController, AdaptiveControllerState, AdaptiveParameters, ControllerOutput,
    FlowTable, Limiter, Measurements, ServovalveController, Tuning,
};

use crate::block::{configuration, done, given, held, opaque};
use crate::parameters::{EFT_TABLE_CAPACITY, eft_error, eft_parameters, refuse};
use crate::precision::{eft_output_f32, eft_output_f64};
use crate::status::{EFT_CORRUPT, EFT_MISSED_TICK, EFT_NOT_FINITE, EFT_NULL_POINTER, EFT_OK};

/// eft_adaptive_parameters.parts: demand the command's own flow as well.
pub const EFT_FEEDFORWARD: u32 = 1;
/// eft_adaptive_parameters.parts: estimate flow gain and valve during the test.
pub const EFT_ESTIMATORS: u32 = 2;
/// eft_adaptive_parameters.parts: take the level back where overcompensation pumps the structure.
pub const EFT_GUARD: u32 = 4;
/// eft_adaptive_parameters.parts: correct the flow table by direction and band of opening, beside EFT_ESTIMATORS.
pub const EFT_CURVE: u32 = 8;

/// An adaptive controller's parameters in SI units: the nominal rig, and what is switched on.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct eft_adaptive_parameters {
    /// The rig as the plain controller knows it.
    pub rig: eft_parameters,
    /// Oil compressibility of the chambers, m³/Pa.
    pub compressibility: f64,
    /// Cross-piston leakage, m³/(s·Pa).
    pub leakage: f64,
    /// Delay of the velocity itself, of an estimate for example, s; 0 for a sensor's.
    pub velocity_delay: f64,
    /// Samples by which the compensation comes late to the valve command, at most 1000, 1.
    pub computation_delay: u32,
    /// EFT_FEEDFORWARD and its siblings, added up.
    pub parts: u32,
}

impl eft_adaptive_parameters {
    fn adaptive(&self) -> Result<AdaptiveParameters, eft_core::ConfigError> {
        let all = EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD | EFT_CURVE;
        if self.parts & !all != 0 {
            return Err(eft_core::ConfigError::OutOfRange {
                parameter: "parts",
                value: f64::from(self.parts),
                lowest: 0.0,
                highest: f64::from(all),
            });
        }
        Ok(AdaptiveParameters {
            compensation: self.rig.compensation()?,
            compressibility: self.compressibility,
            leakage: self.leakage,
            force_sensitivity: self.rig.force_sensitivity,
            computation_delay: self.computation_delay,
            velocity_delay: self.velocity_delay,
            feedforward: self.parts & EFT_FEEDFORWARD != 0,
            adaptive: self.parts & EFT_ESTIMATORS != 0,
            correct_curve: self.parts & EFT_CURVE != 0,
            guard: self.parts & EFT_GUARD != 0,
            tuning: Tuning::DEFAULT,
        })
    }
}

macro_rules! precision {
    (
        $module:ident, $t:ty, controller: $controller_words:literal, state: $state_words:literal,
        $Config:ident $State:ident $Input:ident $Output:ident $Learned:ident
        $configure:ident $check:ident $reset:ident $prime:ident $hold:ident $missed:ident $step:ident $ahead:ident
        $compensation:ident $compensation_ahead:ident $learned:ident $flow:ident
    ) => {
        mod $module {
            use super::*;

            type Core = AdaptiveController<$t, EFT_TABLE_CAPACITY>;
            type CoreState = AdaptiveControllerState<$t>;

            opaque! {
                /// A configuration: opaque, filled by eft_adaptive_configure only. One drives any number of states.
                $Config, [$t; $controller_words] for Core
            }
            opaque! {
                /// What the adaptive controller remembers and has learned; opaque, filled by eft_adaptive_reset or
                /// eft_adaptive_prime before the first step.
                $State, [$t; $state_words] for CoreState
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
                /// Supply pressure, Pa; the configured one where there is no transducer.
                pub supply_pressure: $t,
                /// Valve command that stood when the others were sampled, V; only the compensation alone looks at it.
                pub valve_command: $t,
            }
            /// What was learned.
            #[repr(C)]
            #[derive(Debug, Clone, Copy)]
            pub struct $Learned {
                /// True flow over the table's, 1.
                pub flow_gain: $t,
                /// The spool's gain over the configured one, 1.
                pub valve_gain: $t,
                /// Delay that the lead network makes up for, s.
                pub response_delay: $t,
                /// The guard's factor on the compensation level, 1.
                pub level: $t,
            }

            fn build(p: &eft_adaptive_parameters) -> Result<Core, eft_core::ConfigError> {
                let (openings, flows) = p.rig.table()?;
                let table = FlowTable::<$t, EFT_TABLE_CAPACITY>::new(openings, flows)?;
                let r = &p.rig;
                Ok(AdaptiveController {
                    compensation: AdaptiveCompensation::<$t, EFT_TABLE_CAPACITY>::new(
                        &p.adaptive()?,
                        &table,
                    )?,
                    servovalve: ServovalveController::<$t>::new(
                        r.force_sensitivity,
                        r.proportional_gain,
                        r.derivative_gain,
                        r.sample_rate,
                    )?,
                    limiter: Limiter::<$t>::new(r.valve_command, r.valve_command_rate, r.sample_rate)?,
                })
            }

            fn measured(i: &$Input) -> Measurements<$t> {
                Measurements {
                    velocity: i.velocity,
                    force: i.force,
                    spool: i.spool,
                    valve_command: i.valve_command,
                    supply_pressure: i.supply_pressure,
                }
            }

            configuration! { $Config, Core, eft_adaptive_parameters, $configure, $check }

            /// A rig at rest, nothing learned yet.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $reset(config: *const $Config, state: *mut $State) -> u8 {
                let core = given!(config.cast::<Core>());
                if state.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, and no smaller than a state, and aligned (asserted above).
                unsafe { state.cast::<CoreState>().write(core.at_rest()) };
                EFT_OK
            }

            /// A rig that has long been at this operating point, nothing learned yet: the next step starts without a
            /// bump.
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
                let primed = core.prime(i.command, &measured(i));
                // Safety: not null, and no smaller than a state, and aligned.
                unsafe { state.cast::<CoreState>().write(primed) };
                EFT_OK
            }

            held! { $t, $Config, Core, $State, CoreState, $Output, $hold, $missed }

            /// One tick. What is NaN, infinite or out of its range repeats the last valve command and raises
            /// EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; nothing is learned for a tenth of a second after it.
            /// A supply pressure is in its range from 0.05 to 4 times the configured one.
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
                stepped(core, state, i, output)
            }

            // Behind the checks: cheaper than one function for both.
            #[inline(never)]
            extern "C" fn stepped(core: &Core, state: &mut CoreState, i: &$Input, output: &mut $Output) -> u8 {
                give(output, &core.step(state, i.command, &measured(i)));
                done()
            }

            /// As eft_adaptive_step, where the next sample's command, N, is known, as of a ground motion: the flow that
            /// is fed forward is that of the time until the next sample. Behind a protection it is what
            /// eft_protection_preview gives.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $ahead(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                next_command: $t,
                output: *mut $Output,
            ) -> u8 {
                if config.is_null() || state.is_null() || input.is_null() || output.is_null() {
                    return EFT_NULL_POINTER;
                }
                // Safety: not null, so valid.
                let (core, state, i, output) =
                    unsafe { (&*config.cast::<Core>(), &mut *state.cast(), &*input, &mut *output) };
                stepped_ahead(core, state, i, next_command, output)
            }

            #[inline(never)]
            extern "C" fn stepped_ahead(
                core: &Core,
                state: &mut CoreState,
                i: &$Input,
                next_command: $t,
                output: &mut $Output,
            ) -> u8 {
                give(output, &core.step_ahead(state, i.command, next_command, &measured(i)));
                done()
            }

            /// The compensation alone, for a force loop that another controller closes: output->valve_command is the
            /// compensation signal. input->valve_command must be measured; where it is NaN, infinite or beyond 1e12, only
            /// learning waits (EFT_ADAPTATION_FROZEN).
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $compensation(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                output: *mut $Output,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(mut state.cast::<CoreState>());
                let i = given!(input);
                let output = given!(mut output);
                let out = core.compensation.step(&mut state.compensation, i.command, &measured(i));
                *output = $Output { valve_command: out.value, compensation: out.value, status: out.status };
                EFT_OK
            }

            /// As eft_adaptive_compensation_step, where the next sample's command, N, is known: see
            /// eft_adaptive_step_ahead.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $compensation_ahead(
                config: *const $Config,
                state: *mut $State,
                input: *const $Input,
                next_command: $t,
                output: *mut $Output,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(mut state.cast::<CoreState>());
                let i = given!(input);
                let output = given!(mut output);
                let (core, state) = (&core.compensation, &mut state.compensation);
                let out = core.step_ahead(state, i.command, next_command, &measured(i));
                *output = $Output { valve_command: out.value, compensation: out.value, status: out.status };
                EFT_OK
            }

            /// What was learned so far.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $learned(state: *const $State, learned: *mut $Learned) -> u8 {
                let state = given!(state.cast::<CoreState>());
                let learned = given!(mut learned);
                let known = &state.compensation;
                *learned = $Learned {
                    flow_gain: known.flow_gain(),
                    valve_gain: known.valve_gain(),
                    response_delay: known.response_delay(),
                    level: known.level(),
                };
                EFT_OK
            }

            /// No-load flow that the valve was found to pass at a spool opening: m3/s at 1. At the openings of the
            /// table it is the rig's new flow curve, beyond its ends that of the end. EFT_NOT_FINITE for an opening
            /// that is NaN or infinite, and *flow stays. For after a test, not for the interrupt: its cost is not
            /// counted.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $flow(
                config: *const $Config,
                state: *const $State,
                opening: $t,
                flow: *mut $t,
            ) -> u8 {
                let core = given!(config.cast::<Core>());
                let state = given!(state.cast::<CoreState>());
                let flow = given!(mut flow);
                if !opening.is_finite() {
                    return EFT_NOT_FINITE;
                }
                *flow = core.compensation.found_flow(&state.compensation, opening);
                EFT_OK
            }
        }
        pub use $module::*;
    };
}
precision!(
    single, f32, controller: 288, state: 272,
    eft_adaptive_f32 eft_adaptive_state_f32 eft_adaptive_input_f32 eft_output_f32 eft_learned_f32
    eft_adaptive_configure_f32 eft_adaptive_check_f32 eft_adaptive_reset_f32 eft_adaptive_prime_f32
    eft_adaptive_hold_f32 eft_adaptive_missed_f32 eft_adaptive_step_f32
    eft_adaptive_step_ahead_f32
    eft_adaptive_compensation_step_f32 eft_adaptive_compensation_step_ahead_f32
    eft_adaptive_learned_f32 eft_adaptive_flow_f32
);
precision!(
    double, f64, controller: 288, state: 272,
    eft_adaptive_f64 eft_adaptive_state_f64 eft_adaptive_input_f64 eft_output_f64 eft_learned_f64
    eft_adaptive_configure_f64 eft_adaptive_check_f64 eft_adaptive_reset_f64 eft_adaptive_prime_f64
    eft_adaptive_hold_f64 eft_adaptive_missed_f64 eft_adaptive_step_f64
    eft_adaptive_step_ahead_f64
    eft_adaptive_compensation_step_f64 eft_adaptive_compensation_step_ahead_f64
    eft_adaptive_learned_f64 eft_adaptive_flow_f64
);
