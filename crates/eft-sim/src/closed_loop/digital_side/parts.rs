//! The parts of a digital side.

use eft_core::{Calibration, Scalar};

use crate::closed_loop::digital_side::channels::{ChannelKind, ChannelOutputs};
use crate::closed_loop::{
    EstimatesInUse, ExternalController, LearningLanes, Precision, RigChannel, RigController,
};
use crate::config::Realization;
use crate::instruments::{CommandDelay, Dac, DelayLines, Sensors};
use crate::lanes::Num;
use crate::plant::{Analog, AnyDrive};

/// A plant in its present state.
// A trait instead of a closure: a closure called twice is not inlined, and then does not use the processor's
// vector instructions.
pub(crate) trait Feedback<S: Num> {
    /// The valve command (V) of a drive for the plant's present state.
    fn command(&self, driver: &AnyDrive<S>) -> S;
}

/// The source of the valve command.
pub(super) enum ControllerSource<S: Num, C: Scalar<Element: Precision>> {
    /// Controllers side by side, without learning, protection or velocity estimate.
    SideBySide,
    /// Learning channels side by side.
    Learning(Box<LearningLanes<S, C>>),
    /// One channel per lane.
    Channels(Vec<RigChannel<C::Element>>, Box<ChannelOutputs>),
    /// An external controller, for one rig.
    External(ExternalController),
}

impl<S: Num, C: Scalar<Element: Precision>> ControllerSource<S, C> {
    /// The channels, if they compute the valve command.
    pub(super) fn channels(&mut self) -> &mut [RigChannel<C::Element>] {
        if let Self::Channels(channels, _) = self { channels } else { &mut [] }
    }

    /// The calibration in use of a lane, if it learns.
    pub(super) fn calibration(&self, lane: usize) -> Option<&Calibration<C::Element>> {
        match self {
            Self::Learning(learning) => learning.calibration(lane),
            Self::Channels(channels, _) => channels.get(lane)?.calibration(),
            Self::SideBySide | Self::External(_) => None,
        }
    }
}

/// Sensors, controller and converter of one actuator, or of several rigs' side by side; `C` is the controller's
/// number.
pub(crate) struct DigitalSide<S: Num, C: Scalar<Element: Precision>> {
    pub(super) kind: ChannelKind,
    pub(super) source: ControllerSource<S, C>,
    /// Whether the instruments are ideal and the loop analog.
    pub(super) ideal: bool,
    /// The controllers side by side.
    pub(super) controller: RigController<C>,
    /// Their configured calibration.
    pub(super) calibration: Box<Calibration<C>>,
    pub(super) estimates: EstimatesInUse<S>,
    /// For analog controllers since the last tick: the command (N) at the end of the interval, its rate (N/s)
    /// and the compensation (V).
    pub(super) last_analog: Option<[S; 3]>,
    /// The compensation (V) before the first tick, which holds the valve at its known or saved null.
    pub(super) null_signal: S,
    pub(super) estimates_velocity: bool,
    pub(super) adapts: bool,
    pub(super) computation: DelayLines,
    /// `None` if no load cell has a known latency.
    pub(super) command_delay: Option<CommandDelay<S>>,
    pub(super) realization: Realization,
    pub(super) analog: Analog<S>,
    /// `None` if the sensors of every lane are ideal.
    pub(super) sensors: Option<Sensors<S>>,
    pub(super) dac: Dac,
    pub(super) sample_rate: f64,
    /// Whether a trace is kept of the analog valve command, which nothing else needs.
    pub(super) records_valve_command: bool,
}
