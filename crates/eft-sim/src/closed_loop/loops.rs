//! The common interface of closed loops, of one rig or of several side by side.

use eft_core::Scalar;

use crate::closed_loop::{DigitalSide, Precision, Recorder, TestRun};
use crate::lanes::Num;
use crate::plant::EnergyBalance;

/// A closed loop that can run a test; `C` is the controller's number.
pub(crate) trait ClosedLoop<S: Num, C: Scalar<Element: Precision>> {
    /// Runs up to `ticks` ticks and returns how many began with a bounded state. The commands (N), one slice
    /// per actuator, may be longer. The last value of a command that ends is held.
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize;
    /// Where the plant's state is finite and bounded.
    fn is_bounded(&self) -> S::Mask;
    /// Puts the plants back to rest where the mask is true.
    fn restart(&mut self, at: S::Mask);
    /// One per actuator.
    fn digital_sides(&mut self) -> &mut [DigitalSide<S, C>];
    /// The energy balance of a lane until now, if the plant computes it.
    fn balance(&self, _lane: usize) -> Option<EnergyBalance> {
        None
    }
    /// Reason why an external structure could not continue.
    fn failure(&self) -> Option<&str> {
        None
    }
    /// Starts the soft end of the protections, if there are any.
    fn end(&mut self) {
        self.digital_sides().iter_mut().for_each(DigitalSide::end);
    }
    /// Adds to a run of an actuator what is known at its end.
    fn complete(&mut self, run: &mut TestRun, actuator: usize, lane: usize) {
        let side = &self.digital_sides()[actuator];
        run.set_found_flows(|openings| side.found_flows(openings, lane));
        run.calibration = side.saved(lane);
        run.energy = self.balance(lane);
    }
}
