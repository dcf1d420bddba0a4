//! Selects the trusted measurements, and replaces the others.

use crate::cause::Cause;
use crate::channel::state::Believed;
use crate::channel::{Channel, ChannelState};
use crate::number::Real;
use crate::parameters::Realization;
use crate::protection::{DISPLACEMENT, FORCE, Known, Plausibility, SPOOL, VELOCITY};
use crate::signals::Input;
use crate::status;
use crate::velocity::Velocity;

impl<T: Real, const N: usize> Channel<T, N> {
    /// Selects the trusted measurements, and replaces the others.
    #[inline(always)]
    pub(super) fn believe(
        &self,
        watch: &Plausibility<T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        mut believed: Believed<T>,
    ) -> Believed<T> {
        let supply = self.controller.supply(&mut state.controller, input.supply_pressure).ratio;
        let calibration = state.calibration();
        let known = Known {
            command: input.command,
            valve_command: match self.realization {
                Realization::Digital => state.controller.valve_command(),
                Realization::Analog => input.valve_command,
            },
            flow_gain: calibration.flow_gain,
            valve_gain: calibration.valve_gain,
            supply,
        };
        let cause = watch.judge(&mut state.plausibility, input, believed.velocity, &known);
        let (cause, pressure_failed) = watch.compare_pressure(&mut state.plausibility, input, cause);
        believed.status |= pressure_failed;
        state.plausibility.distrust(cause);
        match cause {
            Cause::ForceLost | Cause::ForceImplausible => state.protection.shut_down_by(cause),
            cause => state.protection.trip_by(cause),
        }
        let distrusted = state.plausibility.distrusted();
        let flags = [
            (FORCE, status::FORCE_DISTRUSTED),
            (DISPLACEMENT, status::DISPLACEMENT_DISTRUSTED),
            (VELOCITY, status::VELOCITY_DISTRUSTED),
            (SPOOL, status::SPOOL_DISTRUSTED),
        ];
        let doubted = |signal: usize| distrusted.get(signal).copied().unwrap_or(false);
        for (signal, flag) in flags {
            believed.status |= if doubted(signal) { flag } else { 0 };
        }
        if state.protection.cause().is_of_sensors() {
            // What was learned while the sensor was wrong is discarded.
            state.sound.go_back();
        }
        let zero = T::splat(0.0);
        if doubted(FORCE) {
            believed.force = zero;
        }
        if doubted(DISPLACEMENT) {
            believed.displacement = zero;
        }
        if doubted(SPOOL) {
            believed.spool = state.plausibility.spool();
        }
        let estimated = !matches!(self.velocity, Velocity::Sensor);
        if doubted(DISPLACEMENT) && (doubted(VELOCITY) || estimated) {
            // No motion signal is left, so the valve closes from its present opening.
            state.protection.shut_down_by(cause);
            state.protection.blind();
            believed.velocity = T::splat(f64::NAN);
        } else if doubted(VELOCITY) {
            believed.velocity = state.plausibility.velocity();
        }
        if state.plausibility.force_jumped() {
            believed.status |= status::FORCE_LOOP_OPEN;
        }
        believed
    }

    /// Whether the velocity may be wrong although the force is blamed. If the displacement is blamed and the force then
    /// leaves its command, the velocity was wrong.
    #[inline(always)]
    pub(super) fn doubts_velocity(&self, state: &ChannelState<T>) -> bool {
        let [force, displacement, ..] = state.plausibility.distrusted();
        let cause = state.protection.cause();
        let balance = state.plausibility.is_by_balance() || cause == Cause::ForceLevel;
        let doubted = if displacement { cause == Cause::DisplacementImplausible && !force } else { balance };
        doubted && matches!(self.velocity, Velocity::Sensor)
    }
}
