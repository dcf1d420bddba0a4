//! Converter, limits and protection.

use crate::config::section::section;

section! {
    /// `[dac]`: the converter between the digital side and the valve's electronics.
    pub struct Dac {
        /// Range to either side, V.
        pub range: Option<f64>,
        /// Resolution over the range, bits.
        pub bits: Option<u32>,
        /// Delay between the controller's output and the valve, samples.
        pub delay: u32,
    }
}

section! {
    /// `[limits]`: absent means unlimited.
    pub struct Limits {
        /// Largest valve command to either side, V.
        pub valve_command: Option<f64>,
        /// Largest rate of the valve command, V/s.
        pub valve_command_rate: Option<f64>,
        /// Spool opening beyond which a warning flag is raised, dimensionless.
        pub spool_warning: f64,
        /// Largest plausible measured force to either side, N.
        pub force_range: Option<f64>,
        /// Largest plausible measured velocity to either side, m/s.
        pub velocity_range: Option<f64>,
        /// Largest plausible measured spool opening to either side, dimensionless.
        pub spool_range: Option<f64>,
        /// Time without a valid sample after which the controller resumes, s.
        pub gap_time: f64,
    }
}

section! {
    /// `[protection]` of the specimen; absent levels never trip.
    pub struct Protection {
        /// Whether the protection is in the loop.
        pub enabled: bool,
        /// Force that raises a warning, N.
        pub force_warning: Option<f64>,
        /// Force that trips the test, N.
        pub force_trip: Option<f64>,
        /// Displacement that raises a warning, m.
        pub displacement_warning: Option<f64>,
        /// Displacement that trips the test, m.
        pub displacement_trip: Option<f64>,
        /// Velocity that raises a warning, m/s.
        pub velocity_warning: Option<f64>,
        /// Velocity that trips the test, m/s.
        pub velocity_trip: Option<f64>,
        /// Spool opening that raises a warning, dimensionless.
        pub spool_warning: Option<f64>,
        /// Spool opening that trips the test, dimensionless.
        pub spool_trip: Option<f64>,
        /// Soft start, s.
        pub start_time: f64,
        /// Ramp to zero force after a trip and at the soft end, s.
        pub ramp_time: f64,
        /// Whether the command ends with the ramp.
        pub soft_end: bool,
        /// Ramp of the valve command to zero in a shutdown, s.
        pub shutdown_time: f64,
        /// Number of lost or refused samples in a row before the shutdown.
        pub lost_samples: u32,
        /// Whether the measurements must agree with each other.
        pub plausibility: bool,
        /// Noise of the force per sample in the plausibility, N.
        pub force_noise: Option<f64>,
        /// The same of the displacement, m.
        pub displacement_noise: Option<f64>,
        /// The same of the velocity, m/s.
        pub velocity_noise: Option<f64>,
        /// The same of the spool opening, dimensionless.
        pub spool_noise: f64,
        /// Allowed difference between the force and the measured load pressure times the area, N; absent without chamber
        /// pressures.
        pub load_pressure_tolerance: Option<f64>,
        /// Allowed rate of false alarms by this noise, 1/h.
        pub false_alarms: f64,
        /// Time of a shutdown during which the piston follows and damps the specimen, s.
        pub settle_time: f64,
        /// Repetitions of a measurement to the last bit after which it counts as stuck; 0 disables the check.
        pub stuck_samples: u32,
        /// Time without learning, because the models are contradicted, after which the test trips, s.
        pub fault_time: Option<f64>,
        /// Root mean square of the force error from about 30 to 150 Hz that opens the force loop, N.
        pub oscillation_limit: Option<f64>,
        /// Allowed relative difference of the measured sample period from the configured one, dimensionless.
        pub period_tolerance: f64,
    }
}
