//! The state of a protection: what it has done so far, and requests to it.

use crate::cause::Cause;
use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::latch::Latch;
use crate::protection::oscillation::OscillationWatchState;
use crate::protection::ramp::Position;
use crate::protection::timing::TimingState;

/// The state of a protection. `default()` is a rig at rest before the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ProtectionState<T> {
    /// Followed share of the command.
    pub(super) command_ramp: Position,
    /// Removed share of the valve command.
    pub(super) valve_ramp: Position,
    /// The last valid command (N); after a trip the last one before it.
    pub(super) command: T,
    /// Samples in a row with a lost measurement, with a lost command, and refused by the controller.
    pub(crate) lost_measurements: u32,
    pub(super) lost_commands: u32,
    pub(super) refused_samples: u32,
    /// Samples in a row with a fault that the controller reports.
    pub(super) faulty_samples: u32,
    /// Whether a fault has persisted.
    pub(super) fault_persists: bool,
    /// Whether no velocity is left to follow.
    pub(crate) motion_unknown: bool,
    /// Whether the motion is known from the flow balance alone.
    pub(crate) motion_by_flow: bool,
    /// Force (N) that the brake takes from the command.
    pub(super) brake: T,
    pub(super) cause: Cause,
    pub(super) tripped: Latch,
    pub(super) shut_down: Latch,
    /// Progress from the shutdown to the closed valve.
    pub(super) settling: Position,
    /// Whether the soft end was requested.
    pub(super) end_requested: bool,
    pub(super) timing: TimingState<T>,
    pub(super) oscillation: OscillationWatchState<T>,
}
integrity!(
    ProtectionState<T>: command_ramp, valve_ramp, command, lost_measurements, lost_commands, refused_samples,
    faulty_samples, fault_persists, motion_unknown, motion_by_flow, brake, cause, tripped, shut_down, settling,
    end_requested, timing, oscillation
);

impl<T: Real> ProtectionState<T> {
    /// Trips on request, at the last command: for an emergency stop, or another actuator of the same specimen.
    pub fn trip(&mut self) {
        self.trip_by(Cause::Request);
    }

    /// Trips by a cause, unless it is [`Cause::None`]. The first cause is kept.
    #[inline(always)]
    pub(crate) fn trip_by(&mut self, cause: Cause) {
        if cause != Cause::None {
            if !self.tripped.is_set() {
                self.cause = cause;
            }
            self.tripped.set();
        }
    }

    /// Trips by a cause that forbids a closed loop. The piston follows the specimen if a velocity is left, and the
    /// valve closes.
    #[inline(always)]
    pub(crate) fn shut_down_by(&mut self, cause: Cause) {
        self.trip_by(cause);
        self.shut_down.set();
    }

    /// Share of the brake (1) after a trip: it increases as the command decreases, to all at half the command. Without
    /// a brake a specimen keeps its kinetic energy when its command becomes zero, and a yielding specimen moves far.
    #[inline(always)]
    pub(crate) fn braking(&self) -> Option<T> {
        let one = T::splat(1.0);
        self.tripped
            .is_set()
            .then(|| (T::splat(2.0) * (one - self.command_ramp.share())).limit(T::splat(0.0), one))
    }

    /// The permitted command (N) without the brake's force (N).
    #[inline(always)]
    pub(crate) fn apply_brake(&mut self, brake: T, command: T) -> T {
        self.brake = brake;
        command - brake
    }

    /// The first cause of a trip.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// Whether it has tripped.
    pub fn is_tripped(&self) -> bool {
        self.tripped.is_set()
    }

    /// Whether the force loop must be open or the valve close.
    #[inline(always)]
    pub(crate) fn is_shut_down(&self) -> bool {
        self.shut_down.is_set()
    }

    /// Requests the soft end: the force follows a command that fades along the ramp.
    pub fn end(&mut self) {
        self.end_requested = true;
    }

    /// Whether the ramp has reached zero.
    pub fn is_down(&self) -> bool {
        self.command_ramp.is_zero()
    }
}

#[cfg(test)]
impl<T> ProtectionState<T> {
    /// Flips a bit of the latch of the trip, or of that of the shutdown.
    pub(super) fn flip(&mut self, of_trip: bool) {
        if of_trip { self.tripped.flip() } else { self.shut_down.flip() }
    }
}
