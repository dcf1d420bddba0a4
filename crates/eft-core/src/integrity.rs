//! The checksum of a struct: every one of its fields.

/// `integrity!(Type<T>: field, ...)`: every field; one that is left out does not compile.
macro_rules! integrity {
    ($Type:ident: $($field:tt),+) => {
        integrity!(@ [] $Type: $($field),+);
    };
    ($Type:ident<T>: $($field:tt),+) => {
        integrity!(@ [T: $crate::number::Real] $Type<T>: $($field),+);
    };
    ($Type:ident<T, N>: $($field:tt),+) => {
        integrity!(@ [T: $crate::number::Real, const N: usize] $Type<T, N>: $($field),+);
    };
    (@ [$($generics:tt)*] $Type:ty: $($field:tt),+) => {
        impl<$($generics)*> $crate::checksum::Integrity for $Type {
            fn add_to(&self, word: &mut $crate::checksum::Word) {
                let Self { $($field: _),+ } = self;
                $(self.$field.add_to(word);)+
            }
        }
    };
}
pub(crate) use integrity;
