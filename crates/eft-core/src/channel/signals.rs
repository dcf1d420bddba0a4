//! Input and output of a tick.

use crate::learning::Window;
use crate::number::Real;

/// One tick's command and measurements, in SI units. A signal that is not given is NaN. If the tick needs it, the tick
/// raises a flag.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Input<T> {
    /// Force command (N).
    pub command: T,
    /// Piston velocity (m/s); used if a sensor measures it.
    pub velocity: T,
    /// Force (N).
    pub force: T,
    /// Spool opening (1).
    pub spool: T,
    /// Displacement (m); used by a protection, and to estimate the velocity.
    pub displacement: T,
    /// Acceleration (m/s²); used by an observer that reads an accelerometer.
    pub acceleration: T,
    /// Supply pressure (Pa); used if its deviations are corrected. The last valid one replaces an invalid one.
    pub supply_pressure: T,
    /// Force command (N) of the next tick; used if the feedforward looks ahead.
    pub next_command: T,
    /// Valve command (V) of the same sample; used by a learner if an analog controller closes the force loop. Nothing is
    /// learned from a tick in which it is lost.
    pub valve_command: T,
    /// Alive counter (1), below 2²⁴. It increases by one in each sample, and returns to 0 after any highest value. A
    /// protection checks it after its first value.
    pub alive: T,
    /// Measured time (s) since the last sample. A protection checks it after its first value.
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
    /// Output to the converter (V): the valve command, or the compensation signal for an analog controller.
    pub voltage: T,
    /// The compensation signal `v_c` (V).
    pub compensation: T,
    /// Velocity (m/s) that was measured or estimated.
    pub velocity: T,
    /// The force command (N) that the protection permits, for an analog controller to follow.
    pub permitted_command: T,
    /// The protection's factor (1) on the valve command. `voltage` contains it; an analog controller must apply it.
    pub authority: T,
    /// Bits of [`status`](crate::status).
    pub status: u32,
    /// The window that closes with this tick, for the learner.
    pub window: Option<Window<T>>,
}
