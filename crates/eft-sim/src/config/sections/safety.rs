//! Converter, limits and protection.

use crate::config::schema::Kind::{Bool, Float, Int};
use crate::config::schema::Need::Optional;
use crate::config::schema::{OFF, ON, float, int};
use crate::config::section::section;

section! {
    /// `[dac]`: the converter between the digital side and the valve's electronics.
    pub struct Dac in "dac." {
        range: Option<f64> = "V", Float(1e-6, 1e6), Optional, "converter of the controller's output: range to either side";
        bits: Option<u32> = "bits", Int(1, 32), Optional, "converter of the controller's output: resolution over the range";
        delay: u32 = "samples", Int(0, 1000), int(0), "converter of the controller's output: delay between it and the valve";
    }
}

section! {
    /// `[limits]`: absent means unlimited.
    pub struct Limits in "limits." {
        valve_command: Option<f64> = "V", Float(1e-6, 1e6), Optional, "largest valve command to either side";
        valve_command_rate: Option<f64> = "V/s", Float(1e-6, 1e12), Optional, "largest rate of the valve command";
        spool_warning: f64 = "", Float(1e-3, 1.0), float(0.6), "spool opening beyond which a warning flag is raised";
        force_range: Option<f64> = "N", Float(1e-9, 1e12), Optional, "largest plausible measured force to either side";
        velocity_range: Option<f64> = "m/s", Float(1e-9, 1e3), Optional, "largest plausible measured velocity to either side";
        spool_range: Option<f64> = "", Float(1e-6, 10.0), Optional, "largest plausible measured spool opening to either side";
        gap_time: f64 = "s", Float(0.0, 1e3), float(0.0025), "time without a valid sample after which the controller resumes at the new operating point; after a shorter time it continues";
    }
}

section! {
    /// `[protection]` of the specimen; absent levels never trip.
    pub struct Protection in "protection." {
        enabled: bool = "", Bool, OFF, "whether the protection is in the loop";
        force_warning: Option<f64> = "N", Float(0.0, 1e12), Optional, "force that raises a warning";
        force_trip: Option<f64> = "N", Float(0.0, 1e12), Optional, "force that trips the test";
        displacement_warning: Option<f64> = "m", Float(0.0, 1e3), Optional, "displacement that raises a warning";
        displacement_trip: Option<f64> = "m", Float(0.0, 1e3), Optional, "displacement that trips the test";
        velocity_warning: Option<f64> = "m/s", Float(0.0, 1e3), Optional, "velocity that raises a warning";
        velocity_trip: Option<f64> = "m/s", Float(0.0, 1e3), Optional, "velocity that trips the test";
        spool_warning: Option<f64> = "", Float(0.0, 10.0), Optional, "spool opening that raises a warning of the protection";
        spool_trip: Option<f64> = "", Float(0.0, 10.0), Optional, "spool opening that trips the test";
        start_time: f64 = "s", Float(0.0, 1e4), float(0.0), "time of the soft start";
        ramp_time: f64 = "s", Float(0.0, 1e4), float(0.5), "time of the ramp to zero force after a trip and at the soft end; with the plausibility, a fifth of it, at most 0.1 s, after a trip by a distrusted or lost sensor, and at most 0.1 s after one by the force level";
        soft_end: bool = "", Bool, OFF, "whether the command ends with this ramp";
        shutdown_time: f64 = "s", Float(0.0, 1e4), float(0.1), "time of the ramp of the valve command to zero in a shutdown";
        lost_samples: u32 = "samples", Int(0, 100000), int(10), "lost or rejected samples in a row before the shutdown; lost commands in a row before the trip; with the plausibility, three or more readings that jumped add half of this number and one";
        plausibility: bool = "", Bool, ON, "whether the measurements are compared with each other (flow, motion, spool); a trip then uses those that agree";
        force_noise: Option<f64> = "N", Float(0.0, 1e9), Optional, "noise of the force per sample in the plausibility; absent means 0.05 % of the actuator's capacity";
        displacement_noise: Option<f64> = "m", Float(1e-12, 1.0), Optional, "the same of the displacement; absent means 0.05 % of the actuator's stroke to either side";
        velocity_noise: Option<f64> = "m/s", Float(0.0, 1e3), Optional, "the same of the velocity; absent means 0.05 % of the piston's speed at full flow";
        spool_noise: f64 = "", Float(0.0, 1.0), float(5e-4), "the same of the spool opening";
        load_pressure_tolerance: Option<f64> = "N", Float(1e-6, 1e12), Optional, "largest difference between the force and the measured load pressure times the piston area, by friction, inertia and offsets; absent means that no chamber pressures are measured";
        false_alarms: f64 = "1/h", Float(1e-12, 1e6), float(1e-3), "allowed rate of false alarms by this noise";
        settle_time: f64 = "s", Float(0.0, 1e4), float(1.5), "time of a shutdown during which the piston follows the specimen and damps it, before the valve closes";
        stuck_samples: u32 = "samples", Int(0, 1000000), int(0), "repetitions of a measurement to the last bit after which it counts as stuck; 0 disables the check";
        fault_time: Option<f64> = "s", Float(0.0, 1e4), Optional, "time without learning after which the test trips, because measurements contradict the models or samples are lost; needs `protection.enabled` and `compensation.adaptive`";
        oscillation_limit: Option<f64> = "N", Float(1e-6, 1e12), Optional, "root mean square of the force error from about 30 to 150 Hz that opens the force loop if it persists or grows; absent means no check";
        period_tolerance: f64 = "", Float(0.0, 1e3), float(0.1), "allowed relative difference of the firmware's measured sample period from the configured one";
    }
}
