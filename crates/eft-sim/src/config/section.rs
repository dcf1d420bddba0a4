//! Sections and their values as parts of a tree. Plain code reads them, because a generic deserializer would be compiled
//! again for each of thirty sections.

use eft_core::{Deviations, SavedCalibration, SavedCurve};
use toml::{Table, Value};

/// A value or section that has a place in a tree.
pub(super) trait Entry: Sized {
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

impl Entry for f64 {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_float()
    }

    fn write(&self) -> Option<Value> {
        Some(Value::Float(*self))
    }
}

impl Entry for bool {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_bool()
    }

    fn write(&self) -> Option<Value> {
        Some(Value::Boolean(*self))
    }
}

impl Entry for u32 {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_integer()?.try_into().ok()
    }

    fn write(&self) -> Option<Value> {
        Some(Value::Integer((*self).into()))
    }
}

impl Entry for u64 {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_integer()?.try_into().ok()
    }

    /// A number that TOML has no integer for becomes a float, which the schema refuses.
    fn write(&self) -> Option<Value> {
        Some(i64::try_from(*self).map_or(Value::Float(*self as f64), Value::Integer))
    }
}

impl Entry for String {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_str().map(Self::from)
    }

    fn write(&self) -> Option<Value> {
        Some(Value::String(self.clone()))
    }
}

impl Entry for Vec<f64> {
    fn read(place: Option<&Value>) -> Option<Self> {
        place?.as_array()?.iter().map(Value::as_float).collect()
    }

    fn write(&self) -> Option<Value> {
        Some(numbers(self))
    }
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

/// [`Entry`] for a struct: one key per field.
macro_rules! entry {
    ($name:ty { $($field:ident: $kind:ty),* $(,)? }) => {
        impl $crate::config::section::Entry for $name {
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

/// A struct whose fields are keys of a section.
macro_rules! section {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$doc:meta])* pub $field:ident: $kind:ty,)* }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $($(#[$doc])* pub $field: $kind,)*
        }
        $crate::config::section::entry!($name { $($field: $kind,)* });
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

        impl $name {
            /// All words, in the order of the variants.
            pub const WORDS: &[&str] = &[$($word,)*];
        }

        impl $crate::config::section::Entry for $name {
            fn read(place: Option<&toml::Value>) -> Option<Self> {
                match place?.as_str()? {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }

            fn write(&self) -> Option<toml::Value> {
                Some(toml::Value::String(Self::WORDS.get(*self as usize)?.to_string()))
            }
        }
    };
}

pub(super) use {choice, entry, section};

entry!(SavedCalibration {
    version: u32,
    greatest_flow: f64,
    flow_gain: f64,
    valve_gain: f64,
    response_delay: f64,
    velocity_delay: f64,
    null_offset: f64,
    deviations: Deviations<f64>,
    excitation: f64,
    curve: SavedCurve,
});
entry!(Deviations<f64> {
    flow_gain: f64,
    valve_gain: f64,
    response_delay: f64,
    velocity_delay: f64,
    null_offset: f64,
});
entry!(SavedCurve {
    asymmetry: f64,
    asymmetry_deviation: f64,
    departures: [f64; 17],
    departure_deviations: [f64; 17],
    error: f64,
    flow_gain_share: f64,
});
