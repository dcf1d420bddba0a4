//! Keys that are set but have no effect with the other values.

use std::fmt;

use toml::{Table, Value};

use super::tree;

/// A key that is set but has no effect until another key has one of certain values.
///
/// This is not an error, because a study may vary one key without the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdleKey {
    /// The key without effect.
    pub key: &'static str,
    /// The other key.
    pub needs: &'static str,
    /// Values of the other key with which the key has an effect.
    pub values: &'static [&'static str],
}

const fn idle(key: &'static str, needs: &'static str, values: &'static [&'static str]) -> IdleKey {
    IdleKey { key, needs, values }
}

const ON: &[&str] = &["true"];
const NEEDS: &[IdleKey] = &[
    idle("compensation.look_ahead", "compensation.feedforward", ON),
    idle("calibration.flow_gain", "compensation.adaptive", ON),
    idle("controller.integral_gain", "controller.realization", &["digital"]),
    idle("protection.force_warning", "protection.enabled", ON),
    idle("protection.force_trip", "protection.enabled", ON),
    idle("protection.displacement_warning", "protection.enabled", ON),
    idle("protection.displacement_trip", "protection.enabled", ON),
    idle("protection.velocity_warning", "protection.enabled", ON),
    idle("protection.velocity_trip", "protection.enabled", ON),
    idle("protection.spool_warning", "protection.enabled", ON),
    idle("protection.spool_trip", "protection.enabled", ON),
    idle("protection.start_time", "protection.enabled", ON),
    idle("protection.soft_end", "protection.enabled", ON),
    idle("protection.stuck_samples", "protection.enabled", ON),
    idle("protection.oscillation_limit", "protection.enabled", ON),
    idle("protection.load_pressure_tolerance", "protection.enabled", ON),
    idle("protection.load_pressure_tolerance", "protection.plausibility", ON),
    idle("protection.fault_time", "protection.enabled", ON),
    idle("protection.fault_time", "compensation.adaptive", ON),
];

impl fmt::Display for IdleKey {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{} needs {} = {}", self.key, self.needs, self.values.join(" or "))
    }
}

/// The idle keys of a complete tree.
pub(super) fn idle_keys(whole: &Table) -> Vec<IdleKey> {
    let set = |key| match tree::get(whole, key) {
        None | Some(Value::Boolean(false) | Value::Integer(0)) => false,
        Some(Value::Float(number)) => *number != 0.0,
        Some(_) => true,
    };
    let value_of = |key| match tree::get(whole, key) {
        Some(Value::String(word)) => word.clone(),
        other => other.map(ToString::to_string).unwrap_or_default(),
    };
    let is_idle = |idle: &&IdleKey| set(idle.key) && !idle.values.contains(&value_of(idle.needs).as_str());
    NEEDS.iter().filter(is_idle).copied().collect()
}
