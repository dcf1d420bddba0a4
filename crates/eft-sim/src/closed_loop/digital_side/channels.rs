//! Channels of several rigs, run one after another, and the outputs of controllers.

use eft_core::Flags;

use crate::closed_loop::{Precision, RigChannel, adapts};
use crate::config::{RigConfig, VelocitySource};
use crate::instruments::DelayLines;
use crate::lanes::{Num, WIDEST};
use crate::plant::Signals;

/// The parts of a rig's channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ChannelKind {
    /// The controller alone.
    Controller,
    /// The controller, and a learner.
    Learning,
    /// With a protection, or an estimate of the velocity.
    Whole,
}

impl ChannelKind {
    /// The kind for a rig.
    pub(crate) fn of(rig: &RigConfig) -> Self {
        if rig.protection.enabled || rig.controller.velocity_source != VelocitySource::Sensor {
            Self::Whole
        } else if adapts(rig) {
            Self::Learning
        } else {
            Self::Controller
        }
    }
}

/// The outputs of the controllers.
#[derive(Debug, Clone, Copy)]
pub(super) struct ControllerOutputs<S: Num> {
    /// Commands (N) that they follow at this tick and, if nothing new happens, at the next.
    pub(super) commands: [S; 2],
    /// Voltage to the converter (V).
    pub(super) voltage: S,
    /// The compensation signal (V).
    pub(super) compensation: S,
    /// Factor (1) of the protections on an analog controller's valve command.
    pub(super) authority: S,
    pub(super) status: S::Flags,
}

/// The outputs of the channels at one tick, one number per lane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ChannelOutputs {
    voltage: [f64; WIDEST],
    compensation: [f64; WIDEST],
    velocity: [f64; WIDEST],
    /// Commands (N) that the protections permit now and, if nothing new happens, at the next tick.
    permitted: [[f64; WIDEST]; 2],
    authority: [f64; WIDEST],
    status: [u32; WIDEST],
}

/// One tick of one channel per lane, with the commands (N) of this tick and the next, and the present valve
/// command (V).
// Not inlined, so that the code of a whole channel is compiled once for all numbers of lanes.
#[inline(never)]
fn step_channels<S: Num, P: Precision>(
    channels: &mut [RigChannel<P>],
    outputs: &mut ChannelOutputs,
    measured: &Signals<S>,
    [command, next_command, voltage]: [S; 3],
    computation: &mut DelayLines,
) {
    for (i, channel) in channels.iter_mut().enumerate().take(WIDEST) {
        let next = next_command.lane(i);
        let input = measured.lane(i).input(command.lane(i), next, voltage.lane(i));
        let out = channel.step_via(&input, |v| P::from_f64(computation.delay_lane(i, v.to_f64())));
        outputs.voltage[i] = out.voltage;
        outputs.compensation[i] = out.compensation;
        outputs.velocity[i] = out.velocity;
        outputs.permitted[0][i] = out.permitted_command;
        outputs.permitted[1][i] = channel.preview(next);
        outputs.authority[i] = out.authority;
        outputs.status[i] = out.status;
    }
}

/// Runs one channel per lane.
#[inline(always)]
pub(super) fn run_channels<S: Num, P: Precision>(
    channels: &mut [RigChannel<P>],
    outputs: &mut ChannelOutputs,
    kind: ChannelKind,
    computation: &mut DelayLines,
    [command, next_command]: [S; 2],
    measured: &mut Signals<S>,
    voltage: S,
) -> ControllerOutputs<S> {
    step_channels(channels, outputs, measured, [command, next_command, voltage], computation);
    let of = |values: &[f64; WIDEST]| S::from_lanes(|i| values[i]);
    // A controller without protection passes its command on in double precision.
    let mut commands = [command, next_command];
    if kind != ChannelKind::Controller {
        measured.velocity = of(&outputs.velocity);
        commands = [of(&outputs.permitted[0]), of(&outputs.permitted[1])];
    }
    ControllerOutputs {
        commands,
        voltage: of(&outputs.voltage),
        compensation: of(&outputs.compensation),
        authority: of(&outputs.authority),
        status: S::Flags::from_lanes(|i| outputs.status[i]),
    }
}
