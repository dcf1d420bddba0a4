//! The interface as tables: what a constant or a field is called, its value or type, and what the header says of it.

/// Constants of one type.
macro_rules! constants {
    ($t:ty: $($Name:ident = $value:literal, $doc:literal;)*) => {
        $(#[doc = $doc] pub const $Name: $t = $value;)*
    };
}

/// Bits of a status, each held against the core's.
macro_rules! flags {
    ($($Name:ident = $bit:literal, $Core:ident, $doc:literal;)*) => {
        $(#[doc = $doc] pub const $Name: u32 = 1u32 << $bit;)*
        const _: () = { $(assert!($Name == eft_core::status::$Core);)* };
    };
}

/// Causes of a trip, each held against the core's.
macro_rules! causes {
    ($($Name:ident = $value:literal, $Core:ident, $doc:literal;)*) => {
        $(#[doc = $doc] pub const $Name: u8 = $value;)*
        const _: () = { $(assert!($Name == eft_core::Cause::$Core as u8);)* };
    };
}

/// A struct of plain data.
macro_rules! data {
    ($(#[$doc:meta])* $Name:ident { $($field:ident: $t:ty, $field_doc:literal;)* }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $Name {
            $(#[doc = $field_doc] pub $field: $t,)*
        }
    };
}

/// Functions that return a code.
macro_rules! functions {
    ($($(#[$doc:meta])* fn $name:ident($($arg:ident: $t:ty),*) $body:block)*) => {$(
        $(#[$doc])*
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $t),*) -> u8 {
            // Safety: as the interface asks of its callers.
            crate::codes::returned(|| unsafe { $body })
        }
    )*};
}

/// Opaque structs, each with its size in words of eight bytes, its marker (a byte, repeated) and what is behind it.
macro_rules! opaque {
    ($($(#[$doc:meta])* $Name:ident, $words:literal, $marker:literal, $Value:ty;)*) => {$(
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $Name {
            words: [core::mem::MaybeUninit<u64>; $words],
        }
        // Safety: asserted below.
        unsafe impl crate::place::Opaque for $Name {
            type Value = $Value;
            const MARKER: u32 = 0x0101_0101 * $marker;
        }
        const _: () = {
            use crate::place::Marked;
            assert!(size_of::<$Name>() >= size_of::<Marked<$Value>>());
            assert!(align_of::<$Name>() >= align_of::<Marked<$Value>>());
        };
    )*};
}

pub(crate) use {causes, constants, data, flags, functions, opaque};
