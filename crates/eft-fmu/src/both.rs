//! The C functions with the same signature in both versions, under the names of each version.

/// Exports functions on an instance, which call the method after the arrow.
macro_rules! calls {
    ($($name:ident => $method:ident;)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name(c: *mut std::ffi::c_void) -> crate::boundary::Status {
            // SAFETY: the importer passes null or an instance that is not freed.
            unsafe { crate::boundary::with(c, |instance| instance.$method()) }
        }
    )*};
}

/// Exports the functions on states, by the names of get, set, free, size, serialize and deserialize.
macro_rules! states {
    ($get:ident $set:ident $free:ident $size:ident $serialize:ident $deserialize:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $get(c: *mut c_void, state: *mut Address) -> Status {
            // SAFETY: as for every function below: null or an instance that is not freed, and null or
            // pointers by the standard.
            unsafe { boundary::get_state(c, state) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $set(c: *mut c_void, state: Address) -> Status {
            unsafe { boundary::with(c, |instance| instance.set_state(state.cast())) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $free(c: *mut c_void, state: *mut Address) -> Status {
            unsafe { boundary::free_state(c, state) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $size(c: *mut c_void, state: Address, size: *mut usize) -> Status {
            unsafe { boundary::state_size(c, state, size) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $serialize(
            c: *mut c_void,
            state: Address,
            bytes: *mut u8,
            size: usize,
        ) -> Status {
            unsafe { boundary::serialize(c, state, bytes, size) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $deserialize(
            c: *mut c_void,
            bytes: *const u8,
            size: usize,
            state: *mut Address,
        ) -> Status {
            unsafe { boundary::deserialize(c, bytes, size, state) }
        }
    };
}

/// Exports functions that this kind of FMU does not support: they log an error.
macro_rules! without {
    ($($name:ident)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name(c: *mut c_void) -> Status {
            // SAFETY: the importer passes null or an instance that is not freed.
            unsafe { boundary::with(c, |_| Err(boundary::without(stringify!($name)))) }
        }
    )*};
}

pub(crate) use {calls, states, without};
