//! What the blocks of the interface have alike: opaque words, and the functions that fill and check them.

use crate::status::EFT_OK;

/// [`EFT_OK`], hidden from the caller of a step's inner half: it would otherwise return its own copy of the code
/// instead of jumping into that half.
#[inline(always)]
pub(crate) fn done() -> u8 {
    #[cfg(target_arch = "arm")]
    {
        let mut code = u32::from(EFT_OK);
        // Safety: no instruction at all, so the code is what it was.
        unsafe {
            core::arch::asm!("/* {0} */", inout(reg) code, options(pure, nomem, nostack, preserves_flags));
            core::hint::assert_unchecked(code <= 0xff);
        }
        code as u8
    }
    #[cfg(not(target_arch = "arm"))]
    EFT_OK
}

/// What a pointer points to; null ends the function around with its code.
macro_rules! given {
    (mut $pointer:expr) => {
        // Safety: null or valid, as the crate asks of its callers.
        match unsafe { $pointer.as_mut() } {
            Some(it) => it,
            None => return crate::status::EFT_NULL_POINTER,
        }
    };
    ($pointer:expr) => {
        // Safety: null or valid, as the crate asks of its callers.
        match unsafe { $pointer.as_ref() } {
            Some(it) => it,
            None => return crate::status::EFT_NULL_POINTER,
        }
    };
}

/// A configuration or a state that the caller owns and only the library reads, with room for a core's type: a library
/// with more to keep still fits its caller.
macro_rules! opaque {
    ($(#[$doc:meta])* $Name:ident, [$t:ty; $words:literal] for $Core:ty) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $Name {
            words: [core::mem::MaybeUninit<$t>; $words],
        }
        const _: () = assert!(size_of::<$Name>() >= size_of::<$Core>());
        const _: () = assert!(align_of::<$Name>() >= align_of::<$Core>());
    };
}

/// `configure` and `check` of a configuration that `build` makes of its parameters.
macro_rules! configuration {
    ($Config:ident, $Core:ty, $Parameters:ty, $configure:ident, $check:ident) => {
        /// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
        /// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $configure(
            parameters: *const $Parameters,
            config: *mut $Config,
            why: *mut eft_error,
        ) -> u8 {
            // Safety: null or valid, as the crate asks of its callers.
            let (parameters, why) = unsafe { (parameters.as_ref(), why.as_mut()) };
            let Some(parameters) = parameters else { return EFT_NULL_POINTER };
            if config.is_null() {
                return EFT_NULL_POINTER;
            }
            match build(parameters) {
                Ok(core) => {
                    // Safety: not null, no smaller than the core's type, and aligned (asserted beside it).
                    unsafe { config.cast::<$Core>().write(core) };
                    EFT_OK
                }
                Err(error) => refuse(&error, why),
            }
        }

        /// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
        /// after a memory fault or before it was configured. Not for the interrupt.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $check(config: *const $Config, parameters: *const $Parameters) -> u8 {
            let core = given!(config.cast::<$Core>());
            let parameters = given!(parameters);
            match build(parameters) {
                Ok(made) if made == *core => EFT_OK,
                Ok(_) => EFT_CORRUPT,
                Err(error) => refuse(&error, None),
            }
        }
    };
}

/// `hold` and `missed` of a whole controller, and how its output is given.
macro_rules! held {
    (
        $t:ty, $Config:ident, $Core:ty, $State:ident, $CoreState:ty, $Output:ident, $hold:ident, $missed:ident
    ) => {
        fn give(output: &mut $Output, out: &ControllerOutput<$t>) {
            *output = $Output {
                valve_command: out.valve_command,
                compensation: out.compensation,
                status: out.status,
            };
        }

        /// Repeats the last valve command; the state stays. Behind a protection it has to pass eft_protection_apply as any
        /// other. Of an adaptive controller that misses several ticks give the step a measurement that is NaN instead, so
        /// that nothing is learned of the gap.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $hold(
            config: *const $Config,
            state: *const $State,
            output: *mut $Output,
        ) -> u8 {
            let core = given!(config.cast::<$Core>());
            let state = given!(state.cast::<$CoreState>());
            let output = given!(mut output);
            give(output, &core.hold(state));
            EFT_OK
        }

        /// In place of a tick that was missed: the last valve command stays, and the output says so.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $missed(
            config: *const $Config,
            state: *const $State,
            output: *mut $Output,
        ) -> u8 {
            // Safety: as the caller promises.
            let code = unsafe { $hold(config, state, output) };
            // Safety: null or valid.
            if code == EFT_OK
                && let Some(output) = unsafe { output.as_mut() }
            {
                output.status |= EFT_MISSED_TICK;
            }
            code
        }
    };
}

pub(crate) use {configuration, given, held, opaque};
