//! A macro that defines constants of C.

/// Constants of one type.
macro_rules! constants {
    ($t:ty: $($Name:ident = $value:literal, $doc:literal;)*) => {
        $(#[doc = $doc] pub const $Name: $t = $value;)*
    };
}

pub(crate) use constants;
