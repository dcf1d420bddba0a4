//! Keys that are set but have no effect with the other values.
//!
//! They are not errors, because a study may vary one key without the other.

use toml::{Table, Value};

use super::tree;

/// Each key that has no effect until another key has a value, with that key and the value.
const NEEDS: [(&str, &str, &str); 19] = [
    ("compensation.look_ahead", "compensation.feedforward", "true"),
    ("calibration.flow_gain", "compensation.adaptive", "true"),
    ("controller.integral_gain", "controller.realization", "digital"),
    ("protection.force_warning", "protection.enabled", "true"),
    ("protection.force_trip", "protection.enabled", "true"),
    ("protection.displacement_warning", "protection.enabled", "true"),
    ("protection.displacement_trip", "protection.enabled", "true"),
    ("protection.velocity_warning", "protection.enabled", "true"),
    ("protection.velocity_trip", "protection.enabled", "true"),
    ("protection.spool_warning", "protection.enabled", "true"),
    ("protection.spool_trip", "protection.enabled", "true"),
    ("protection.start_time", "protection.enabled", "true"),
    ("protection.soft_end", "protection.enabled", "true"),
    ("protection.stuck_samples", "protection.enabled", "true"),
    ("protection.oscillation_limit", "protection.enabled", "true"),
    ("protection.load_pressure_tolerance", "protection.enabled", "true"),
    ("protection.load_pressure_tolerance", "protection.plausibility", "true"),
    ("protection.fault_time", "protection.enabled", "true"),
    ("protection.fault_time", "compensation.adaptive", "true"),
];

/// The idle keys of a complete tree, with what each needs.
pub(super) fn idle_keys(whole: &Table) -> Vec<String> {
    let set = |key| match tree::get(whole, key) {
        None | Some(Value::Boolean(false) | Value::Integer(0)) => false,
        Some(Value::Float(number)) => *number != 0.0,
        Some(_) => true,
    };
    let value_of = |key| match tree::get(whole, key) {
        Some(Value::String(word)) => word.clone(),
        other => other.map(ToString::to_string).unwrap_or_default(),
    };
    let idle = NEEDS.iter().filter(|(key, needed, value)| set(key) && value_of(needed) != *value);
    idle.map(|(key, needed, value)| format!("{key} needs {needed} = {value}")).collect()
}
