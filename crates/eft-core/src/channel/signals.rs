//! What goes into a tick, and what comes out.

use crate::learning::Window;
use crate::number::Real;

/// One tick's command and measurements, in SI units. What is not given is NaN: nothing looks at it, or the tick is
/// flagged.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Input<T> {
    /// Force command (N).
    pub command: T,
    /// Piston velocity (m/s); looked at where a sensor measures it.
    pub velocity: T,
    /// Force (N).
    pub force: T,
    /// Spool opening (1).
    pub spool: T,
    /// Displacement (m); looked at by a protection, and where the velocity is made of it.
    pub displacement: T,
    /// Acceleration (m/s²); looked at by an observer that reads an accelerometer.
    pub acceleration: T,
    /// Supply pressure (Pa); looked at where its departures are corrected.
    pub supply_pressure: T,
    /// Force command (N) of the next tick; looked at where the feedforward looks ahead.
    pub next_command: T,
    /// Valve command (V) that stood when the others were sampled; looked at by a learner where an analog controller
    /// closes the force loop. Where it is lost nothing is learned.
    pub valve_command: T,
    /// Alive counter (1): one more than in the last sample, or 0 behind its last value, whichever that is; below 2²⁴.
    /// Looked at by a protection from the first one that is given.
    pub alive: T,
    /// Measured time (s) since the last sample; looked at by a protection from the first one that is given.
    pub period: T,
}

impl<T: Real> Default for Input<T> {
    fn default() -> Self {
        let none = T::splat(f64::NAN);
        Self {
            command: none,
            velocity: none,
            force: none,
            spool: none,
            displacement: none,
            acceleration: none,
            supply_pressure: none,
            next_command: none,
            valve_command: none,
            alive: none,
            period: none,
        }
    }
}

/// One tick's result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output<T: Real> {
    /// What goes to the converter (V): the valve command, or the compensation signal for an analog controller.
    pub voltage: T,
    /// The compensation signal `v_c` (V).
    pub compensation: T,
    /// Velocity (m/s) that was measured or estimated.
    pub velocity: T,
    /// The force command (N) that the protection lets be followed: an analog controller's.
    pub permitted_command: T,
    /// Factor (1) that the protection puts on the valve command: in `voltage` already, but for an analog controller.
    pub authority: T,
    /// Bits of [`status`](crate::status).
    pub status: u32,
    /// The window that closes with this tick, for the learner.
    pub window: Option<Window<T>>,
}
