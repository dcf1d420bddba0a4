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
    pub(super) scale: Position,
    /// Removed share of the valve command.
    pub(super) shut: Position,
    /// The last valid command (N); after a trip the last one before it.
    pub(super) command: T,
    /// Samples in a row with a lost measurement, with a lost command, and refused by the controller.
    pub(super) lost: u32,
    pub(super) unasked: u32,
    pub(super) refused: u32,
    /// Samples in a row with a fault that the controller reports.
    pub(super) faulty: u32,
    /// Whether a fault has persisted.
    pub(super) distrusted: bool,
    /// Whether no velocity is left to follow.
    pub(super) blind: bool,
    /// Whether the motion is known from the flow balance alone.
    pub(super) by_flow: bool,
    /// Force (N) that the brake takes from the command.
    pub(super) brake: T,
    pub(super) cause: Cause,
    pub(super) tripped: Latch,
    pub(super) shut_down: Latch,
    /// Progress from the shutdown to the closed valve.
    pub(super) settled: Position,
    /// Whether the soft end was requested.
    pub(super) ending: bool,
    pub(super) timing: TimingState<T>,
    pub(super) oscillation: OscillationWatchState<T>,
}
integrity!(ProtectionState<T>: scale, shut, command, lost, unasked, refused, faulty, distrusted, blind, by_flow, brake, cause, tripped, shut_down, settled, ending, timing, oscillation);

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

    /// Trips by a cause that forbids a closed loop. The piston follows the specimen if a velocity is left, and the valve
    /// closes.
    #[inline(always)]
    pub(crate) fn shut_down_by(&mut self, cause: Cause) {
        self.trip_by(cause);
        self.shut_down.set();
    }

    /// Share of the brake (1) after a trip: it increases as the command decreases, to all at half the command. Without a brake a specimen keeps its
    /// kinetic energy when its command becomes zero, and a yielding specimen moves far.
    #[inline(always)]
    pub(crate) fn braking(&self) -> Option<T> {
        let one = T::splat(1.0);
        self.tripped.is_set().then(|| (T::splat(2.0) * (one - self.scale.share())).limit(T::splat(0.0), one))
    }

    /// The permitted command (N) without the brake's force (N).
    #[inline(always)]
    pub(crate) fn apply(&mut self, brake: T, command: T) -> T {
        self.brake = brake;
        command - brake
    }

    /// Records that no velocity is left to follow in a shutdown.
    #[inline(always)]
    pub(crate) fn blind(&mut self) {
        self.blind = true;
    }

    /// Counts lost measurements anew, after a lost sensor was replaced.
    #[inline(always)]
    pub(crate) fn count_anew(&mut self) {
        self.lost = 0;
    }

    /// Records that the motion is known from the flow balance alone.
    #[inline(always)]
    pub(crate) fn follow_flow(&mut self) {
        self.by_flow = true;
    }

    /// Whether the motion is known from the flow balance alone.
    #[inline(always)]
    pub(crate) fn follows_flow(&self) -> bool {
        self.by_flow
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
        self.ending = true;
    }

    /// Whether the ramp has reached zero.
    pub fn is_down(&self) -> bool {
        self.scale.is_zero()
    }
}

#[cfg(test)]
impl<T> ProtectionState<T> {
    /// Flips a bit of the latch of the trip, or of that of the shutdown.
    pub(super) fn flip(&mut self, of_trip: bool) {
        if of_trip { self.tripped.flip() } else { self.shut_down.flip() }
    }
}
