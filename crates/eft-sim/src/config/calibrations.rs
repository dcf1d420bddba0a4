//! What earlier tests have taught: one calibration for all actuators, or one for each.

use eft_core::SavedCalibration;
use toml::Value;

use super::section::Entry;
use crate::error::{Error, Result};

/// Name of the section, and of the list of sections.
pub(super) const CALIBRATION: &str = "calibration";

/// The calibrations from which the adaptive controllers of a rig start: none, one for all actuators, or one for each, the
/// ground floor's first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Calibrations(Vec<SavedCalibration>);

impl Calibrations {
    /// That of an actuator.
    pub fn of(&self, actuator: usize) -> Option<&SavedCalibration> {
        match self.0.as_slice() {
            [one] => Some(one),
            each => each.get(actuator),
        }
    }

    /// That of a single controller.
    ///
    /// # Errors
    /// There is one for each of several actuators.
    pub fn only(&self) -> Result<Option<&SavedCalibration>> {
        if self.0.len() > 1 {
            let found = format!("{} calibrations", self.0.len());
            return Err(Error::value(CALIBRATION, found, "must be one for a single controller"));
        }
        Ok(self.0.first())
    }
}

impl From<SavedCalibration> for Calibrations {
    fn from(one: SavedCalibration) -> Self {
        Self(vec![one])
    }
}

impl Entry for Calibrations {
    fn read(place: Option<&Value>) -> Option<Self> {
        match place {
            None => Some(Self::default()),
            Some(Value::Array(each)) => {
                each.iter().map(|one| SavedCalibration::read(Some(one))).collect::<Option<_>>().map(Self)
            }
            one => SavedCalibration::read(one).map(Self::from),
        }
    }

    fn write(&self) -> Option<Value> {
        match self.0.as_slice() {
            [] => None,
            [one] => one.write(),
            each => Some(Value::Array(each.iter().filter_map(Entry::write).collect())),
        }
    }

    #[cfg(test)]
    fn keys(place: &str) -> Vec<String> {
        SavedCalibration::keys(place)
    }
}
