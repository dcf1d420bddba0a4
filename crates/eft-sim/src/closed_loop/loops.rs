//! What every closed loop can do, of one rig or of several side by side.

use crate::closed_loop::tick::Recorder;
use crate::lanes::Num;
use crate::plant::EnergyBalance;

/// A closed loop that can be taken through a test.
pub(crate) trait ClosedLoop<S: Num> {
    /// Runs up to `ticks` ticks and returns how many began with a bounded state. The commands (N), one slice an
    /// actuator, may go on beyond them; where one ends with them, its last value is held.
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize;
    /// Where the plant's state is finite and bounded.
    fn is_bounded(&self) -> S::Mask;
    /// Puts the plants back to rest where the mask is true.
    fn restart(&mut self, at: S::Mask);
    /// Asks the protections, where there are any, for the soft end.
    fn end(&mut self);
    /// As [`DigitalSide::found_flows`](crate::closed_loop::digital_side::DigitalSide::found_flows), of an actuator.
    fn found_flows(&self, actuator: usize, openings: &[f64], lane: usize) -> Option<Vec<f64>>;
    /// Where the energy of a lane went so far, of a plant that keeps account of it.
    fn balance(&self, lane: usize) -> Option<EnergyBalance>;
    /// Why a structure outside could not go on.
    fn failure(&self) -> Option<&str> {
        None
    }
}
