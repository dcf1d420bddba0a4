//! From the controllers' outputs to the drives of the valves.

use eft_core::{Flags, Mask, Scalar, status};

use crate::closed_loop::digital_side::channels::ControllerOutputs;
use crate::closed_loop::digital_side::parts::{ControllerSource, DigitalSide, Feedback};
use crate::closed_loop::{DigitalOutput, Precision};
use crate::config::Realization;
use crate::instruments::AnalogOutput;
use crate::lanes::Num;
use crate::plant::{AnalogWithCell, AnyDrive, Signals};

impl<S: Num, C: Scalar<Element: Precision>> DigitalSide<S, C> {
    /// The valve command (V) of analog controllers until now, with a command (N) at the first tick; zero for
    /// digital ones.
    #[inline(always)]
    pub(super) fn analog_command<const IDEAL: bool>(
        &self,
        command: S,
        cell: AnalogOutput<S>,
        plant: &impl Feedback<S>,
    ) -> S {
        let zero = S::splat(0.0);
        if !IDEAL && self.realization == Realization::Digital {
            return zero;
        }
        let first = || match &self.source {
            ControllerSource::Channels(channels, _) => {
                S::from_lanes(|i| channels.get(i).map_or(0.0, |one| one.preview(command.lane(i))))
            }
            _ => command,
        };
        let [command, rate, compensation] = match self.last_analog {
            Some(last) => last,
            None => [if IDEAL { command } else { first() }, zero, self.null_signal],
        };
        let analog = self.analog.at(command, rate, compensation);
        plant.command(&AnyDrive::analog(
            analog.with_cell((cell.gain, cell.offset)),
            IDEAL || self.sensors.is_none(),
        ))
    }

    /// Applies the converter, and returns the drive of the valve until the next tick under the permitted
    /// commands (N). `measured` has the velocity that the controllers used. `IDEAL` selects the copy for ideal
    /// instruments and an analog loop, `KEEPS_ANALOG` the copy for callers of
    /// [`analog_command`](Self::present_command).
    #[inline(always)]
    pub(super) fn drive<const IDEAL: bool, const KEEPS_ANALOG: bool>(
        &mut self,
        out: ControllerOutputs<S>,
        measured: &Signals<S>,
        cell: AnalogOutput<S>,
        plant: &impl Feedback<S>,
    ) -> DigitalOutput<S> {
        let [command, next_command] = out.commands;
        let (output, clipped) =
            if IDEAL { (out.voltage, S::Flags::default()) } else { self.dac.convert(out.voltage) };
        let (measured, status) = (*measured, out.status | clipped);
        if !IDEAL && self.realization == Realization::Digital {
            let (compensation, driver) = (out.compensation, AnyDrive::held(output));
            return DigitalOutput { measured, valve_command: output, compensation, status, driver };
        }
        let mut rate = (next_command - command) * S::splat(self.sample_rate);
        // Only a protection can open the loop.
        let has_protection = !IDEAL && matches!(self.source, ControllerSource::Channels(..));
        let is_open = |i: usize| has_protection && out.status.lane(i) & status::FORCE_LOOP_OPEN != 0;
        let open = has_protection && (0..S::LANES).any(is_open);
        let analog = if !open {
            self.analog.at(command, rate, output).with_cell((cell.gain, cell.offset))
        } else {
            // An open loop ignores the force error.
            let closed = |value: S| S::from_lanes(|i| if is_open(i) { 0.0 } else { value.lane(i) });
            rate = closed(rate);
            self.analog.at(closed(command), rate, output).with_cell((closed(cell.gain), closed(cell.offset)))
        };
        if KEEPS_ANALOG {
            self.last_analog = Some([next_command, rate, output]);
        }
        let driver = if IDEAL {
            AnyDrive::analog(analog, true)
        } else {
            let unlimited = self.sensors.is_none() && out.authority.ge(S::splat(1.0)).all();
            AnyDrive::analog(AnalogWithCell { authority: out.authority, ..analog }, unlimited && !open)
        };
        let valve_command = if self.records_valve_command { plant.command(&driver) } else { S::splat(0.0) };
        DigitalOutput { measured, valve_command, compensation: output, status, driver }
    }
}
