//! The common interface of closed loops, of one rig or of several side by side.

use eft_core::SavedCalibration;

use crate::closed_loop::tick::Recorder;
use crate::lanes::Num;
use crate::plant::EnergyBalance;

/// A closed loop that can run a test.
pub(crate) trait ClosedLoop<S: Num> {
    /// Runs up to `ticks` ticks and returns how many began with a bounded state. The commands (N), one slice
    /// per actuator, may be longer. The last value of a command that ends is held.
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize;
    /// Where the plant's state is finite and bounded.
    fn is_bounded(&self) -> S::Mask;
    /// Puts the plants back to rest where the mask is true.
    fn restart(&mut self, at: S::Mask);
    /// Starts the soft end of the protections, if there are any.
    fn end(&mut self);
    /// As [`DigitalSide::found_flows`](crate::closed_loop::digital_side::DigitalSide::found_flows), for one
    /// actuator.
    fn found_flows(&self, actuator: usize, openings: &[f64], lane: usize) -> Option<Vec<f64>>;
    /// As [`DigitalSide::saved`](crate::closed_loop::digital_side::DigitalSide::saved), of an actuator.
    fn saved(&self, actuator: usize, lane: usize) -> Option<SavedCalibration>;
    /// The energy balance of a lane until now, if the plant computes it.
    fn balance(&self, lane: usize) -> Option<EnergyBalance>;
    /// Reason why an external structure could not continue.
    fn failure(&self) -> Option<&str> {
        None
    }
}
