//! Macros that define constants, structs and functions of C once for both precisions.

/// Constants of one type.
macro_rules! constants {
    ($t:ty: $($Name:ident = $value:literal, $doc:literal;)*) => {
        $(#[doc = $doc] pub const $Name: $t = $value;)*
    };
}

/// A struct of plain data, with the header's comment on each field.
macro_rules! data {
    ($(#[$doc:meta])* $Name:ident $(<$T:ident: $Bound:ident>)? { $($field:ident: $t:ty, $field_doc:literal;)* }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $Name $(<$T: $Bound>)? {
            $(#[doc = $field_doc] pub $field: $t,)*
        }
    };
}

/// Opaque structs, each with its size in numbers of its precision, its marker (a byte, repeated) and its value.
macro_rules! opaque {
    ($($(#[$doc:meta])* $Name:ident[$size:literal], $marker:literal, $Value:ty;)*) => {$(
        $(#[$doc])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy)]
        pub struct $Name<T: Copy> {
            marker: core::mem::MaybeUninit<u64>,
            value: [core::mem::MaybeUninit<T>; $size],
        }
        // Safety: asserted below.
        unsafe impl<T: eft_core::Real> crate::place::Opaque for $Name<T> {
            type Value = $Value;
            const MARKER: u32 = 0x0101_0101 * $marker;
        }
        const _: () = assert!(crate::place::fits::<$Name<f32>>() && crate::place::fits::<$Name<f64>>());
    )*};
}

/// Functions that return a code. Each has two names: the first for `T = f32`, the second for `T = f64`.
macro_rules! functions {
    ($($(#[$doc:meta])* fn $single:ident $double:ident($($arguments:tt)*) $body:block)*) => {$(
        crate::tables::function! { $(#[$doc])* $single f32 $body [] $($arguments)* }
        crate::tables::function! { $(#[$doc])* $double f64 $body [] $($arguments)* }
    )*};
}

/// One of them. Its arguments move into the brackets one token at a time, and `T` becomes the precision.
macro_rules! function {
    ($(#[$doc:meta])* $name:ident $precision:ident $body:block [$($arguments:tt)*]) => {
        $(#[$doc])*
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arguments)*) -> u8 {
            // Safety: as the interface requires of its callers.
            crate::codes::returned(|| unsafe { $body })
        }
    };
    ($(#[$doc:meta])* $name:ident $precision:ident $body:block [$($before:tt)*] T $($after:tt)*) => {
        crate::tables::function! { $(#[$doc])* $name $precision $body [$($before)* $precision] $($after)* }
    };
    ($(#[$doc:meta])* $name:ident $precision:ident $body:block [$($before:tt)*] $next:tt $($after:tt)*) => {
        crate::tables::function! { $(#[$doc])* $name $precision $body [$($before)* $next] $($after)* }
    };
}

pub(crate) use {constants, data, function, functions, opaque};
