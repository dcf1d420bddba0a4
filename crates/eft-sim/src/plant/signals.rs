//! The signals of an actuator.

/// One value of each signal that has a sensor, true or measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Signals<S> {
    /// Displacement (m).
    pub(crate) displacement: S,
    /// Velocity (m/s).
    pub(crate) velocity: S,
    /// Force (N).
    pub(crate) force: S,
    /// Spool opening (1).
    pub(crate) spool: S,
    /// Supply pressure (Pa).
    pub(crate) supply_pressure: S,
    /// Acceleration (m/s²).
    pub(crate) acceleration: S,
    /// Load pressure (Pa).
    pub(crate) load_pressure: S,
}
