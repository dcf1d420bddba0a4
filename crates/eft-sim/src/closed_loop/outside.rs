//! A controller that runs outside of this program, in the place of a rig's own.

/// A controller outside of this program: the answer to command (N), and what the sensors report of velocity (m/s), force
/// (N), spool opening (1), displacement (m), supply pressure (Pa) and acceleration (m/s²), and to the next command (N).
pub(crate) type Outside = Box<dyn FnMut([f32; 8]) -> Answer + Send>;

/// What a controller outside of this program answers to one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Answer {
    /// Valve command (V).
    pub valve_command: f32,
    /// Compensation signal (V) in it.
    pub compensation: f32,
    /// Bits of [`eft_core::status`].
    pub status: u32,
    /// Velocity (m/s) that it took; looked at where the rig's controller estimates it.
    pub velocity: f32,
    /// True flow over the table's (1) as it was found; this and the rest is looked at where the rig adapts.
    pub flow_gain: f32,
    /// Delay (s) that it makes up for.
    pub response_delay: f32,
    /// The spool's gain over the configured one (1).
    pub valve_gain: f32,
    /// The guard's factor on the compensation level (1).
    pub level: f32,
}
