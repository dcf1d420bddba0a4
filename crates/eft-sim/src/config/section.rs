//! Sections and their values as parts of a tree. Plain code reads them, because a generic deserializer would be
//! compiled again for each of thirty sections.

use toml::{Table, Value};

use super::schema::Key;

/// A value or section that has a place in a tree.
pub(super) trait Entry: Sized {
    /// The words of a choice.
    const WORDS: &'static [&'static str] = &[];

    /// Adds the rows of the schema, in the order of written files, for a type that has them of its own.
    fn add_rows(_: &mut Vec<Key>) {}

    /// Reads the value at a place; `None` if it is not a value of this type.
    fn read(place: Option<&Value>) -> Option<Self>;
    /// The value for the place; `None` for an absent option.
    fn write(&self) -> Option<Value>;

    /// The dotted keys of this type at a place.
    #[cfg(test)]
    fn keys(place: &str) -> Vec<String> {
        vec![place.to_owned()]
    }
}

impl<E: Entry> Entry for Option<E> {
    fn add_rows(to: &mut Vec<Key>) {
        E::add_rows(to);
    }

    fn read(place: Option<&Value>) -> Option<Self> {
        if place.is_none() { Some(None) } else { E::read(place).map(Some) }
    }

    fn write(&self) -> Option<Value> {
        self.as_ref().and_then(E::write)
    }

    #[cfg(test)]
    fn keys(place: &str) -> Vec<String> {
        E::keys(place)
    }
}

/// [`Entry`] for types that TOML has: how to read and write one.
macro_rules! plain {
    ($($kind:ty: $read:expr, $write:expr;)*) => {$(
        impl Entry for $kind {
            fn read(place: Option<&Value>) -> Option<Self> {
                place.and_then($read)
            }

            fn write(&self) -> Option<Value> {
                let write: fn(&Self) -> Value = $write;
                Some(write(self))
            }
        }
    )*};
}

plain! {
    f64: Value::as_float, |number| Value::Float(*number);
    bool: Value::as_bool, |on| Value::Boolean(*on);
    u32: |value| value.as_integer()?.try_into().ok(), |count| Value::Integer((*count).into());
    // A number that TOML has no integer for becomes a float, which the schema refuses.
    u64: |value| value.as_integer()?.try_into().ok(),
        |seed| i64::try_from(*seed).map_or(Value::Float(*seed as f64), Value::Integer);
    String: |value| value.as_str().map(Self::from), |text| Value::String(text.clone());
    Vec<f64>: |value| value.as_array()?.iter().map(Value::as_float).collect(), |list| numbers(list);
}

impl<const N: usize> Entry for [f64; N] {
    fn read(place: Option<&Value>) -> Option<Self> {
        Vec::read(place)?.try_into().ok()
    }

    fn write(&self) -> Option<Value> {
        Some(numbers(self))
    }
}

fn numbers(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|value| Value::Float(*value)).collect())
}

/// Adds a value to a section, if it is there.
pub(super) fn add(section: &mut Table, name: &str, value: Option<Value>) {
    if let Some(value) = value {
        section.insert(name.to_owned(), value);
    }
}

/// Adds the rows of a field: its own row, the rows that are given for it, or those of its type. They are constants,
/// because code that makes each would be large.
macro_rules! add_rows {
    ($to:ident, $key:expr, $kind:ty) => {
        <$kind as $crate::config::section::Entry>::add_rows($to)
    };
    ($to:ident, $key:expr, $kind:ty, { $rows:expr }) => {
        $to.extend_from_slice(const { $rows })
    };
    ($to:ident, $key:expr, $kind:ty, $unit:tt, $range:expr, $need:expr, $about:literal) => {
        $to.extend_from_slice(const { &[$crate::config::schema::key($key, $unit, $range, $need, $about)] })
    };
}

/// [`Entry`] for a struct: one key per field, after the section's. A field with a unit, range, need and meaning has its
/// own row of the schema.
macro_rules! entry {
    ($name:ty, $section:literal {
        $($field:ident: $kind:ty $(= $unit:tt, $range:expr, $need:expr, $about:literal)? $({ $rows:expr })?;)*
    }) => {
        impl $crate::config::section::Entry for $name {
            fn add_rows(to: &mut Vec<$crate::config::schema::Key>) {
                $($crate::config::section::add_rows!(
                    to, concat!($section, stringify!($field)), $kind $(, $unit, $range, $need, $about)? $(, { $rows })?
                );)*
            }

            fn read(place: Option<&toml::Value>) -> Option<Self> {
                let section = place?.as_table()?;
                Some(Self {
                    $($field: $crate::config::section::Entry::read(section.get(stringify!($field)))?,)*
                })
            }

            fn write(&self) -> Option<toml::Value> {
                let mut section = toml::Table::new();
                $($crate::config::section::add(&mut section, stringify!($field), self.$field.write());)*
                Some(toml::Value::Table(section))
            }

            #[cfg(test)]
            fn keys(place: &str) -> Vec<String> {
                let below = |name| if place.is_empty() { String::from(name) } else { format!("{place}.{name}") };
                [$(<$kind>::keys(&below(stringify!($field)))),*].concat()
            }
        }
    };
}

/// A meaning with its unit, for the documentation.
macro_rules! in_unit {
    ($about:literal, "") => {
        $about
    };
    ($about:literal, $unit:literal) => {
        concat!($about, ", ", $unit)
    };
}

/// A struct whose fields are keys of a section, or sections; see [`entry`].
macro_rules! section {
    ($(#[$about:meta])* pub struct $name:ident in $section:literal {
        $($(#[$doc:meta])* $field:ident: $kind:ty
            $(= $unit:tt, $range:expr, $need:expr, $meaning:literal)? $({ $rows:expr })?;)*
    }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $($(#[$doc])* $(#[doc = $crate::config::section::in_unit!($meaning, $unit)])? pub $field: $kind,)*
        }
        $crate::config::section::entry!($name, $section {
            $($field: $kind $(= $unit, $range, $need, $meaning)? $({ $rows })?;)*
        });
    };
}

/// [`Entry`] for an enum whose variants are words of the configuration.
macro_rules! words {
    ($name:ident { $($variant:ident = $word:literal),* $(,)? }) => {
        impl $crate::config::section::Entry for $name {
            const WORDS: &'static [&'static str] = &[$($word),*];

            fn read(place: Option<&toml::Value>) -> Option<Self> {
                match place?.as_str()? {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }

            fn write(&self) -> Option<toml::Value> {
                let word = match self {
                    $(Self::$variant => $word,)*
                };
                Some(toml::Value::String(word.to_owned()))
            }
        }
    };
}

/// An enum whose variants are words of the configuration.
macro_rules! choice {
    ($(#[$about:meta])* pub enum $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[$doc])* $variant,)*
        }

        $crate::config::section::words!($name { $($variant = $word),* });
    };
}

pub(super) use {add_rows, choice, entry, in_unit, section, words};
