//! The variables of an FMU: one table for the description, the checks and the values.

use eft_sim::RigConfig;
use eft_sim::config::{KEYS, Key, Kind};

use crate::model::{Part, SINGLE_PRECISION};

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Type {
    Real,
    Integer,
    Boolean,
}

/// What a variable is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Time,
    Input,
    Output,
    Parameter,
}

/// A variable; its reference is its place in the table. Every value is a number: 0 and 1 of a Boolean.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) name: &'static str,
    /// SI unit; empty for a quantity without a unit.
    pub(crate) unit: &'static str,
    pub(crate) kind: Type,
    pub(crate) role: Role,
    /// Value before the initialization; of an output what it is until then.
    pub(crate) start: f64,
    /// What a parameter's key says of it.
    pub(crate) key: Option<&'static Key>,
    pub(crate) doc: &'static str,
}

/// An input or an output as the parts list them: name, unit, type, meaning.
pub(crate) type Signal = (&'static str, &'static str, Type, &'static str);

impl Variable {
    fn signal((name, unit, kind, doc): Signal, role: Role, start: f64) -> Self {
        Self { name, unit, kind, role, start, key: None, doc }
    }

    /// A key of the configuration as a parameter, where the rig has a value for it.
    fn parameter(key: &'static Key, rig: &RigConfig) -> Option<Self> {
        let value = rig.get(key.key).ok().flatten()?;
        let (kind, start) = match key.kind {
            Kind::Float(..) => (Type::Real, value.as_float()?),
            Kind::Int(..) => (Type::Integer, f64::from(i32::try_from(value.as_integer()?).ok()?)),
            Kind::Bool => (Type::Boolean, f64::from(u8::from(value.as_bool()?))),
            _ => return None,
        };
        let Key { key: name, unit, doc, .. } = *key;
        Some(Self { name, unit, kind, role: Role::Parameter, start, key: Some(key), doc })
    }

    /// Least and largest value of a parameter.
    pub(crate) fn range(&self) -> Option<(f64, f64)> {
        match self.key?.kind {
            Kind::Float(low, high) => Some((low, high)),
            Kind::Int(low, high) => Some((low as f64, high.min(i32::MAX.into()) as f64)),
            _ => None,
        }
    }

    /// A value of it for the configuration.
    pub(crate) fn setting(&self, value: f64) -> toml::Value {
        match self.kind {
            Type::Real => value.into(),
            Type::Integer => (value as i64).into(),
            Type::Boolean => (value != 0.0).into(),
        }
    }
}

/// Keys that an FMU has no parameter for.
// The step is fixed, a computation delay is the importer's, and the inputs that a feedforward needs must be known before.
const FIXED: [&str; 4] = [
    "controller.sample_rate",
    "compensation.computation_delay",
    "compensation.feedforward",
    "compensation.look_ahead",
];

/// The table of a part of a rig: time, inputs, outputs, parameters.
pub(crate) fn variables(part: Part, rig: &RigConfig) -> Vec<Variable> {
    let time = ("time", "s", Type::Real, "Time");
    let start = |name| if name == "supply_pressure" { rig.supply.pressure } else { 0.0 };
    let inputs = part.inputs(rig).into_iter().map(|row| Variable::signal(row, Role::Input, start(row.0)));
    let outputs = part.outputs().into_iter().map(|row| Variable::signal(row, Role::Output, 0.0));
    let is_of_part = |key: &&Key| match part {
        Part::Rig => key.is_of_the_plant(),
        Part::Controller => !key.key.starts_with("verdict."),
    };
    let keys = KEYS.iter().filter(is_of_part).filter(|key| !FIXED.contains(&key.key));
    let parameters = keys.filter_map(|key| Variable::parameter(key, rig));
    let precision =
        (part == Part::Controller).then(|| Variable::signal(SINGLE_PRECISION, Role::Parameter, 0.0));
    std::iter::once(Variable::signal(time, Role::Time, 0.0))
        .chain(inputs)
        .chain(outputs)
        .chain(parameters)
        .chain(precision)
        .collect()
}
