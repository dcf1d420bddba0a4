//! The C functions of FMI 2.0 for co-simulation, by the names and types of `fmi2Functions.h`.
//!
//! Functions that this kind of FMU does not support have the instance as only parameter; further arguments of
//! the caller are ignored.
#![allow(non_snake_case, reason = "the standard's names")]
#![allow(clippy::missing_safety_doc, reason = "the standard says what an importer must pass")]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::PathBuf;

use eft_sim::{Error, Result};

use crate::both::{calls, states, without};
use crate::boundary::{self, Address, CATEGORY, Status};
use crate::variables::Type;

/// `fmi2CallbackLogger`.
type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[allow(dead_code, reason = "the memory and the end of a step are the standard's, and not used here")]
#[repr(C)]
pub(crate) struct Callbacks {
    logger: Option<Logger>,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// `fmi2CoSimulation`.
const CO_SIMULATION: c_int = 1;

#[unsafe(no_mangle)]
extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

#[unsafe(no_mangle)]
extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    token: *const c_char,
    resources: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut c_void {
    // SAFETY: the importer passes null or the standard's structure, and null or texts.
    let (callbacks, name, token, resources) = unsafe {
        let name = boundary::text("instanceName", name).unwrap_or_default();
        let resources = boundary::text("fmuResourceLocation", resources);
        (
            callbacks.as_ref(),
            CString::new(name).unwrap_or_default(),
            boundary::text("fmuGUID", token),
            resources,
        )
    };
    let logger = callbacks.and_then(|all| Some((all.logger?, all.environment)));
    let log = Box::new(move |status: Status, message: &CStr| {
        let Some((logger, environment)) = logger else { return };
        // The message is a format for printf.
        let bytes = message.to_bytes().to_vec();
        let format: Vec<u8> =
            bytes.into_iter().flat_map(|one| if one == b'%' { vec![b'%'; 2] } else { vec![one] }).collect();
        let format = CString::new(format).unwrap_or_default();
        // SAFETY: the importer's own function and environment, and texts that outlive the call.
        unsafe { logger(environment, name.as_ptr(), status, CATEGORY.as_ptr(), format.as_ptr()) };
    });
    let resources = resources.and_then(folder).and_then(|folder| match kind {
        CO_SIMULATION => Ok(folder),
        _ => Err(Error::value("fmuType", kind, "must be fmi2CoSimulation")),
    });
    boundary::instantiate(resources, token, log)
}

/// The folder of a URI such as `file:///tmp/an%20fmu/resources`, or `file:///C:/fmu/resources` under Windows.
fn folder(uri: &str) -> Result<PathBuf> {
    let refuse = || Error::value("fmuResourceLocation", uri, "must be a URI of a file, file:///…");
    let (scheme, rest) = uri.split_once(':').ok_or_else(refuse)?;
    if !scheme.eq_ignore_ascii_case("file") {
        return Err(refuse());
    }
    let path = rest.strip_prefix("//localhost").or_else(|| rest.strip_prefix("//")).unwrap_or(rest);
    // The slash before a drive letter is not part of the path.
    let path = if cfg!(windows) { path.strip_prefix('/').unwrap_or(path) } else { path };
    let (mut bytes, mut left) = (Vec::with_capacity(path.len()), path.as_bytes());
    while let [first, rest @ ..] = left {
        let escaped = match rest {
            [high, low, ..] if *first == b'%' => {
                let digits = std::str::from_utf8(&[*high, *low]).map(|digits| u8::from_str_radix(digits, 16));
                Some(digits.ok().and_then(|byte| byte.ok()).ok_or_else(refuse)?)
            }
            _ => None,
        };
        bytes.push(escaped.unwrap_or(*first));
        left = if escaped.is_some() { rest.get(2..).unwrap_or_default() } else { rest };
    }
    String::from_utf8(bytes).map(PathBuf::from).map_err(|_| refuse())
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2FreeInstance(c: *mut c_void) {
    // SAFETY: the importer passes null or an instance that is not freed.
    unsafe { boundary::free(c) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2SetDebugLogging(
    c: *mut c_void,
    _on: c_int,
    _n: usize,
    _names: *const c_void,
) -> Status {
    // SAFETY: as for every function below: null or an instance that is not freed.
    unsafe { boundary::with(c, |_| Ok(())) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2SetupExperiment(
    c: *mut c_void,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    _stop_defined: c_int,
    _stop: f64,
) -> Status {
    unsafe { boundary::with(c, |instance| instance.set_start(start)) }
}

calls! {
    fmi2EnterInitializationMode => enter_initialization;
    fmi2ExitInitializationMode => exit_initialization;
    fmi2Terminate => terminate;
    fmi2Reset => reset;
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2GetReal(c: *mut c_void, vr: *const u32, n: usize, value: *mut f64) -> Status {
    unsafe { boundary::get(c, vr, value, n, Type::Real, |value| value) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2GetInteger(c: *mut c_void, vr: *const u32, n: usize, value: *mut c_int) -> Status {
    unsafe { boundary::get(c, vr, value, n, Type::Integer, |value| value as c_int) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2GetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *mut c_int) -> Status {
    unsafe { boundary::get(c, vr, value, n, Type::Boolean, |value| c_int::from(value != 0.0)) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2SetReal(c: *mut c_void, vr: *const u32, n: usize, value: *const f64) -> Status {
    unsafe { boundary::set(c, vr, value, n, Type::Real, |value| value) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2SetInteger(c: *mut c_void, vr: *const u32, n: usize, value: *const c_int) -> Status {
    unsafe { boundary::set(c, vr, value, n, Type::Integer, f64::from) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2SetBoolean(c: *mut c_void, vr: *const u32, n: usize, value: *const c_int) -> Status {
    unsafe { boundary::set(c, vr, value, n, Type::Boolean, |value: c_int| f64::from(u8::from(value != 0))) }
}

states! {
    fmi2GetFMUstate fmi2SetFMUstate fmi2FreeFMUstate fmi2SerializedFMUstateSize fmi2SerializeFMUstate
    fmi2DeSerializeFMUstate
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2DoStep(c: *mut c_void, time: f64, step: f64, _no_set_prior: c_int) -> Status {
    unsafe { boundary::with(c, |instance| instance.do_step(time, step)) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn fmi2GetRealStatus(c: *mut c_void, kind: c_int, value: *mut f64) -> Status {
    const LAST_SUCCESSFUL_TIME: c_int = 2;
    unsafe {
        boundary::with(c, |instance| match kind {
            LAST_SUCCESSFUL_TIME => {
                *boundary::place("value", value)? = instance.time();
                Ok(())
            }
            _ => Err(Error::value("statusKind", kind, "must be fmi2LastSuccessfulTime")),
        })
    }
}

without! {
    fmi2GetString fmi2SetString fmi2GetDirectionalDerivative fmi2SetRealInputDerivatives
    fmi2GetRealOutputDerivatives fmi2CancelStep fmi2GetStatus fmi2GetIntegerStatus fmi2GetBooleanStatus
    fmi2GetStringStatus
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uri_is_read_to_the_letter() {
        for (uri, path) in [
            ("file:///tmp/a", "/tmp/a"),
            ("file:/tmp/a", "/tmp/a"),
            ("FILE://localhost/tmp/an%20fmu/%C3%A4", "/tmp/an fmu/ä"),
        ] {
            assert_eq!(folder(uri).unwrap(), PathBuf::from(path));
        }
        for uri in ["", "/tmp/a", "http://a", "file:///%zz", "file:///%ff"] {
            assert!(folder(uri).unwrap_err().to_string().contains("must be a URI"), "{uri}");
        }
    }
}
