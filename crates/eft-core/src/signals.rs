//! Input and output of a tick.

use crate::learning::Window;
use crate::number::Real;

/// One tick's command and measurements. A signal that is not given is NaN. If the tick needs it, the tick raises a
/// flag.
// The C header has the first paragraph of each comment.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Input<T> {
    /// Force command (N).
    pub command: T,
    /// Piston velocity (m/s), if a sensor measures it.
    pub velocity: T,
    /// Force (N).
    pub force: T,
    /// Spool opening (1).
    pub spool: T,
    /// Displacement (m), for a protection or to estimate the velocity.
    pub displacement: T,
    /// Acceleration (m/s²), for a velocity from an accelerometer.
    pub acceleration: T,
    /// Supply pressure (Pa), for `supply_correction`.
    ///
    /// The last valid one replaces an invalid one.
    pub supply_pressure: T,
    /// Force (N) that is to act at the next tick, for `look_ahead`.
    ///
    /// It is the command of the next tick. If the command is played later because of a late load cell, it is that of
    /// the next tick without this delay.
    pub next_command: T,
    /// Valve command (V) of this sample, of an analog controller; NaN if unknown.
    ///
    /// Learning needs it, and plausibility compares the spool with it. Nothing is learned from a tick in which it is lost.
    pub valve_command: T,
    /// Counter of the samples (1), below 16777216, for a protection; NaN: none.
    ///
    /// It increases by one in each sample, and returns to 0 after any highest value. The protection checks it after its
    /// first value, and the period as well.
    pub alive: T,
    /// Time (s) since the last sample, for a protection; NaN if it is not measured.
    pub period: T,
    /// Load pressure (Pa), with the sign of the force, for `load_pressure_tolerance`.
    ///
    /// It is the difference `p₁ − p₂` of the chamber pressures, for equal piston areas.
    pub load_pressure: T,
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
            load_pressure: none,
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
    /// Velocity (m/s) that was measured or estimated; not finite if a measurement for it is not.
    pub velocity: T,
    /// The force command (N) that the protection permits, for an analog controller to follow. Without a protection it is
    /// the given command, also an invalid one.
    pub permitted_command: T,
    /// The protection's factor (1) on the valve command. `voltage` contains it, as the factor on the distance from the
    /// command of the known null; an analog controller must apply it.
    pub authority: T,
    /// Bits of [`status`](crate::status).
    pub status: u32,
    /// The window that closes with this tick, for the learner.
    pub window: Option<Window<T>>,
}
