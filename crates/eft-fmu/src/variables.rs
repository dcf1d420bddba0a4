//! A variable of an FMU.

use eft_sim::RigConfig;
use eft_sim::config::{Key, Kind};

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Type {
    Real,
    Integer,
    Boolean,
}

/// The role of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Time,
    Input,
    Output,
    Parameter,
}

/// A variable; its reference is its index in the table. Every value is a number; a Boolean is 0 or 1.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) name: String,
    /// SI unit; empty for a quantity without a unit.
    pub(crate) unit: &'static str,
    pub(crate) kind: Type,
    pub(crate) role: Role,
    /// Value before the initialization.
    pub(crate) start: f64,
    /// The key of a parameter in the schema.
    pub(crate) key: Option<&'static Key>,
    pub(crate) doc: &'static str,
}

/// An input or output of a part: name, unit, type, meaning.
pub(crate) type Signal = (&'static str, &'static str, Type, &'static str);

/// Signals per actuator, and common signals.
pub(crate) struct Signals {
    pub(crate) each: Vec<Signal>,
    pub(crate) all: Vec<Signal>,
}

impl Signals {
    /// The variables for a rig. With several actuators an index from 1 in brackets follows the name.
    pub(crate) fn variables(self, rig: &RigConfig, role: Role) -> Vec<Variable> {
        let (Self { each, all }, actuators) = (self, rig.structure.floors());
        let index = |actuator| if actuators == 1 { String::new() } else { format!("[{actuator}]") };
        let numbered =
            (1..=actuators).flat_map(|actuator| each.iter().map(move |one| (*one, index(actuator))));
        let shared = all.iter().map(|one| (*one, String::new()));
        let start = |name| match (role, name) {
            (Role::Input, "supply_pressure") => rig.supply.pressure,
            (Role::Input, "spool") => rig.servovalve.null_bias,
            (Role::Input, "valve_command") => rig.null_command(0),
            _ => 0.0,
        };
        numbered.chain(shared).map(|(one, index)| Variable::signal(one, &index, role, start(one.0))).collect()
    }
}

impl Variable {
    pub(crate) fn signal((name, unit, kind, doc): Signal, index: &str, role: Role, start: f64) -> Self {
        Self { name: format!("{name}{index}"), unit, kind, role, start, key: None, doc }
    }

    /// A key of the configuration as a parameter, if the rig has a value for it.
    pub(crate) fn parameter(key: &'static Key, rig: &RigConfig) -> Option<Self> {
        let value = rig.get(key.key).ok().flatten()?;
        let (kind, start) = match key.kind {
            Kind::Float(..) => (Type::Real, value.as_float()?),
            Kind::Int(..) => (Type::Integer, f64::from(i32::try_from(value.as_integer()?).ok()?)),
            Kind::Bool => (Type::Boolean, f64::from(u8::from(value.as_bool()?))),
            _ => return None,
        };
        let Key { key: name, unit, doc, .. } = *key;
        Some(Self { name: name.to_owned(), unit, kind, role: Role::Parameter, start, key: Some(key), doc })
    }

    /// Least and largest value of a parameter.
    pub(crate) fn range(&self) -> Option<(f64, f64)> {
        match self.key?.kind {
            Kind::Float(low, high) => Some((low, high)),
            Kind::Int(low, high) => Some((low as f64, high.min(i32::MAX.into()) as f64)),
            _ => None,
        }
    }

    /// A value of the parameter for the configuration.
    pub(crate) fn setting(&self, value: f64) -> toml::Value {
        match self.kind {
            Type::Real => value.into(),
            Type::Integer => (value as i64).into(),
            Type::Boolean => (value != 0.0).into(),
        }
    }
}
