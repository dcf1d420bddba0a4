//! The rig's configuration: one schema for TOML, dictionaries and dotted keys.
//!
//! [`KEYS`] is the schema: key, unit, range, default and meaning of every value. The structs of this module
//! hold the values; a test compares the two. A new effect of the rig needs one struct field and one row.

mod calibrations;
mod check;
mod controller_curve;
mod force_loop;
mod idle;
mod keys;
mod schema;
mod section;
mod sections;
mod text;
mod tree;
mod velocity;
mod zhao2005;

pub use calibrations::Calibrations;
pub(crate) use force_loop::{AtRest, gain_within_limit};
pub use keys::KEYS;
pub use schema::{Key, Kind, Need, Preset};
pub use sections::{
    Actuator, BoucWen, Compensation, Controller, Dac, FaultKind, FaultSignal, FlowCurve, ForceLoop, Learning,
    Limits, Mode, MotionAt, PowerDamper, Protection, Realization, RigValues, Sensor, SensorFault, Sensors,
    Servovalve, SignFrom, Softening, Stories, Story, Structure, StructureKind, Supply, SupplySchedule,
    TABLE_CAPACITY, ValveLeakage, VelocitySource, Verdict, VerdictLimits,
};

use std::ops::Deref;
use std::path::Path;

use eft_core::SavedCalibration;
use section::Entry;

use crate::{Error, Result};

/// A whole rig: plant, controller, sensors and limits, in SI units.
///
/// A rig that exists is valid, because every constructor checks names, types and ranges. Its
/// [values](RigValues) are read as its own fields. [`replace`](Self::replace) and [`with`](Self::with) return
/// a rig with other values.
///
/// The values describe the rig as the controller knows it. Values under `truth` describe the true plant where
/// it differs, and [`plant`](Self::plant) is the rig with them.
#[derive(Clone, Debug, PartialEq)]
pub struct RigConfig {
    values: RigValues,
    /// The configured gains and realization that a designed force loop replaces.
    configured_loop: Option<([f64; 3], Realization)>,
    /// The flow curve of the areas and the underlap that the controller knows, where it is not the flow table.
    inverted: Option<FlowCurve>,
    truth: Option<Box<Truth>>,
}

/// Differences of the true plant from the configured one.
#[derive(Clone, Debug, PartialEq)]
struct Truth {
    /// The values that differ, as a tree of sections.
    values: toml::Table,
    /// The rig with these values.
    plant: RigConfig,
}

impl Deref for RigConfig {
    type Target = RigValues;

    fn deref(&self) -> &RigValues {
        &self.values
    }
}

/// A saved calibration as the section `calibration` of a rig.
pub fn calibration_section(saved: &SavedCalibration) -> Option<toml::Value> {
    saved.write()
}

impl RigConfig {
    /// Whether the motion is measured at a piston that moves relative to the structure.
    pub(crate) fn piston_moves_alone(&self) -> bool {
        let moves = self.actuator.attachment_stiffness.is_some() || self.actuator.attachment_play > 0.0;
        moves && self.sensors.motion_at == MotionAt::Piston
    }

    /// The commanded opening (1) of an actuator at rest: the null that the controller knows, or has learned in an
    /// earlier test.
    pub fn known_null(&self, actuator: usize) -> f64 {
        let learns = self.compensation.corrects_curve();
        let learned = self.calibration.of(actuator).filter(|saved| learns && saved.excitation > 0.0);
        learned.map_or(self.servovalve.null_bias, |saved| saved.null_offset)
    }

    /// The valve command (V) of an actuator at rest.
    pub fn null_command(&self, actuator: usize) -> f64 {
        self.known_null(actuator) / self.compensation.valve_gain
    }

    /// The true opening (1) of an actuator's spool at rest, under [`null_command`](Self::null_command).
    pub(crate) fn opening_at_rest(&self, actuator: usize) -> f64 {
        let valve = &self.plant().servovalve;
        (self.null_command(actuator) / (valve.spool_sensitivity * valve.spool_stroke)).clamp(-1.0, 1.0)
    }

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

    /// As [`Self::to_toml`], with unit, range and meaning of every key in a comment.
    pub fn to_commented_toml(&self) -> String {
        text::write(&self.to_tree(), true)
    }

    /// Builds a configuration from a tree of sections, filling in the defaults of [`KEYS`].
    ///
    /// # Errors
    /// [`Error::UnknownKey`], [`Error::MissingKey`] or [`Error::Value`], each naming the dotted key.
    pub fn from_tree(tree: toml::Table) -> Result<Self> {
        Self::from_accepted(check::accepted(&tree)?)
    }

    fn from_accepted(mut accepted: toml::Table) -> Result<Self> {
        let truth = accepted.remove(tree::TRUTH);
        let complete = check::complete(accepted)?;
        let truth = match truth {
            Some(toml::Value::Table(values)) => {
                let plant = Self::from_complete(check::plant(&complete, &values)?, None)?;
                Some(Box::new(Truth { values, plant }))
            }
            _ => None,
        };
        let mut rig = Self::from_complete(complete, truth)?;
        if rig.values.controller.force_loop == ForceLoop::Robust {
            rig.design_force_loop(rig.values.controller.sample_rate)?;
        }
        Ok(rig)
    }

    fn from_complete(complete: toml::Table, truth: Option<Box<Truth>>) -> Result<Self> {
        // Names, types and ranges are already checked. This fails only if KEYS and the structs disagree.
        let values = RigValues::read(Some(&toml::Value::Table(complete)))
            .ok_or_else(|| Error::Toml("a field has no key".into()))?;
        let mut rig = Self { values, configured_loop: None, inverted: None, truth };
        rig.set_controller_curve()?;
        Ok(rig)
    }

    /// The configuration as a tree of sections, defaults included.
    pub fn to_tree(&self) -> toml::Table {
        self.tree_of(&self.values)
    }

    /// A tree of these values and of this rig's `truth`.
    fn tree_of(&self, values: &RigValues) -> toml::Table {
        let mut tree = match self.with_configured_gains(values).write() {
            Some(toml::Value::Table(tree)) => tree,
            _ => toml::Table::new(),
        };
        if let Some(truth) = &self.truth {
            tree.insert(tree::TRUTH.to_owned(), truth.values.clone().into());
        }
        tree
    }

    /// The true rig: this one with the values of its `truth`. Plant, sensors and converter are made from it,
    /// controllers from the rig itself.
    pub fn plant(&self) -> &Self {
        self.truth.as_ref().map_or(self, |truth| &truth.plant)
    }

    /// A new configuration with some values replaced; keys are dotted, values may be sections.
    ///
    /// # Errors
    /// As [`Self::from_tree`]; all replacements are made before anything is checked.
    pub fn replace<K: AsRef<str>>(&self, changes: &[(K, toml::Value)]) -> Result<Self> {
        self.edit(&[], changes)
    }

    /// A new configuration without some optional values; values with a default return to it.
    ///
    /// # Errors
    /// As [`Self::from_tree`]; [`Error::UnknownKey`] for a key that the schema does not know.
    pub fn without<K: AsRef<str>>(&self, keys: &[K]) -> Result<Self> {
        self.edit(keys, &[])
    }

    /// [`Self::without`] and [`Self::replace`] together, checked once after both.
    ///
    /// # Errors
    /// As those.
    pub fn edit<K: AsRef<str>>(&self, removed: &[K], changes: &[(K, toml::Value)]) -> Result<Self> {
        let (mut tree, mut changed) = (self.to_tree(), toml::Table::new());
        for key in removed {
            tree::remove(&mut tree, key.as_ref())?;
        }
        for (key, value) in changes {
            tree::set(&mut tree, key.as_ref(), value.clone())?;
            tree::set(&mut changed, key.as_ref(), value.clone())?;
        }
        // A section may be empty now.
        if !removed.is_empty() || changes.iter().any(|(_, value)| value.is_table()) {
            return Self::from_tree(tree);
        }
        // The rig's own values are accepted already.
        for (key, value) in tree::leaves(&check::accepted(&changed)?) {
            tree::set(&mut tree, &key, value.clone())?;
        }
        Self::from_accepted(tree)
    }

    /// The value or section at a dotted key, if it is present.
    ///
    /// # Errors
    /// [`Error::UnknownKey`] for a key that the schema does not know.
    pub fn get(&self, key: &str) -> Result<Option<toml::Value>> {
        tree::check_known(key)?;
        Ok(tree::get(&self.to_tree(), key).cloned())
    }

    /// A sentence on each key that is set but has no effect with the other values: what it needs.
    pub fn idle_keys(&self) -> Vec<String> {
        idle::idle_keys(&self.to_tree())
    }

    /// A new configuration with fields changed.
    ///
    /// # Errors
    /// As [`Self::from_tree`].
    pub fn with(&self, change: impl FnOnce(&mut RigValues)) -> Result<Self> {
        let mut values = self.values.clone();
        change(&mut values);
        Self::from_tree(self.tree_of(&values))
    }

    /// The rig with changed fields, also in the plant, without checks, because an analysis may leave the
    /// ranges.
    pub(crate) fn varied(&self, change: impl Fn(&mut RigValues)) -> Self {
        let mut varied = self.clone();
        change(&mut varied.values);
        if let Some(truth) = &mut varied.truth {
            change(&mut truth.plant.values);
        }
        varied
    }

    /// The lap (1) for which the controller compensates: none in the linear scheme, which has no flow table, and without a
    /// compensation only the overlap that a digital controller steps over.
    pub(crate) fn compensated_lap(&self) -> f64 {
        let lap = self.servovalve.overlap;
        match (self.compensation.mode, self.controller.realization) {
            (Mode::Nonlinear, _) => lap,
            (Mode::Off, Realization::Digital) => lap.max(0.0),
            (Mode::Linear | Mode::Off, _) => 0.0,
        }
    }

    /// The rig with its gains at a sample rate (Hz), whose valve has the lap for which the controller compensates. Another
    /// lap has no effect on a large motion.
    ///
    /// # Errors
    /// A design that does not exist at this rate.
    pub(crate) fn with_known_lap(&self, sample_rate: f64) -> Result<Self> {
        let lap = self.compensated_lap();
        Ok(self.with_fixed_gains(sample_rate)?.varied(|values| values.servovalve.overlap = lap))
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod truth_tests;
