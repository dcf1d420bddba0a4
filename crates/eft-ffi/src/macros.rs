//! Macros that define structs and functions of C once for both precisions.

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
        unsafe impl<T: eft_core::Real> crate::opaque::Opaque for $Name<T> {
            type Value = $Value;
            const MARKER: u32 = 0x0101_0101 * $marker;
        }
        const _: () = assert!(crate::opaque::fits::<$Name<f32>>() && crate::opaque::fits::<$Name<f64>>());
    )*};
}

/// Functions that return a code. Each has two names: the first for `T = f32`, the second for `T = f64`. A body behind
/// `=` has no `?`.
macro_rules! functions {
    ($($(#[$doc:meta])* fn $single:ident $double:ident($($arguments:tt)*) $($body:block)? $(= $plain:block)?)*) => {$(
        crate::macros::function! { $(#[$doc])* $single f32 ($($body)? $(= $plain)?) [] $($arguments)* }
        crate::macros::function! { $(#[$doc])* $double f64 ($($body)? $(= $plain)?) [] $($arguments)* }
    )*};
}

/// One of them. Its arguments move into the brackets one token at a time, and `T` becomes the precision.
macro_rules! function {
    ($(#[$doc:meta])* $name:ident $precision:ident $body:tt [$($arguments:tt)*]) => {
        $(#[$doc])*
        #[must_use]
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arguments)*) -> u8 {
            crate::macros::coded!$body
        }
    };
    ($(#[$doc:meta])* $name:ident $precision:ident $body:tt [$($before:tt)*] T $($after:tt)*) => {
        crate::macros::function! { $(#[$doc])* $name $precision $body [$($before)* $precision] $($after)* }
    };
    ($(#[$doc:meta])* $name:ident $precision:ident $body:tt [$($before:tt)*] $next:tt $($after:tt)*) => {
        crate::macros::function! { $(#[$doc])* $name $precision $body [$($before)* $next] $($after)* }
    };
}

/// The code of a body.
// A closure is the only scope for `?` within a function. The compiler does not inline a large one.
macro_rules! coded {
    ($body:block) => {{
        // Safety: as the interface requires of its callers.
        let body = || unsafe { $body };
        crate::codes::code(body())
    }};
    (= $body:block) => {
        // Safety: as the interface requires of its callers.
        crate::codes::code(unsafe { $body })
    };
}

pub(crate) use {coded, data, function, functions, opaque};
