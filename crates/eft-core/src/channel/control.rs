//! The controller's part of a tick, and the sums of the learner's window.

use crate::channel::state::{Believed, in_use};
use crate::channel::{Channel, ChannelState, Parts};
use crate::controller::{ControllerInput, ControllerOutput, Sample, Supply};
use crate::learning::Moment;
use crate::number::Real;
use crate::parameters::Realization;
use crate::signals::Input;
use crate::velocity::Velocity;

impl<T: Real, const N: usize> Channel<T, N> {
    /// The controller's output, or its last one if a value is invalid. The window gets the `measured` velocity (m/s).
    #[inline(always)]
    pub(super) fn control(
        &self,
        parts: Parts<'_, T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        measured: T,
        believed: &Believed<T>,
        path: impl FnOnce(T) -> T,
    ) -> ControllerOutput<T> {
        let command = believed.command;
        let asked = ControllerInput {
            command,
            next_command: if parts.looks_ahead { self.preview(state, input.next_command) } else { command },
            velocity: believed.velocity,
            force: believed.force,
            spool: believed.spool,
            supply_pressure: input.supply_pressure,
        };
        let supply = if parts.measures_supply {
            self.controller.supply(&mut state.controller, asked.supply_pressure)
        } else {
            Supply::nominal()
        };
        let sample = Sample {
            ahead: parts.looks_ahead,
            integrates: parts.integrates,
            laps: parts.laps,
            friction: parts.rubs.then(|| self.controller.friction.against(asked.velocity)),
            ..self.controller.sample(&state.controller, &asked, supply)
        };
        if !sample.good {
            self.lose(parts, state, measured);
            return self.controller.refuse(&mut state.controller, sample, path);
        }
        let watched = parts.plausibility.is_some();
        let summed = self.learns && !(watched && state.protection.is_tripped());
        if summed && parts.realization == Realization::Digital {
            // Before the controller replaces it.
            state.window.add_command(true, state.controller.valve_command());
        }
        let calibration = if watched {
            in_use(&state.calibrations, state.in_use.slot, &state.sound)
        } else {
            state.in_use.slot.of(&state.calibrations)
        };
        // The same source is compiled twice, so that an ordinary tick does not pay for the one after a gap.
        let out = if sample.rests {
            let sample = Sample { good: true, rests: true, ..sample };
            self.controller.follow(&mut state.controller, sample, calibration, path)
        } else {
            let sample = Sample { good: true, rests: false, ..sample };
            self.controller.follow(&mut state.controller, sample, calibration, path)
        };
        if summed {
            let now = Moment { force: sample.carried(asked.force), command: sample.carried(command) };
            state.window.add(true, measured, asked.spool, now);
            if parts.measures_supply {
                state.window.supply = supply.ratio;
            }
            if parts.realization == Realization::Analog {
                state.window.add_sampled_command(true, input.valve_command, asked.spool);
            }
        } else if self.learns {
            state.window.lose(true);
        }
        out
    }

    /// Counts a tick that the controller refuses.
    #[inline(always)]
    fn lose(&self, parts: Parts<'_, T, N>, state: &mut ChannelState<T>, measured: T) {
        if self.learns {
            state.window.lose(true);
        }
        if !matches!(parts.velocity, Velocity::Sensor) {
            let before = state.velocity_gap_before();
            state.velocity_gap = if measured.is_finite() { 0 } else { before.saturating_add(1) };
        }
    }
}
