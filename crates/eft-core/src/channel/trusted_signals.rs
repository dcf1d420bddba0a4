//! The measurements and the command that controller and trip levels use.

use crate::cause::Cause;
use crate::channel::state::TrustedSignals;
use crate::channel::{Channel, ChannelState, Parts};
use crate::number::Real;
use crate::parameters::Realization;
use crate::protection::{Control, Plausibility, Protected, ProtectionInput};
use crate::signals::Input;
use crate::status;
use crate::velocity::Velocity;

/// Share of the force loop's gains that is removed after a trip while the displacement's derivative replaces the
/// velocity.
const GAIN_REDUCTION: f64 = 0.5;

impl<T: Real, const N: usize> Channel<T, N> {
    /// Selects the trusted measurements, and replaces the others.
    #[inline(always)]
    pub(super) fn select_trusted(
        &self,
        watch: &Plausibility<T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        mut trusted: TrustedSignals<T>,
    ) -> TrustedSignals<T> {
        let cause = self.judge_signals(watch, state, input, &mut trusted);
        self.restore_learned(state);
        if state.protection.is_tripped() {
            self.replace_invalid(state, &mut trusted);
        }
        self.replace_distrusted(state, cause, &mut trusted);
        if state.plausibility.force_jumped() {
            trusted.status |= status::FORCE_LOOP_OPEN;
        }
        trusted
    }

    /// Compares the measurements with each other, trips by a contradiction, and flags the distrusted ones.
    #[inline(always)]
    fn judge_signals(
        &self,
        watch: &Plausibility<T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        trusted: &mut TrustedSignals<T>,
    ) -> Cause {
        let supply = self.controller.supply(&mut state.controller, input.supply_pressure).ratio;
        let calibration = state.calibration();
        let control = Control {
            command: input.command,
            valve_command: match self.realization {
                Realization::Digital => state.controller.valve_command(),
                Realization::Analog => input.valve_command,
            },
            flow_gain: calibration.flow_gain,
            valve_gain: calibration.valve_gain,
            supply,
            tripped: state.protection.is_tripped(),
        };
        let cause = watch.judge(&mut state.plausibility, input, trusted.velocity, &control);
        let (cause, pressure_failed) = watch.compare_pressure(&mut state.plausibility, input, cause);
        trusted.status |= pressure_failed;
        state.plausibility.distrust(cause);
        match cause {
            Cause::ForceLost | Cause::ForceImplausible => state.protection.shut_down_by(cause),
            cause => state.protection.trip_by(cause),
        }
        if matches!(cause, Cause::VelocityLost | Cause::DisplacementLost | Cause::SpoolLost) {
            // Its samples no longer count, and another sensor that was lost a little later has its own time.
            state.protection.lost_measurements = 0;
        }
        let flags = [
            status::FORCE_DISTRUSTED,
            status::DISPLACEMENT_DISTRUSTED,
            status::VELOCITY_DISTRUSTED,
            status::SPOOL_DISTRUSTED,
        ];
        for (distrusted, flag) in state.plausibility.distrusted.into_iter().zip(flags) {
            trusted.status |= if distrusted { flag } else { 0 };
        }
        cause
    }

    /// Discards what was learned while a sensor was wrong.
    #[inline(always)]
    fn restore_learned(&self, state: &mut ChannelState<T>) {
        // A force far from its command may be wrong as well, and opens the loop.
        let loop_open = state.protection.is_shut_down();
        if !(state.protection.cause().is_of_sensors() || loop_open) {
            return;
        }
        state.history.restore();
        let [force_distrusted, ..] = state.plausibility.distrusted;
        if (force_distrusted || loop_open) && self.estimates_velocity() {
            // The delay of an estimate depends on the motion's frequency, which changes when the loop opens. Too
            // much lead makes a growing swing then, and too little a damped one.
            state.history.reduce_lead(&self.controller.nominal());
        }
    }

    /// Replaces lost readings by the last accepted ones: a held valve command would go on with the noise of its last sample.
    #[inline(always)]
    fn replace_invalid(&self, state: &ChannelState<T>, trusted: &mut TrustedSignals<T>) {
        let [force, _, velocity, spool] = state.plausibility.accepted();
        let or_last = |reading: T, last: T| if reading.is_finite() { reading } else { last };
        trusted.force = or_last(trusted.force, force);
        trusted.spool = or_last(trusted.spool, spool);
        if !self.estimates_velocity() {
            trusted.velocity = or_last(trusted.velocity, velocity);
        }
    }

    /// Replaces distrusted measurements by what the others show.
    #[inline(always)]
    fn replace_distrusted(&self, state: &mut ChannelState<T>, cause: Cause, trusted: &mut TrustedSignals<T>) {
        let zero = T::splat(0.0);
        let [force, displacement, velocity, spool] = state.plausibility.distrusted;
        if force {
            trusted.force = zero;
        }
        if displacement {
            trusted.displacement = zero;
        }
        if spool {
            trusted.spool = state.plausibility.spool();
        }
        if displacement && (velocity || self.estimates_velocity()) {
            if force || spool {
                // Nothing shows the motion any more, so the valve closes from its present opening.
                state.protection.shut_down_by(cause);
                state.protection.motion_unknown = true;
                trusted.velocity = T::splat(f64::NAN);
            } else {
                state.protection.motion_by_flow = true;
                trusted.velocity = state.plausibility.velocity_by_flow();
            }
        } else if velocity || force && matches!(self.velocity, Velocity::Observer(..)) {
            // An observer of displacement and force contains the wrong force.
            trusted.velocity = state.plausibility.velocity;
        }
    }

    /// Whether the velocity is estimated from the displacement.
    fn estimates_velocity(&self) -> bool {
        !matches!(self.velocity, Velocity::Sensor)
    }

    /// Lets the protection limit the command. After a trip it also replaces the velocity that is compensated for.
    /// Returns the authority over the valve.
    #[inline(always)]
    pub(super) fn limit_command(
        &self,
        parts: Parts<'_, T, N>,
        state: &mut ChannelState<T>,
        input: &Input<T>,
        trusted: &mut TrustedSignals<T>,
    ) -> T {
        let Some(protection) = parts.protection else {
            return T::splat(1.0);
        };
        let TrustedSignals { command, force, displacement, velocity, spool, .. } = *trusted;
        let (alive, period) = (input.alive, input.period);
        let protected = protection.step(
            &mut state.protection,
            &ProtectionInput { command, force, displacement, velocity, spool, alive, period },
        );
        trusted.command = protected.command;
        trusted.status |= protected.status;
        if let Some(watch) = parts.plausibility {
            trusted.velocity = self.compensated_velocity(watch, state, trusted, &protected);
            let mut brake = T::splat(0.0);
            if protected.open {
                // Without a force error the loop is open, and leakage damps the oil's spring.
                trusted.force = protected.command;
                trusted.status |= status::FORCE_LOOP_OPEN;
                // A wrong force has wound the integral up.
                state.controller.forget();
            } else if let Some(share) = state.protection.braking() {
                brake = watch.brake(&mut state.plausibility, trusted.velocity, share);
            }
            let command = state.protection.apply_brake(brake, protected.command);
            trusted.command = command;
            if let (Some(share), false) = (state.protection.braking(), protected.open)
                && trusted.status & status::VELOCITY_DISTRUSTED != 0
            {
                // The displacement's derivative is late. In a stiff force loop it makes the oil column unstable.
                let soft = T::splat(1.0) - T::splat(GAIN_REDUCTION) * share;
                trusted.force = command - soft * (command - trusted.force);
            }
        }
        protected.authority
    }

    /// The velocity (m/s) to compensate for. Without a trip it is the trusted one. After a trip it is lower, and
    /// an open loop follows the piston without the unknown null bias.
    #[inline(always)]
    fn compensated_velocity(
        &self,
        watch: &Plausibility<T, N>,
        state: &mut ChannelState<T>,
        trusted: &TrustedSignals<T>,
        protected: &Protected<T>,
    ) -> T {
        let zero = T::splat(0.0);
        let follows = protected.open && self.distrusts_velocity(state);
        let velocity =
            if follows { watch.agreed(&state.plausibility, trusted.velocity) } else { trusted.velocity };
        // Without a motion there is nothing to follow, and a closed valve drifts least.
        let at_rest = protected.open && watch.is_at_rest(&state.plausibility);
        let velocity = velocity * if at_rest { zero } else { protected.level };
        let velocity = if protected.open && !state.protection.motion_by_flow {
            let (added, corrects) = (self.added_null(state), self.controller.corrects());
            velocity - watch.offset_velocity(&state.plausibility, added, trusted.spool, corrects)
        } else {
            velocity
        };
        let source = protected.status & (status::TRIPPED | status::SHUT_DOWN)
            | trusted.status & status::VELOCITY_DISTRUSTED
            | u32::from(follows)
            | u32::from(at_rest) << 1
            | u32::from(state.protection.motion_by_flow) << 2;
        watch.fade_source(&mut state.plausibility, velocity, source)
    }

    /// The opening (1) beyond the known null that the calibration adds.
    #[inline(always)]
    fn added_null(&self, state: &ChannelState<T>) -> T {
        let (calibration, nominal) = (state.calibration(), self.controller.nominal());
        let adds = calibration.null_signal != nominal.null_signal;
        if adds { calibration.null_offset - nominal.null_offset } else { T::splat(0.0) }
    }

    /// The voltage (V) with an authority (1) over the valve. Without authority the valve stands where it passes no
    /// flow, as far as the plausibility watch has found this opening.
    #[inline(always)]
    pub(super) fn closing(&self, state: &ChannelState<T>, voltage: T, authority: T) -> T {
        if !(authority < T::splat(1.0)) {
            return voltage;
        }
        let zero = T::splat(0.0);
        let beyond = self.plausibility.as_ref().map_or(zero, |_| zero - state.plausibility.null_bias());
        self.controller.closing(voltage, authority, beyond)
    }

    /// Whether the velocity may be wrong although the force is blamed. If the displacement is blamed and the force then
    /// leaves its command, the velocity was wrong unless the flow still speaks against the displacement.
    #[inline(always)]
    pub(super) fn distrusts_velocity(&self, state: &ChannelState<T>) -> bool {
        let [force, displacement, ..] = state.plausibility.distrusted;
        let cause = state.protection.cause();
        let balance = state.plausibility.balance_blame || cause == Cause::ForceLevel;
        let contradicted =
            cause == Cause::DisplacementImplausible && state.plausibility.contradicts_velocity();
        let distrusted = if displacement { contradicted && !force } else { balance };
        distrusted && !self.estimates_velocity()
    }
}
