//! What earlier tests have taught: one calibration for all actuators, or one for each.

use eft_core::{SavedCalibration, SavedCurve, SavedDistances, SavedEvidence};
use toml::Value;

use super::schema::Key;
use super::schema::Kind::{Float, Floats, Int};
use super::schema::Need::Optional;
use super::section::{Entry, entry};
use crate::{Result, checks};

/// Name of the section, and of the list of sections.
pub(super) const CALIBRATION: &str = "calibration";

/// The version that can be read.
pub(super) const VERSION: i64 = SavedCalibration::VERSION as i64;

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
    version: u32 = "", Int(VERSION, VERSION), Optional, "version of the calibration that an earlier test saved; the adaptive controller starts from it";
    greatest_flow: f64 = "m³/s", Float(1e-12, 1e3), Optional, "greatest flow of the flow table, or the flow gain of the linear scheme, to which the calibration refers";
    flow_gain: f64 = "", Float(1e-2, 1e2), Optional, "true flow over the table's";
    valve_gain: f64 = "", Float(1e-2, 1e2), Optional, "gain of the spool over `compensation.valve_gain`";
    response_delay: f64 = "s", Float(0.0, 1e2), Optional, "delay of the spool by its sensor";
    velocity_delay: f64 = "s", Float(-1e2, 1e2), Optional, "delay of the velocity after the spool by their sensors";
    null_offset: f64 = "", Float(-1.0, 1.0), Optional, "commanded opening at which the valve passes nothing at no load";
    excitation: f64 = "s", Float(0.0, 1e6), Optional, "motion from which these were estimated: integral of the squared opening";
    evidence: SavedEvidence;
    curve: SavedCurve;
});

entry!(SavedEvidence, "calibration.evidence." {
    time: f64 = "s", Float(0.0, 1e6), Optional, "remembered time of motion";
    mean_weight: f64 = "", Float(0.0, 1.01), Optional, "mean weight of the remembered motion; 1 if nothing was forgotten";
    mean_square_frequency: f64 = "1/s²", Float(0.0, 1e12), Optional, "mean-square frequency of the motion. The following means are weighted by the squared opening: this one is that of its squared rate";
    growth: f64 = "1/s", Float(-1e9, 1e9), Optional, "mean of opening times its rate";
    flow: f64 = "m³/s", Float(0.0, 1e3), Optional, "mean of opening times flow";
    flow_rate: f64 = "m³/s²", Float(-1e9, 1e9), Optional, "mean of opening times the flow's rate";
    rate_flow: f64 = "m³/s²", Float(-1e9, 1e9), Optional, "mean of the opening's rate times flow";
    rate_flow_rate: f64 = "m³/s³", Float(0.0, 1e9), Optional, "mean of the opening's rate times the flow's rate";
    compressed_flow: f64 = "m³/s", Float(0.0, 1e3), Optional, "rms of the flow that leaks and compresses the oil, over that of the opening";
    flow_error: f64 = "m³/s", Float(0.0, 1e3), Optional, "rms of the flow that the estimates leave unexplained";
    spool_error: f64 = "", Float(0.0, 1e3), Optional, "rms of the opening that the estimates leave unexplained";
    distances: SavedDistances;
});

entry!(SavedDistances, "calibration.evidence.distances." {
    flow_gain: f64 = "", Float(-1e6, 1e6), Optional, "flow gain of the least squares minus the one in use, which follows at a limited rate and within its bounds";
    valve_gain: f64 = "", Float(-1e6, 1e6), Optional, "the same for the valve gain";
    response_delay: f64 = "s", Float(-1e6, 1e6), Optional, "the same for the spool's delay";
    velocity_delay: f64 = "s", Float(-1e6, 1e6), Optional, "the same for the velocity's delay";
    null_offset: f64 = "", Float(-1e6, 1e6), Optional, "the same for the null offset";
});

entry!(SavedCurve, "calibration.curve." {
    asymmetry: f64 = "", Float(-1.0, 1.0), Optional, "table flow per flow of the forward direction over the mean of both directions, less 1";
    asymmetry_deviation: f64 = "", Float(1e-9, 1e6), Optional, "standard deviation of the asymmetry";
    departures: [f64; 17] = "m³/s", Floats(17, 17, -1e3, 1e3), Optional, "departures of the flow curve from its directions, at 17 flows from -8/7 to 8/7 of the greatest one";
    departure_deviations: [f64; 17] = "m³/s", Floats(17, 17, 0.0, 1e3), Optional, "standard deviations of the departures";
    error: f64 = "m³/s", Float(1e-18, 1e3), Optional, "rms of the flow of a window that the correction leaves unexplained";
    flow_gain_share: f64 = "", Float(-1.0, 1.0), Optional, "share of the flow gain that follows from the departures";
    mean_departure: f64 = "", Float(-1.0, 1.0), Optional, "mean departure over the flow, which the flow gain slowly takes over";
    time: f64 = "s", Float(0.0, 4.04), Optional, "remembered time of residual and sensor offset";
    sensor_offset: f64 = "", Float(-1e3, 1e3), Optional, "reading of the spool's sensor minus the commanded opening times the spool's gain";
    null_time: f64 = "s", Float(0.0, 1e6), Optional, "remembered time of the null offset, at the table's slope at null";
    null_coupling: f64 = "", Float(0.0, 1.0), Optional, "share of this time in which an error of a direction's gain looks like a null offset";
});
