//! A rig: all sections, in the order of written files.

use super::{
    Actuator, Compensation, Controller, Dac, Limits, Protection, Sensors, Servovalve, Structure, Supply,
    Verdict,
};
use crate::config::Calibrations;
use crate::config::schema::Kind::Text;
use crate::config::schema::Need::Optional;
use crate::config::section::section;

section! {
    /// The values of a rig by section.
    pub struct RigValues in "" {
        name: Option<String> = "", Text, Optional, "name of the rig, for reports and exported files";
        /// The actuator.
        actuator: Actuator;
        /// The hydraulic supply.
        supply: Supply;
        /// The true servovalve.
        servovalve: Servovalve;
        /// The servovalve controller, Eq. (1).
        controller: Controller;
        /// The velocity feedback compensation as the controller knows it.
        compensation: Compensation;
        /// What an earlier test has taught, from which an adaptive controller starts.
        calibration: Calibrations;
        /// The test structure, Fig. 7.
        structure: Structure;
        /// The errors of the sensors; ideal by default.
        sensors: Sensors;
        /// The errors of the output converter; ideal by default.
        dac: Dac;
        /// Protection of the specimen; none by default.
        protection: Protection;
        /// Limits and plausible measurement ranges; none by default.
        limits: Limits;
        /// The limits of the verdict.
        verdict: Verdict;
    }
}
