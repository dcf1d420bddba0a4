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

impl<S> Signals<S> {
    /// The values in the order of the fields.
    pub fn to_array(self) -> [S; 7] {
        let Self { displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure } =
            self;
        [displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure]
    }

    /// From values in the order of the fields.
    pub fn from_array(values: [S; 7]) -> Self {
        let [displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure] = values;
        Self { displacement, velocity, force, spool, supply_pressure, acceleration, load_pressure }
    }
}
