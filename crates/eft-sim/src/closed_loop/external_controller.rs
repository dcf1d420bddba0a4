//! An external controller that replaces a rig's own.

/// An external controller. Its inputs are the command (N), the readings of velocity (m/s), force (N), spool
/// opening (1), displacement (m), supply pressure (Pa) and acceleration (m/s²), and the next command (N).
pub(crate) type ExternalController = Box<dyn FnMut([f32; 8]) -> ExternalOutput + Send>;

/// The answer of an external controller to one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExternalOutput {
    /// Valve command (V).
    pub valve_command: f32,
    /// Compensation signal (V) in it.
    pub compensation: f32,
    /// Bits of [`eft_core::status`].
    pub status: u32,
    /// Velocity (m/s) that it used; read only if the rig's controller estimates the velocity.
    pub velocity: f32,
    /// Estimated ratio of the true flow to the table's (1). This and the following fields are read only if
    /// the rig adapts.
    pub flow_gain: f32,
    /// Delay (s) for which it compensates.
    pub response_delay: f32,
    /// The spool's gain over the configured one (1).
    pub valve_gain: f32,
    /// The guard's factor on the compensation level (1).
    pub level: f32,
}
