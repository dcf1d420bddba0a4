//! Computes the valve command: by controllers or learning channels side by side, by one channel per lane, or
//! by an external controller.

use eft_core::{ControllerInput, ControllerOutput, ControllerState, Mask, Real, Scalar};

use crate::closed_loop::digital_side::channels::ControllerOutputs;
use crate::closed_loop::digital_side::parts::{ControllerSource, DigitalSide};
use crate::closed_loop::signals::{convert, convert_flags};
use crate::closed_loop::{DigitalOutput, Estimates, ExternalOutput, LearningLanes, Precision};
use crate::instruments::DelayLines;
use crate::lanes::Num;
use crate::plant::{AnyDrive, Signals};

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
fn outputs<S: Num, C: Scalar>(commands: [S; 2], out: &ControllerOutput<C>) -> ControllerOutputs<S> {
    ControllerOutputs {
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
    voltage: S,
) -> ControllerOutputs<S> {
    let path = |compensation: C| if IDEAL { compensation } else { computation.delay(compensation) };
    let input = input(commands, measured);
    let out = learning.step(&input, convert(voltage), path);
    measured.velocity = convert(input.velocity);
    outputs([convert(input.command), convert(input.next_command)], &out)
}

impl<S: Num, C: Scalar<Element: Precision>> DigitalSide<S, C> {
    /// Runs controllers side by side with the configured calibration.
    #[inline(always)]
    pub(super) fn control<const IDEAL: bool>(
        &mut self,
        state: &mut ControllerState<C>,
        commands: [S; 2],
        measured: &Signals<S>,
    ) -> ControllerOutputs<S> {
        let computation = &mut self.computation;
        let path = |compensation: C| if IDEAL { compensation } else { computation.delay(compensation) };
        let out = self.controller.step(state, &input(commands, measured), &self.calibration, path);
        outputs(commands, &out)
    }

    /// Runs the external controller.
    #[inline(never)]
    pub(super) fn run_external(
        &mut self,
        [command, next_command]: [S; 2],
        mut measured: Signals<S>,
    ) -> DigitalOutput<S> {
        let Signals { velocity, force, spool, displacement, supply_pressure, acceleration, .. } = measured;
        let signals =
            [command, velocity, force, spool, displacement, supply_pressure, acceleration, next_command];
        let answer = match &mut self.source {
            ControllerSource::External(controller) => {
                controller(signals.map(|signal| signal.lane(0).to_f64() as f32))
            }
            _ => ExternalOutput::default(),
        };
        if self.estimates_velocity {
            measured.velocity = convert(answer.velocity);
        }
        if self.adapts {
            self.estimates.update(Estimates {
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
            driver: AnyDrive::held(valve_command),
        }
    }
}
