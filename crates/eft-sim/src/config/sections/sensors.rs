//! The sensors and their errors.

use crate::config::schema::Kind::{Choice, Float, Int};
use crate::config::schema::Need::{Optional, When};
use crate::config::schema::{float, int, key, word};
use crate::config::section::{choice, section};

/// The rows of one sensor: section, unit, its name there and for the noise, what a value is, the largest noise, the
/// range's bounds, and the largest bias.
#[rustfmt::skip]
macro_rules! sensor {
    ($section:literal, $unit:literal, $name:literal, $noisy:literal, $of:literal, $noise:expr, $range:expr, $bias:expr) => {
        &[
            key(concat!($section, "gain"), "", Float(1e-2, 1e2), float(1.0), concat!($name, ": gain, reading over true value")),
            key(concat!($section, "noise"), $unit, Float(0.0, $noise), float(0.0), concat!($noisy, ": standard deviation of the noise per sample", $of)),
            key(concat!($section, "bandwidth"), "Hz", Float(1e-3, 1e6), Optional, concat!($name, ": first-order bandwidth")),
            key(concat!($section, "bits"), "bits", Int(1, 32), Optional, concat!($name, ": resolution over the range")),
            key(concat!($section, "range"), $unit, Float($range.0, $range.1), Optional, concat!($name, ": range to either side", $of)),
            key(concat!($section, "delay"), "samples", Int(0, 1000), int(0), concat!($name, ": delay")),
            key(concat!($section, "bias"), $unit, Float(-$bias, $bias), float(0.0), concat!($name, ": constant offset", $of)),
            key(concat!($section, "dropout"), "", Float(0.0, 1.0), float(0.0), concat!($name, ": share of lost samples")),
        ]
    };
}

section! {
    /// `[sensors]`.
    pub struct Sensors in "sensors." {
        seed: u64 = "", Int(0, i64::MAX), int(0), "seed of all noise";
        motion_at: MotionAt = "", Choice(MotionAt::WORDS), word("piston"), "side of the attachment whose displacement and velocity are measured, if it has a stiffness or a play";
        cell_mass: Option<f64> = "kg", Float(0.0, 1e9), Optional, "mass between load cell and piston, part of the structure's";
        /// Load cell, N.
        force: Sensor { sensor!("sensors.force.", "N", "load cell", "load cell", "", 1e9, (1e-9, 1e12), 1e9) };
        /// Velocity sensor, m/s.
        velocity: Sensor { sensor!("sensors.velocity.", "m/s", "velocity", "velocity", "", 1e3, (1e-9, 1e3), 1e3) };
        /// Displacement sensor, m.
        displacement: Sensor { sensor!("sensors.displacement.", "m", "displacement", "displacement", "", 1e3, (1e-9, 1e3), 1e3) };
        /// Spool position sensor, opening.
        spool: Sensor { sensor!("sensors.spool.", "", "spool", "spool", ", opening", 10.0, (1e-6, 10.0), 1.0) };
        /// Supply pressure sensor, Pa.
        supply_pressure: Sensor { sensor!("sensors.supply_pressure.", "Pa", "supply pressure", "supply pressure", "", 1e9, (1e-3, 1e12), 1e9) };
        /// Accelerometer, at the structure, m/s².
        acceleration: Sensor { sensor!("sensors.acceleration.", "m/s²", "accelerometer", "accelerometer on the structure", "", 1e6, (1e-9, 1e6), 1e6) };
        /// Load pressure, from sensors in both chambers, Pa.
        load_pressure: Sensor { sensor!("sensors.load_pressure.", "Pa", "load pressure", "load pressure, the difference of the chamber pressures", "", 1e9, (1e-3, 1e12), 1e9) };
        /// A failure of one sensor during the test.
        fault: Option<SensorFault>;
    }
}

choice! {
    /// A side of the attachment between piston and structure.
    pub enum MotionAt {
        /// The piston, for transducers in the actuator.
        Piston = "piston",
        /// The structure.
        Structure = "structure",
    }
}

section! {
    /// One sensor; ideal when every value is at its default.
    pub struct Sensor in "" {
        /// Reading over true value, dimensionless.
        gain: f64;
        /// Standard deviation of the noise per sample, in the signal's unit.
        noise: f64;
        /// First-order bandwidth, Hz.
        bandwidth: Option<f64>;
        /// Resolution over the range, bits.
        bits: Option<u32>;
        /// Range to either side, in the signal's unit.
        range: Option<f64>;
        /// Delay, samples.
        delay: u32;
        /// Constant offset, in the signal's unit.
        bias: f64;
        /// Share of lost samples, dimensionless.
        dropout: f64;
    }
}

section! {
    /// `[sensors.fault]`: a simulated failure.
    pub struct SensorFault in "sensors.fault." {
        signal: FaultSignal = "", Choice(FaultSignal::WORDS), Optional, "sensor that fails during the test";
        kind: FaultKind = "", Choice(FaultKind::WORDS), Optional, "kind of failure: no valid reading, zero, the last reading repeated, wrong sign, wrong gain, bias and noise without the signal, an offset, a growing offset, more noise";
        start: f64 = "s", Float(0.0, 1e6), Optional, "start of the failure";
        duration: Option<f64> = "s", Float(0.0, 1e6), Optional, "duration of the failure; absent means to the end of the test";
        gain: Option<f64> = "", Float(1e-2, 1e2), When("sensors.fault.kind", "gain"), "reading over true value of the failure; needs `sensors.fault.kind = \"gain\"`";
        offset: Option<f64> = "", Float(-1e9, 1e9), When("sensors.fault.kind", "offset"), "offset of the failure, in the signal's SI unit; needs `sensors.fault.kind = \"offset\"`";
        drift: Option<f64> = "", Float(-1e9, 1e9), When("sensors.fault.kind", "drift"), "offset of the failure per second, in the signal's SI unit; needs `sensors.fault.kind = \"drift\"`";
        noise: Option<f64> = "", Float(0.0, 1e9), When("sensors.fault.kind", "noise"), "standard deviation of the failure's noise per sample, in the signal's SI unit; needs `sensors.fault.kind = \"noise\"`";
    }
}

choice! {
    /// The sensor that fails.
    pub enum FaultSignal {
        /// The load cell.
        Force = "force",
        /// The velocity sensor.
        Velocity = "velocity",
        /// The displacement sensor.
        Displacement = "displacement",
        /// The spool position sensor.
        Spool = "spool",
        /// The supply pressure sensor.
        SupplyPressure = "supply_pressure",
        /// The accelerometer.
        Acceleration = "acceleration",
        /// The sensors of the chamber pressures.
        LoadPressure = "load_pressure",
    }
}

choice! {
    /// How a sensor fails.
    pub enum FaultKind {
        /// No valid reading, detected by the electronics.
        Lost = "lost",
        /// Reads zero.
        Zero = "zero",
        /// Repeats the last reading.
        Stuck = "stuck",
        /// Reads with the wrong sign.
        Sign = "sign",
        /// Reads the truth times [`SensorFault::gain`].
        Gain = "gain",
        /// Reads its bias and noise without the signal, as without its supply.
        Dead = "dead",
        /// Reads [`SensorFault::offset`] too much.
        Offset = "offset",
        /// Reads an offset that grows by [`SensorFault::drift`] per second.
        Drift = "drift",
        /// Has further noise, [`SensorFault::noise`].
        Noise = "noise",
    }
}
