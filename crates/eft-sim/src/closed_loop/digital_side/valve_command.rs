//! Computes the valve command: by controllers or learning channels side by side, by one channel per lane, or
//! by an external controller.

use eft_core::{ControllerInput, ControllerOutput, ControllerState, Flags, Mask, Real, Scalar};

use crate::closed_loop::channels::{ChannelKind, ChannelOutputs, step_channels};
use crate::closed_loop::digital_side::drive::Outputs;
use crate::closed_loop::digital_side::parts::{DigitalSide, Source};
use crate::closed_loop::signals::{convert, convert_flags};
use crate::closed_loop::{DigitalOutput, Estimates, ExternalOutput, LearningLanes, Precision, RigChannel};
use crate::instruments::DelayLines;
use crate::lanes::{Num, WIDEST};
use crate::plant::{Driver, Signals};

/// The input of the controllers in their precision.
#[inline(always)]
fn input<S: Num, C: Scalar<Element: Precision>>(
    [command, next_command]: [S; 2],
    measured: &Signals<S>,
) -> ControllerInput<C> {
    ControllerInput {
        command: convert(command),
        next_command: convert(next_command),
        velocity: convert(measured.velocity),
        force: convert(measured.force),
        spool: convert(measured.spool),
        supply_pressure: convert(measured.supply_pressure),
    }
}

/// The outputs of controllers without a protection.
#[inline(always)]
fn outputs<S: Num, C: Scalar>(commands: [S; 2], out: &ControllerOutput<C>) -> Outputs<S> {
    Outputs {
        commands,
        voltage: convert(out.valve_command),
        compensation: convert(out.compensation),
        authority: S::splat(1.0),
        status: convert_flags(out.status),
    }
}

/// Runs learning channels side by side; `present` is the valve command (V) until now.
#[inline(always)]
pub(super) fn learn<const IDEAL: bool, S: Num, C: Scalar<Element: Precision>>(
    learning: &mut LearningLanes<S, C>,
    computation: &mut DelayLines,
    commands: [S; 2],
    measured: &mut Signals<S>,
    present: S,
) -> Outputs<S> {
    let path = |compensation: C| if IDEAL { compensation } else { computation.pass(compensation) };
    let input = input(commands, measured);
    let out = learning.step(&input, convert(present), path);
    measured.velocity = convert(input.velocity);
    outputs([convert(input.command), convert(input.next_command)], &out)
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
    present: S,
) -> Outputs<S> {
    step_channels(channels, outputs, measured, [command, next_command, present], computation);
    let of = |values: &[f64; WIDEST]| S::from_lanes(|i| values[i]);
    // A controller without protection passes its command on in double precision.
    let mut commands = [command, next_command];
    if kind != ChannelKind::Controller {
        measured.velocity = of(&outputs.velocity);
        commands = [of(&outputs.permitted[0]), of(&outputs.permitted[1])];
    }
    Outputs {
        commands,
        voltage: of(&outputs.voltage),
        compensation: of(&outputs.compensation),
        authority: of(&outputs.authority),
        status: S::Flags::from_lanes(|i| outputs.status[i]),
    }
}

impl<S: Num, C: Scalar<Element: Precision>> DigitalSide<S, C> {
    /// Runs controllers side by side with the configured calibration.
    #[inline(always)]
    pub(super) fn control<const IDEAL: bool>(
        &mut self,
        state: &mut ControllerState<C>,
        commands: [S; 2],
        measured: &Signals<S>,
    ) -> Outputs<S> {
        let computation = &mut self.computation;
        let path = |compensation: C| if IDEAL { compensation } else { computation.pass(compensation) };
        let out = self.controller.step(state, &input(commands, measured), &self.calibration, path);
        outputs(commands, &out)
    }

    /// Runs the external controller.
    #[inline(never)]
    pub(super) fn ask(
        &mut self,
        [command, next_command]: [S; 2],
        mut measured: Signals<S>,
    ) -> DigitalOutput<S> {
        let Signals { velocity, force, spool, displacement, supply_pressure, acceleration, .. } = measured;
        let signals =
            [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command];
        let answer = match &mut self.source {
            Source::External(controller) => controller(signals.map(|signal| signal.lane(0).to_f64() as f32)),
            _ => ExternalOutput::default(),
        };
        if self.estimates_velocity {
            measured.velocity = convert(answer.velocity);
        }
        if self.adapts {
            self.estimates.follow(Estimates {
                flow_gain_estimate: convert(answer.flow_gain),
                response_delay_estimate: convert(answer.response_delay),
                valve_gain_estimate: convert(answer.valve_gain),
                level: convert(answer.level),
                ..Estimates::unknown()
            });
        }
        let (valve_command, clipped) = self.dac.convert(convert(answer.valve_command));
        DigitalOutput {
            measured,
            valve_command,
            compensation: convert(answer.compensation),
            status: S::flag(S::Mask::splat(true), answer.status) | clipped,
            driver: Driver::held(valve_command),
        }
    }
}
