//! The parameters of a protection: levels, times, and the assumptions of its plausibility watch.

/// Warning and trip level of one signal, in its unit; `f64::MAX` is no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Levels {
    /// Above it [`PROTECTION_WARNING`](crate::status::PROTECTION_WARNING) is raised.
    pub warning: f64,
    /// Above it the test is tripped.
    pub trip: f64,
}

impl Levels {
    /// No limit.
    pub const NONE: Self = Self { warning: f64::MAX, trip: f64::MAX };
}

/// The assumptions of a plausibility watch about noise and false alarms.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct PlausibilityParameters {
    /// Noise of the force (N): its standard deviation per sample.
    pub force_noise: f64,
    /// Noise of the displacement (m).
    pub displacement_noise: f64,
    /// Noise of the velocity (m/s).
    pub velocity_noise: f64,
    /// Noise of the spool opening (1).
    pub spool_noise: f64,
    /// Largest difference (N) between the force and the load pressure times the piston area, by friction, inertia and
    /// offsets; `f64::MAX` if the chamber pressures are not measured.
    pub load_pressure_tolerance: f64,
    /// False alarms (1/h) that this noise may raise.
    pub false_alarms: f64,
    /// Time (s) of a shutdown during which the piston follows the specimen and damps it, before the valve closes.
    pub settle_time: f64,
}

impl PlausibilityParameters {
    /// The noise of the paper's rig at 0.05 % of each range; one false alarm in a thousand hours; 1.5 s of following
    /// the specimen.
    pub const DEFAULT: Self = Self {
        force_noise: 78.0,
        displacement_noise: 6.35e-5,
        velocity_noise: 5.25e-4,
        spool_noise: 5.0e-4,
        load_pressure_tolerance: f64::MAX,
        false_alarms: 1.0e-3,
        settle_time: 1.5,
    };
}

/// The parameters of a protection.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ProtectionParameters {
    /// Levels of the force (N).
    pub force: Levels,
    /// Levels of the displacement (m).
    pub displacement: Levels,
    /// Levels of the velocity (m/s).
    pub velocity: Levels,
    /// Levels of the spool opening (1).
    pub spool: Levels,
    /// Time (s) from zero to the whole command at the start; 0 for none.
    pub start_time: f64,
    /// Time (s) from the whole command to zero after a trip or at the end. After a trip by a sensor it is a fifth of
    /// this, at most 0.1 s. After one by the force's level it is at most 0.1 s with a plausibility watch.
    pub ramp_time: f64,
    /// Time (s) from the whole valve command to that of the closed valve in a shutdown.
    pub shutdown_time: f64,
    /// Number of lost or refused samples in a row (1), at most 100,000, that do not cause a shutdown yet. The same
    /// number of lost commands does not trip yet. With a plausibility watch, a sensor with three or more readings that
    /// jumped counts again only after half this number and one more readings that agree with their prediction. These
    /// are held, and count as lost.
    pub lost_samples: u32,
    /// Longest time (s) of a fault that the controller reports, before the trip; `f64::MAX` for no limit.
    pub fault_time: f64,
    /// Share (1) by which a measured sample period may differ from the configured one.
    pub period_tolerance: f64,
    /// Root mean square (N) of the force error from about 30 to 150 Hz that shuts down if it persists or grows;
    /// `f64::MAX` for no check.
    pub oscillation_limit: f64,
    /// The plausibility watch, if the measurements are compared with each other.
    pub plausibility: Option<PlausibilityParameters>,
}

impl ProtectionParameters {
    /// No levels; ramps of half a second, a shutdown of a tenth of a second after more than ten lost samples.
    pub const DEFAULT: Self = Self {
        force: Levels::NONE,
        displacement: Levels::NONE,
        velocity: Levels::NONE,
        spool: Levels::NONE,
        start_time: 0.0,
        ramp_time: 0.5,
        shutdown_time: 0.1,
        lost_samples: 10,
        fault_time: f64::MAX,
        period_tolerance: 0.1,
        oscillation_limit: f64::MAX,
        plausibility: None,
    };
}
