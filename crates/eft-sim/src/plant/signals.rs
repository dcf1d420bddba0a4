//! The signals of an actuator.

/// One value of each signal that has a sensor, true or measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signals<S> {
    /// Displacement (m).
    pub displacement: S,
    /// Velocity (m/s).
    pub velocity: S,
    /// Force (N).
    pub force: S,
    /// Spool opening (1).
    pub spool: S,
    /// Supply pressure (Pa).
    pub supply_pressure: S,
    /// Acceleration (m/s²).
    pub acceleration: S,
    /// Load pressure (Pa).
    pub load_pressure: S,
}
