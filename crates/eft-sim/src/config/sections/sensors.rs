//! The sensors and their errors.

use crate::config::section::{choice, section};

section! {
    /// `[sensors]`.
    pub struct Sensors {
        /// Seed of the noise.
        pub seed: u64,
        /// Side of the attachment whose displacement and velocity are measured.
        pub motion_at: MotionAt,
        /// Mass between load cell and piston, part of the structure's, kg.
        pub cell_mass: Option<f64>,
        /// Load cell, N.
        pub force: Sensor,
        /// Velocity sensor, m/s.
        pub velocity: Sensor,
        /// Displacement sensor, m.
        pub displacement: Sensor,
        /// Spool position sensor, opening.
        pub spool: Sensor,
        /// Supply pressure sensor, Pa.
        pub supply_pressure: Sensor,
        /// Accelerometer, at the structure, m/s².
        pub acceleration: Sensor,
        /// Load pressure, from sensors in both chambers, Pa.
        pub load_pressure: Sensor,
        /// A failure of one sensor during the test.
        pub fault: Option<SensorFault>,
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
    pub struct Sensor {
        /// Reading over true value, dimensionless.
        pub gain: f64,
        /// Standard deviation of the noise per sample, in the signal's unit.
        pub noise: f64,
        /// First-order bandwidth, Hz.
        pub bandwidth: Option<f64>,
        /// Resolution over the range, bits.
        pub bits: Option<u32>,
        /// Range to either side, in the signal's unit.
        pub range: Option<f64>,
        /// Delay, samples.
        pub delay: u32,
        /// Constant offset, in the signal's unit.
        pub bias: f64,
        /// Share of lost samples, dimensionless.
        pub dropout: f64,
    }
}

section! {
    /// `[sensors.fault]`: a simulated failure.
    pub struct SensorFault {
        /// The sensor that fails.
        pub signal: FaultSignal,
        /// How it fails.
        pub kind: FaultKind,
        /// When it fails, s from the start of the test.
        pub start: f64,
        /// Duration of the failure, s; to the end of the test if absent.
        pub duration: Option<f64>,
        /// Reading over correct reading during the failure, dimensionless; only for [`FaultKind::Gain`].
        pub gain: Option<f64>,
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
    }
}
