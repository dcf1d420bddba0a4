//! The variables of an FMU: one table for the description, the checks and the values.

use eft_sim::RigConfig;
use eft_sim::config::{KEYS, Key};

use crate::model::{Part, SINGLE_PRECISION};
use crate::variables::{Role, Type, Variable};

/// Keys that are not parameters of an FMU.
// The step is fixed, the importer realizes a computation delay and delays the command, and the inputs of a feedforward
// must be known in advance.
const FIXED: [&str; 5] = [
    "controller.sample_rate",
    "controller.force_delay",
    "compensation.computation_delay",
    "compensation.feedforward",
    "compensation.look_ahead",
];

/// The table of a part of a rig: time, inputs, outputs, parameters.
pub(crate) fn variables(part: Part, rig: &RigConfig) -> Vec<Variable> {
    let time = ("time", "s", Type::Real, "Time");
    let is_of_part = |key: &&Key| match part {
        Part::Rig => key.is_of_the_plant(),
        Part::Controller => !key.key.starts_with("verdict."),
    };
    let keys = KEYS.iter().filter(is_of_part).filter(|key| !FIXED.contains(&key.key));
    let parameters = keys.filter_map(|key| Variable::parameter(key, rig));
    let precision =
        (part == Part::Controller).then(|| Variable::signal(SINGLE_PRECISION, "", Role::Parameter, 0.0));
    std::iter::once(Variable::signal(time, "", Role::Time, 0.0))
        .chain(part.inputs(rig).variables(rig, Role::Input))
        .chain(part.outputs().variables(rig, Role::Output))
        .chain(parameters)
        .chain(precision)
        .collect()
}
