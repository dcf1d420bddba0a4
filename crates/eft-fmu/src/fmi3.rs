//! The C functions of FMI 3.0 for co-simulation, by the names and types of `fmi3Functions.h`.
//!
//! Functions that this kind of FMU does not support have the instance as only parameter; further arguments of
//! the caller are ignored.
#![allow(non_snake_case, reason = "the standard's names")]
#![allow(clippy::missing_safety_doc, reason = "the standard says what an importer must pass")]

use std::ffi::{CStr, c_char, c_void};
use std::path::PathBuf;

use crate::both::{calls, states, without};
use crate::boundary::{self, Address, CATEGORY, Status};
use crate::variables::Type;

/// `fmi3LogMessageCallback`.
type Logger = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);

#[unsafe(no_mangle)]
extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    _event_mode_used: bool,
    _early_return_allowed: bool,
    _intermediate_variables: *const u32,
    _n_intermediate_variables: usize,
    environment: *mut c_void,
    logger: Option<Logger>,
    _intermediate_update: *const c_void,
) -> *mut c_void {
    let log = Box::new(move |status: Status, message: &CStr| {
        let Some(logger) = logger else { return };
        // SAFETY: the importer's own function and environment, and texts that outlive the call.
        unsafe { logger(environment, status, CATEGORY.as_ptr(), message.as_ptr()) };
    });
    // SAFETY: the importer passes null or texts.
    let (resources, token) =
        unsafe { (boundary::text("resourcePath", resources), boundary::text("instantiationToken", token)) };
    boundary::instantiate(resources.map(PathBuf::from), token, log)
}

macro_rules! no_instance {
    ($($name:ident)*) => {$(
        #[unsafe(no_mangle)]
        extern "C" fn $name() -> *mut c_void {
            std::ptr::null_mut()
        }
    )*};
}
no_instance! { fmi3InstantiateModelExchange fmi3InstantiateScheduledExecution }

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3FreeInstance(c: *mut c_void) {
    // SAFETY: the importer passes null or an instance that is not freed.
    unsafe { boundary::free(c) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3SetDebugLogging(
    c: *mut c_void,
    _on: bool,
    _n: usize,
    _names: *const c_void,
) -> Status {
    // SAFETY: as for every function below: null or an instance that is not freed.
    unsafe { boundary::with(c, |_| Ok(())) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3EnterInitializationMode(
    c: *mut c_void,
    _tolerance_defined: bool,
    _tolerance: f64,
    start: f64,
    _stop_defined: bool,
    _stop: f64,
) -> Status {
    unsafe {
        boundary::with(c, |instance| {
            instance.set_start(start)?;
            instance.enter_initialization()
        })
    }
}

calls! {
    fmi3ExitInitializationMode => exit_initialization;
    fmi3Terminate => terminate;
    fmi3Reset => reset;
}

macro_rules! values {
    ($($get:ident $set:ident $t:ty, $kind:ident, $out:expr, $into:expr;)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $get(
            c: *mut c_void,
            vr: *const u32,
            n: usize,
            value: *mut $t,
            n_values: usize,
        ) -> Status {
            match boundary::same_count(n, n_values) {
                Ok(()) => unsafe { boundary::get(c, vr, value, n, Type::$kind, $out) },
                Err(error) => unsafe { boundary::with(c, |_| Err(error)) },
            }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $set(
            c: *mut c_void,
            vr: *const u32,
            n: usize,
            value: *const $t,
            n_values: usize,
        ) -> Status {
            match boundary::same_count(n, n_values) {
                Ok(()) => unsafe { boundary::set(c, vr, value, n, Type::$kind, $into) },
                Err(error) => unsafe { boundary::with(c, |_| Err(error)) },
            }
        }
    )*};
}
values! {
    fmi3GetFloat64 fmi3SetFloat64 f64, Real, |value| value, |value| value;
    fmi3GetInt32 fmi3SetInt32 i32, Integer, |value| value as i32, f64::from;
    // A byte instead of a bool, because values other than 0 and 1 are invalid in a bool.
    fmi3GetBoolean fmi3SetBoolean u8, Boolean, |value| u8::from(value != 0.0), |value: u8| f64::from(u8::from(value != 0));
}

states! {
    fmi3GetFMUState fmi3SetFMUState fmi3FreeFMUState fmi3SerializedFMUStateSize fmi3SerializeFMUState
    fmi3DeserializeFMUState
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3EnterStepMode(c: *mut c_void) -> Status {
    unsafe { boundary::with(c, |_| Ok(())) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi3DoStep(
    c: *mut c_void,
    time: f64,
    step: f64,
    _no_set_prior: bool,
    event_handling_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_successful_time: *mut f64,
) -> Status {
    unsafe {
        boundary::with(c, |instance| {
            // Null if the importer does not need the value.
            for place in [event_handling_needed, terminate, early_return] {
                if let Some(answer) = place.as_mut() {
                    *answer = false;
                }
            }
            let result = instance.do_step(time, step);
            if let Some(reached) = last_successful_time.as_mut() {
                *reached = instance.time();
            }
            result
        })
    }
}

without! {
    fmi3EnterEventMode fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetUInt32 fmi3GetInt64
    fmi3GetUInt64 fmi3GetString fmi3GetBinary fmi3GetClock fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16
    fmi3SetUInt16 fmi3SetUInt32 fmi3SetInt64 fmi3SetUInt64 fmi3SetString fmi3SetBinary fmi3SetClock
    fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies fmi3GetDirectionalDerivative
    fmi3GetAdjointDerivative fmi3EnterConfigurationMode fmi3ExitConfigurationMode fmi3GetIntervalDecimal
    fmi3GetIntervalFraction fmi3GetShiftDecimal fmi3GetShiftFraction fmi3SetIntervalDecimal fmi3SetIntervalFraction
    fmi3SetShiftDecimal fmi3SetShiftFraction fmi3EvaluateDiscreteStates fmi3UpdateDiscreteStates
    fmi3EnterContinuousTimeMode fmi3CompletedIntegratorStep fmi3SetTime fmi3SetContinuousStates
    fmi3GetContinuousStateDerivatives fmi3GetEventIndicators fmi3GetContinuousStates
    fmi3GetNominalsOfContinuousStates fmi3GetNumberOfEventIndicators fmi3GetNumberOfContinuousStates
    fmi3GetOutputDerivatives fmi3ActivateModelPartition
}
