//! The rig's configuration: one schema for TOML, dictionaries and dotted keys.
//!
//! [`KEYS`] is the schema: key, unit, range, default and meaning of every value. The structs of
//! this module hold the values; a test keeps the two equal. A new effect of the rig is one struct
//! field and one row.

mod check;
mod idle;
mod keys;
mod schema;
mod sections;
mod text;
mod tree;
mod zhao2005;

pub use idle::IdleKey;
pub use keys::KEYS;
pub use schema::{Key, Kind, Need, Preset};
pub use sections::{
    Actuator, BoucWen, Compensation, Controller, Dac, FaultKind, FaultSignal, FlowCurve, Limits, Mode,
    PowerDamper, Protection, Realization, Sensor, SensorFault, Sensors, Servovalve, SignFrom, Softening,
    Stories, Structure, StructureKind, Supply, SupplySchedule, ValveLeakage, VelocitySource,
};

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// A whole rig: plant, controller, sensors and limits, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigConfig {
    /// A name for reports and exported files.
    pub name: Option<String>,
    /// The actuator.
    pub actuator: Actuator,
    /// The hydraulic supply.
    pub supply: Supply,
    /// The servovalve as it truly is.
    pub servovalve: Servovalve,
    /// The servovalve controller, Eq. (1).
    pub controller: Controller,
    /// The velocity feedback compensation as the controller knows it.
    pub compensation: Compensation,
    /// The test structure, Fig. 7.
    pub structure: Structure,
    /// What the sensors do to the signals; ideal by default.
    pub sensors: Sensors,
    /// What the converter does to the controller's output; ideal by default.
    pub dac: Option<Dac>,
    /// Protection of the specimen; none by default.
    pub protection: Protection,
    /// Limits and plausible measurement ranges; none by default.
    pub limits: Limits,
}

impl RigConfig {
    /// Reads a configuration from TOML text.
    ///
    /// # Errors
    /// [`Error::Toml`] with line and column for malformed text, otherwise as [`Self::from_tree`].
    pub fn from_toml(text: &str) -> Result<Self> {
        Self::from_tree(text::parse(text)?)
    }

    /// Reads a configuration file.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::File`] naming the file, otherwise as [`Self::from_tree`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = text::read(path)?;
        Self::from_toml(&text).map_err(|error| match error {
            Error::Toml(message) => Error::File { path: path.into(), message },
            other => other,
        })
    }

    /// The configuration as TOML text; [`Self::from_toml`] gives the same configuration back.
    pub fn to_toml(&self) -> String {
        text::write(&self.to_tree(), false)
    }

    /// As [`Self::to_toml`], with unit, range and meaning of every key beside it.
    pub fn to_commented_toml(&self) -> String {
        text::write(&self.to_tree(), true)
    }

    /// Builds a configuration from a tree of sections, filling in the defaults of [`KEYS`].
    ///
    /// # Errors
    /// [`Error::UnknownKey`], [`Error::MissingKey`] or [`Error::Value`], each naming the dotted key.
    pub fn from_tree(tree: toml::Table) -> Result<Self> {
        let complete = check::complete(tree)?;
        // The check above has settled names, types and ranges; what serde still refuses is a
        // disagreement between KEYS and the structs.
        Self::deserialize(toml::Value::Table(complete))
            .map_err(|error| Error::Toml(error.message().to_owned()))
    }

    /// The configuration as a tree of sections, defaults included.
    pub fn to_tree(&self) -> toml::Table {
        // Plain structs of numbers, strings and lists always serialize; an integer that TOML
        // cannot hold (a seed above 2^63) is the only exception and is left to `validate`.
        toml::Table::try_from(self).unwrap_or_default()
    }

    /// A new configuration with some values replaced; keys are dotted, values may be sections.
    ///
    /// # Errors
    /// As [`Self::from_tree`]; all replacements are made before anything is checked.
    pub fn replace<K: AsRef<str>>(&self, changes: &[(K, toml::Value)]) -> Result<Self> {
        self.edit(&[], changes)
    }

    /// A new configuration without some optional values (those with a default return to it).
    ///
    /// # Errors
    /// As [`Self::from_tree`]; [`Error::UnknownKey`] for a key that the schema does not know.
    pub fn without<K: AsRef<str>>(&self, keys: &[K]) -> Result<Self> {
        self.edit(keys, &[])
    }

    /// [`Self::without`] and [`Self::replace`] in one, checked once after both.
    ///
    /// # Errors
    /// As those.
    pub fn edit<K: AsRef<str>>(&self, removed: &[K], changes: &[(K, toml::Value)]) -> Result<Self> {
        let mut tree = self.to_tree();
        for key in removed {
            tree::remove(&mut tree, key.as_ref())?;
        }
        for (key, value) in changes {
            tree::set(&mut tree, key.as_ref(), value.clone())?;
        }
        Self::from_tree(tree)
    }

    /// The value or section at a dotted key, if it is present.
    ///
    /// # Errors
    /// [`Error::UnknownKey`] for a key that the schema does not know.
    pub fn get(&self, key: &str) -> Result<Option<toml::Value>> {
        tree::known(key)?;
        Ok(tree::get(&self.to_tree(), key).cloned())
    }

    /// The keys that are set and do nothing as the others stand, with what each needs.
    pub fn idle_keys(&self) -> Vec<IdleKey> {
        idle::idle_keys(&self.to_tree())
    }

    /// Checks values that were set field by field.
    ///
    /// # Errors
    /// As [`Self::from_tree`].
    pub fn validate(&self) -> Result<()> {
        let tree = toml::Table::try_from(self).map_err(|error| Error::Toml(error.to_string()))?;
        check::complete(tree).map(|_| ())
    }
}

#[cfg(test)]
mod tests;
