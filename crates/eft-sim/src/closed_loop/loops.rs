//! What every closed loop can do, of one rig or of several side by side.

use eft_core::Scalar;

use crate::closed_loop::chunk;
use crate::closed_loop::controller::Precision;
use crate::closed_loop::fast::{FastLoop, LoopState};
use crate::closed_loop::general::GeneralLoop;
use crate::closed_loop::method::Method;
use crate::closed_loop::tick::Recorder;
use crate::config::RigConfig;
use crate::error::Result;
use crate::lanes::Num;
use crate::plant::{EnergyBalance, TimeGrid};

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

/// The paper's rig, and its state.
pub(crate) struct PlainTest<S: Num, C: Scalar>
where
    C::Element: Precision,
{
    pub(crate) test: FastLoop<S, C>,
    state: LoopState<S, C>,
}

impl<S: Num, C: Scalar> PlainTest<S, C>
where
    C::Element: Precision,
{
    /// The tests of `rig(0)`, `rig(1)`, … at rest, one a lane.
    pub(crate) fn new<'a>(
        rig: impl Fn(usize) -> &'a RigConfig,
        grid: TimeGrid,
        method: Method,
    ) -> Result<Self> {
        let test = FastLoop::new(rig, grid, method)?;
        Ok(Self { state: test.at_rest(), test })
    }
}

impl<S: Num, C: Scalar> ClosedLoop<S> for PlainTest<S, C>
where
    C::Element: Precision,
{
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize {
        let actuators = commands.iter().zip(recorders);
        let run = |(commands, recorder): (&&[S], _)| {
            chunk::run(&mut self.test, &mut self.state, commands, ticks, recorder)
        };
        actuators.map(run).sum()
    }
    fn is_bounded(&self) -> S::Mask {
        FastLoop::<S, C>::is_bounded(&self.state)
    }
    fn restart(&mut self, at: S::Mask) {
        FastLoop::<S, C>::restart(&mut self.state, at);
    }
    fn end(&mut self) {
        self.test.digital().end();
    }
    fn found_flows(&self, _: usize, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        self.test.digital_side().found_flows(openings, lane)
    }
    fn balance(&self, _: usize) -> Option<EnergyBalance> {
        None
    }
}

impl<S: Num, C: Scalar> ClosedLoop<S> for GeneralLoop<S, C>
where
    C::Element: Precision,
{
    fn run(&mut self, commands: &[&[S]], ticks: usize, recorders: &mut [impl Recorder<S>]) -> usize {
        self.run(commands, ticks, recorders)
    }
    fn is_bounded(&self) -> S::Mask {
        self.is_bounded()
    }
    fn restart(&mut self, at: S::Mask) {
        self.restart(at);
    }
    fn end(&mut self) {
        self.sides().for_each(|side| side.end());
    }
    fn found_flows(&self, actuator: usize, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        self.side(actuator).found_flows(openings, lane)
    }
    fn balance(&self, lane: usize) -> Option<EnergyBalance> {
        self.balance(lane)
    }
    fn failure(&self) -> Option<&str> {
        self.failure()
    }
}
