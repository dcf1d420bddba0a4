//! The rows of the schema.

use eft_core::Short;

/// One value of the configuration.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Dotted key, as in TOML and in `replace`.
    pub key: &'static str,
    /// SI unit; empty for a quantity without a unit.
    pub unit: &'static str,
    /// Type and allowed range.
    pub kind: Kind,
    /// Whether the value must be given.
    pub need: Need,
    /// Meaning in one line, with the paper's symbol.
    pub doc: &'static str,
}

/// Type and allowed range of a value.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A finite number between two inclusive bounds; integers are accepted.
    Float(f64, f64),
    /// A whole number between two inclusive bounds.
    Int(i64, i64),
    /// `true` or `false`.
    Bool,
    /// One of some words.
    Choice(&'static [&'static str]),
    /// Free text.
    Text,
    /// A list of numbers with the least and the largest length, each number between two inclusive bounds.
    Floats(usize, usize, f64, f64),
}

/// Whether a value must be given.
#[derive(Clone, Copy, Debug)]
pub enum Need {
    /// It must.
    Required,
    /// It must be given if another key has a certain value.
    When(&'static str, &'static str),
    /// It must be given unless another key has a certain value, with which it has no effect.
    Unless(&'static str, &'static str),
    /// It may be left out; this is its default.
    Default(Preset),
    /// It may be left out; the rig then does not have the effect.
    Optional,
}

/// A default value.
#[derive(Clone, Copy, Debug)]
pub enum Preset {
    /// A number.
    Float(f64),
    /// A whole number.
    Int(i64),
    /// A switch.
    Bool(bool),
    /// A word.
    Text(&'static str),
}

/// Sections that describe the plant, its sensors and its converter. Only their keys may be under `truth`.
pub(super) const PLANT: [&str; 6] = ["actuator", "supply", "servovalve", "structure", "sensors", "dac"];

/// A row of the schema.
pub(super) const fn key(
    key: &'static str,
    unit: &'static str,
    kind: Kind,
    need: Need,
    doc: &'static str,
) -> Key {
    Key { key, unit, kind, need, doc }
}

/// A number that is used if none is given.
pub(super) const fn float(value: f64) -> Need {
    Need::Default(Preset::Float(value))
}

/// A whole number that is used if none is given.
pub(super) const fn int(value: i64) -> Need {
    Need::Default(Preset::Int(value))
}

/// A word that is used if none is given.
pub(super) const fn word(value: &'static str) -> Need {
    Need::Default(Preset::Text(value))
}

/// A switch that is off if it is not given.
pub(super) const OFF: Need = Need::Default(Preset::Bool(false));
/// A switch that is on if it is not given.
pub(super) const ON: Need = Need::Default(Preset::Bool(true));

impl Key {
    /// Whether the key describes the plant, and may also be under `truth`.
    pub fn is_of_the_plant(&self) -> bool {
        self.key.split_once('.').is_some_and(|(section, _)| PLANT.contains(&section))
    }

    /// The allowed values of the key, as a phrase for error messages and documents.
    pub fn allowed(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.kind {
            Kind::Float(low, high) => {
                format!("must be a number between {} and {}{unit}", Short(low), Short(high))
            }
            Kind::Int(low, i64::MAX) => format!("must be a whole number of at least {low}{unit}"),
            Kind::Int(low, high) if low == high => format!("must be {low}{unit}"),
            Kind::Int(low, high) => format!("must be a whole number between {low} and {high}{unit}"),
            Kind::Bool => "must be true or false".into(),
            Kind::Choice(words) => {
                let quoted: Vec<_> = words.iter().map(|word| format!("\"{word}\"")).collect();
                format!("must be one of {}", quoted.join(", "))
            }
            Kind::Text => "must be a string".into(),
            Kind::Floats(least, most, low, high) => {
                let (low, high) = (Short(low), Short(high));
                let count = if least == most { most.to_string() } else { format!("{least} to {most}") };
                format!("must be a list of {count} numbers between {low} and {high}{unit}")
            }
        }
    }

    /// The meaning with its unit: "piston area A, m²".
    pub fn meaning(&self) -> String {
        if self.unit.is_empty() { self.doc.to_owned() } else { format!("{}, {}", self.doc, self.unit) }
    }
}

impl Preset {
    /// The default as a configuration value.
    pub(crate) fn value(self) -> toml::Value {
        match self {
            Self::Float(value) => toml::Value::Float(value),
            Self::Int(value) => toml::Value::Integer(value),
            Self::Bool(value) => toml::Value::Boolean(value),
            Self::Text(value) => toml::Value::String(value.to_owned()),
        }
    }
}
