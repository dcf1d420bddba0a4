//! What earlier tests have taught: one calibration for all actuators, or one for each.

use eft_core::{Deviations, SavedCalibration, SavedCurve};
use toml::Value;

use super::schema::Key;
use super::schema::Kind::{Float, Floats, Int};
use super::schema::Need::Optional;
use super::section::{Entry, entry};
use crate::{Result, checks};

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
        let found = format!("{} calibrations", self.0.len());
        checks::require(self.0.len() <= 1, CALIBRATION, found, "must be one for a single controller")?;
        Ok(self.0.first())
    }
}

impl From<SavedCalibration> for Calibrations {
    fn from(one: SavedCalibration) -> Self {
        Self(vec![one])
    }
}

impl Entry for Calibrations {
    fn add_rows(to: &mut Vec<Key>) {
        SavedCalibration::add_rows(to);
    }

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

entry!(SavedCalibration, "calibration." {
    version: u32 = "", Int(3, 3), Optional, "version of the calibration that an earlier test saved; the adaptive controller starts from it";
    greatest_flow: f64 = "m³/s", Float(1e-12, 1e3), Optional, "greatest flow of the flow table, or the flow gain of the linear scheme, to which the calibration refers";
    flow_gain: f64 = "", Float(1e-2, 1e2), Optional, "true flow over the table's";
    valve_gain: f64 = "", Float(1e-2, 1e2), Optional, "gain of the spool over `compensation.valve_gain`";
    response_delay: f64 = "s", Float(0.0, 1e2), Optional, "delay of the spool by its sensor";
    velocity_delay: f64 = "s", Float(-1e2, 1e2), Optional, "delay of the velocity after the spool by their sensors";
    null_offset: f64 = "", Float(-1.0, 1.0), Optional, "commanded opening at which the valve passes nothing at no load";
    deviations: Deviations<f64>;
    excitation: f64 = "s", Float(0.0, 1e6), Optional, "motion from which these were estimated: integral of the squared opening";
    curve: SavedCurve;
});

entry!(Deviations<f64>, "calibration.deviations." {
    flow_gain: f64 = "", Float(1e-18, 1e6), Optional, "standard deviation of the flow gain";
    valve_gain: f64 = "", Float(1e-18, 1e6), Optional, "standard deviation of the valve gain";
    response_delay: f64 = "s", Float(1e-18, 1e6), Optional, "standard deviation of the spool's delay";
    velocity_delay: f64 = "s", Float(1e-18, 1e6), Optional, "standard deviation of the velocity's delay";
    null_offset: f64 = "", Float(1e-18, 1e6), Optional, "standard deviation of the null offset";
});

entry!(SavedCurve, "calibration.curve." {
    asymmetry: f64 = "", Float(-1.0, 1.0), Optional, "table flow per flow of the forward direction over the mean of both directions, less 1";
    asymmetry_deviation: f64 = "", Float(1e-18, 1e6), Optional, "standard deviation of the asymmetry";
    departures: [f64; 17] = "m³/s", Floats(17, 17, -1e3, 1e3), Optional, "departures of the flow curve from its directions, at 17 flows from -8/7 to 8/7 of the greatest one";
    departure_deviations: [f64; 17] = "m³/s", Floats(17, 17, 0.0, 1e3), Optional, "standard deviations of the departures";
    error: f64 = "m³/s", Float(1e-18, 1e3), Optional, "rms of the flow of a window that the correction leaves unexplained";
    flow_gain_share: f64 = "", Float(-1.0, 1.0), Optional, "share of the flow gain that follows from the departures";
});
