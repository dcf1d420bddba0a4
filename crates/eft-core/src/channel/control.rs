//! The controller's part of a tick, and the sums of the learner's window.

use crate::channel::state::{TrustedSignals, in_use};
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
        trusted: &TrustedSignals<T>,
        path: impl FnOnce(T) -> T,
    ) -> ControllerOutput<T> {
        let command = trusted.command;
        let signals = ControllerInput {
            command,
            next_command: if parts.looks_ahead { self.preview(state, input.next_command) } else { command },
            velocity: trusted.velocity,
            force: trusted.force,
            spool: trusted.spool,
            supply_pressure: input.supply_pressure,
        };
        let supply = if parts.measures_supply {
            self.controller.supply(&mut state.controller, signals.supply_pressure)
        } else {
            Supply::nominal()
        };
        let sample = Sample {
            looks_ahead: parts.looks_ahead,
            integrates: parts.integrates,
            has_overlap: parts.has_overlap,
            friction: parts.has_friction.then(|| self.controller.friction.against(signals.velocity)),
            ..self.controller.sample(&state.controller, &signals, supply)
        };
        if !sample.valid {
            self.count_refused(parts, state, measured);
            return self.controller.step_invalid(&mut state.controller, sample, path);
        }
        let watched = parts.plausibility.is_some();
        let summed = self.learns && !(watched && state.protection.is_tripped());
        if summed && parts.realization == Realization::Digital {
            // Before the controller replaces it.
            state.window.add_command(true, state.controller.valve_command());
        }
        let calibration = if watched {
            in_use(&state.calibrations, state.in_use.slot, &state.history)
        } else {
            state.in_use.slot.of(&state.calibrations)
        };
        // The same source is compiled twice, so that an ordinary tick does not pay for the one after a gap.
        let out = if sample.resumes {
            let sample = Sample { valid: true, resumes: true, ..sample };
            self.controller.step_valid(&mut state.controller, sample, calibration, path)
        } else {
            let sample = Sample { valid: true, resumes: false, ..sample };
            self.controller.step_valid(&mut state.controller, sample, calibration, path)
        };
        if summed {
            let now = Moment { force: sample.oil_force(signals.force), command: sample.oil_force(command) };
            state.window.add(true, measured, signals.spool, now);
            if parts.measures_supply {
                state.window.supply = supply.ratio;
            }
            if parts.realization == Realization::Analog {
                state.window.add_sampled_command(true, input.valve_command, signals.spool);
            }
        } else if self.learns {
            state.window.lose(true);
        }
        out
    }

    /// Counts a tick that the controller refuses.
    #[inline(always)]
    fn count_refused(&self, parts: Parts<'_, T, N>, state: &mut ChannelState<T>, measured: T) {
        if self.learns {
            state.window.lose(true);
        }
        if !matches!(parts.velocity, Velocity::Sensor) {
            let before = state.velocity_gap_before();
            state.velocity_gap = if measured.is_finite() { 0 } else { before.saturating_add(1) };
        }
    }
}
