//! The first cause of a trip.

use crate::checksum::{Integrity, Word};

/// What tripped a protection first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Cause {
    /// Nothing tripped.
    #[default]
    None = 0,
    /// A request from outside.
    Request = 1,
    /// The force was beyond its trip level.
    ForceLevel = 2,
    /// The displacement was beyond its trip level.
    DisplacementLevel = 3,
    /// The velocity was beyond its trip level.
    VelocityLevel = 4,
    /// The spool opening was beyond its trip level.
    SpoolLevel = 5,
    /// The force command stayed lost.
    CommandLost = 6,
    /// Measurements stayed lost.
    MeasurementLost = 7,
    /// The controller kept refusing its samples.
    Refused = 8,
    /// The estimators' models stayed contradicted, or a measurement stayed stuck.
    ModelContradicted = 9,
    /// The force stayed lost.
    ForceLost = 10,
    /// The displacement stayed lost.
    DisplacementLost = 11,
    /// The velocity stayed lost.
    VelocityLost = 12,
    /// The spool opening stayed lost.
    SpoolLost = 13,
    /// The force contradicts the actuator's flow balance, jumped, or is stuck.
    ForceImplausible = 14,
    /// The displacement contradicts the velocity and the flow, or jumped.
    DisplacementImplausible = 15,
    /// The velocity contradicts displacement and flow, jumped, or is stuck.
    VelocityImplausible = 16,
    /// The spool opening contradicts command and flow, or jumped.
    SpoolImplausible = 17,
    /// The valve's flow is not the piston's: check supply, valve and flow curve.
    FlowImplausible = 18,
    /// The spool does not follow its command, but the flow follows the spool.
    ValveImplausible = 19,
    /// A latch in memory was changed from outside.
    StateCorrupt = 20,
    /// The alive counter stood still or skipped.
    SamplesOld = 21,
    /// The measured sample period was off.
    SamplePeriod = 22,
    /// The learner published nothing for longer than its age limit.
    CalibrationExpired = 23,
    /// The force error from about 30 to 150 Hz persisted or grew.
    ForceOscillation = 24,
}

impl Integrity for Cause {
    fn add_to(&self, word: &mut Word) {
        word.add(*self as u32);
    }
}

impl Cause {
    /// Every cause with its name.
    pub const NAMES: [(Self, &'static str); 25] = [
        (Self::None, "none"),
        (Self::Request, "request"),
        (Self::ForceLevel, "force_level"),
        (Self::DisplacementLevel, "displacement_level"),
        (Self::VelocityLevel, "velocity_level"),
        (Self::SpoolLevel, "spool_level"),
        (Self::CommandLost, "command_lost"),
        (Self::MeasurementLost, "measurement_lost"),
        (Self::Refused, "refused"),
        (Self::ModelContradicted, "model_contradicted"),
        (Self::ForceLost, "force_lost"),
        (Self::DisplacementLost, "displacement_lost"),
        (Self::VelocityLost, "velocity_lost"),
        (Self::SpoolLost, "spool_lost"),
        (Self::ForceImplausible, "force_implausible"),
        (Self::DisplacementImplausible, "displacement_implausible"),
        (Self::VelocityImplausible, "velocity_implausible"),
        (Self::SpoolImplausible, "spool_implausible"),
        (Self::FlowImplausible, "flow_implausible"),
        (Self::ValveImplausible, "valve_implausible"),
        (Self::StateCorrupt, "state_corrupt"),
        (Self::SamplesOld, "samples_old"),
        (Self::SamplePeriod, "sample_period"),
        (Self::CalibrationExpired, "calibration_expired"),
        (Self::ForceOscillation, "force_oscillation"),
    ];

    /// Whether measurements are lost or contradict each other, so that the state of the specimen is unknown.
    #[inline(always)]
    pub(crate) fn is_of_sensors(self) -> bool {
        let number = self as u32;
        number >= Self::ForceLost as u32 && number <= Self::ValveImplausible as u32
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(cause, _)| *cause == self).map_or("", |(_, name)| name)
    }
}
