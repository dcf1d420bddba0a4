//! From the controllers' outputs to the drives of the valves.

use eft_core::{Flags, Mask, Scalar, status};

use crate::closed_loop::digital_side::channels::ControllerOutputs;
use crate::closed_loop::digital_side::parts::{CellReading, DigitalSide, Feedback, Source};
use crate::closed_loop::{DigitalOutput, Precision};
use crate::config::Realization;
use crate::lanes::Num;
use crate::plant::{Driver, Signals, ThroughCell};

impl<S: Num, C: Scalar<Element: Precision>> DigitalSide<S, C> {
    /// The valve command (V) of analog controllers until now, with a command (N) at the first tick; zero for
    /// digital ones.
    #[inline(always)]
    pub(super) fn present_command<const IDEAL: bool>(
        &self,
        command: S,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
    ) -> S {
        let zero = S::splat(0.0);
        if !IDEAL && self.realization == Realization::Digital {
            return zero;
        }
        let first = || match &self.source {
            Source::Channels(channels, _) => {
                S::from_lanes(|i| channels.get(i).map_or(0.0, |one| one.preview(command.lane(i))))
            }
            _ => command,
        };
        let [command, rate, compensation] = match self.before {
            Some(before) => before,
            None => [if IDEAL { command } else { first() }, zero, self.null_signal],
        };
        let analog = self.analog.at(command, rate, compensation);
        plant.command(&Driver::analog(analog.through((cell.gain, cell.offset)), IDEAL || cell.ideal))
    }

    /// Applies the converter, and returns the drive of the valve until the next tick under the permitted
    /// commands (N). `measured` has the velocity that the controllers used. `IDEAL` selects the copy for ideal
    /// instruments and an analog loop, `REMEMBERS` the copy for callers of
    /// [`present_command`](Self::present_command).
    #[inline(always)]
    pub(super) fn drive<const IDEAL: bool, const REMEMBERS: bool>(
        &mut self,
        out: ControllerOutputs<S>,
        measured: &Signals<S>,
        cell: CellReading<S>,
        plant: &impl Feedback<S>,
    ) -> DigitalOutput<S> {
        let [command, next_command] = out.commands;
        let (output, clipped) =
            if IDEAL { (out.voltage, S::Flags::default()) } else { self.dac.convert(out.voltage) };
        let (measured, status) = (*measured, out.status | clipped);
        if !IDEAL && self.realization == Realization::Digital {
            let (compensation, driver) = (out.compensation, Driver::held(output));
            return DigitalOutput { measured, valve_command: output, compensation, status, driver };
        }
        let mut rate = (next_command - command) * S::splat(self.sample_rate);
        // Only a protection can open the loop.
        let watched = !IDEAL && matches!(self.source, Source::Channels(..));
        let is_open = |i: usize| watched && out.status.lane(i) & status::FORCE_LOOP_OPEN != 0;
        let open = watched && (0..S::LANES).any(is_open);
        let behind = if !open {
            self.analog.at(command, rate, output).through((cell.gain, cell.offset))
        } else {
            // An open loop ignores the force error.
            let of = |value: S| S::from_lanes(|i| if is_open(i) { 0.0 } else { value.lane(i) });
            rate = of(rate);
            self.analog.at(of(command), rate, output).through((of(cell.gain), of(cell.offset)))
        };
        if REMEMBERS {
            self.before = Some([next_command, rate, output]);
        }
        let driver = if IDEAL {
            Driver::analog(behind, true)
        } else {
            let whole = cell.ideal && out.authority.ge(S::splat(1.0)).all();
            Driver::analog(ThroughCell { authority: out.authority, ..behind }, whole && !open)
        };
        let valve_command = if self.traces { plant.command(&driver) } else { S::splat(0.0) };
        DigitalOutput { measured, valve_command, compensation: output, status, driver }
    }
}
