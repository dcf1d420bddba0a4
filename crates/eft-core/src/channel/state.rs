//! The state of a channel.

use crate::cause::Cause;
use crate::checksum::word;
use crate::compensation::{Calibration, LeadNetwork};
use crate::controller::ControllerState;
use crate::integrity::integrity;
use crate::learning::Window;
use crate::number::Real;
use crate::protection::{NEVER, PlausibilityState, ProtectionState, StuckWatchState};
use crate::status;
use crate::velocity::VelocityState;

/// The state of a channel, made by [`Channel::at_rest`](crate::Channel::at_rest) or
/// [`Channel::prime`](crate::Channel::prime).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ChannelState<T: Real> {
    pub(super) calibrations: [Calibration<T>; 2],
    pub(super) controller: ControllerState<T>,
    // What every tick uses comes first, so that a short offset reaches it.
    /// Ticks left in the window; 0 after its last tick, until the next window begins.
    pub(super) ticks_left: u32,
    pub(super) window: Window<T>,
    /// The calibration of this window, and that of the next one if it is known.
    pub(super) in_use: CalibrationChoice,
    pub(super) next: CalibrationChoice,
    /// Windows until the latest calibration expires.
    pub(super) windows_left: u32,
    pub(super) velocity: VelocityState<T>,
    pub(super) protection: ProtectionState<T>,
    pub(super) plausibility: PlausibilityState<T>,
    /// Ticks in a row that the controller refused and for which no velocity could be estimated; [`NEVER`] before the
    /// first estimate.
    pub(super) velocity_gap: u32,
    /// Earlier calibrations, to return to when a sensor proves wrong.
    pub(super) history: CalibrationHistory<T>,
    pub(super) stuck: StuckWatchState<T>,
}
integrity!(
    ChannelState<T>: calibrations, controller, velocity, protection, plausibility, velocity_gap, ticks_left, window,
    in_use, next, windows_left, history, stuck
);

/// One of two places, by the lowest bit. After a memory fault the number still is one of them.
// A word wide, so that a tick copies it together with the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(transparent)]
pub(super) struct Slot(u32);
integrity!(Slot: 0);

impl Slot {
    const FIRST: Self = Self(0);

    #[inline(always)]
    pub(super) fn other(self) -> Self {
        Self(self.0 ^ 1)
    }

    #[inline(always)]
    pub(super) fn of<C>(self, places: &[C; 2]) -> &C {
        let [first, _] = places;
        places.get((self.0 & 1) as usize).unwrap_or(first)
    }

    #[inline(always)]
    fn of_mut<C>(self, places: &mut [C; 2]) -> Option<&mut C> {
        places.get_mut((self.0 & 1) as usize)
    }

    #[inline(always)]
    pub(super) fn put<C: Copy>(self, places: &mut [C; 2], value: &C) {
        if let Some(place) = self.of_mut(places) {
            *place = *value;
        }
    }
}

/// One of two calibrations, and its bits of the status.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct CalibrationChoice {
    pub(super) slot: Slot,
    pub(super) flags: u32,
}
integrity!(CalibrationChoice: slot, flags);

impl<T: Real> ChannelState<T> {
    /// Ticks without an estimate of the velocity before one that is lost.
    #[inline(always)]
    pub(super) fn velocity_gap_before(&self) -> u32 {
        let continues = self.controller.refused_samples > 0 || self.velocity_gap == NEVER;
        if continues { self.velocity_gap } else { 0 }
    }

    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration<T> {
        in_use(&self.calibrations, self.in_use.slot, &self.history)
    }

    /// A checksum of every number of the state, to compare after one tick and before the next. Between two ticks only
    /// [`publish`](crate::Channel::publish) and the other functions on a state change it.
    ///
    /// # Cost
    /// As [`Channel::integrity`](crate::Channel::integrity).
    pub fn integrity(&self) -> u32 {
        word(self)
    }

    /// Trips the protection from outside, at the last command, for an emergency stop or another actuator of the
    /// specimen.
    pub fn trip(&mut self) {
        self.protection.trip();
    }

    /// Requests the soft end of the protection: the force follows a command that fades along the ramp.
    pub fn end(&mut self) {
        self.protection.end();
    }

    /// What tripped the protection first.
    pub fn cause(&self) -> Cause {
        self.protection.cause()
    }

    /// Whether the protection's ramp has reached zero.
    pub fn is_down(&self) -> bool {
        self.protection.is_down()
    }

    /// The first tick of a window: the published calibration takes effect. Without a new one the calibration stays,
    /// since the valve does not change when the learner stops.
    #[inline(always)]
    pub(super) fn begin_window(&mut self, ticks: u32) {
        self.ticks_left = ticks;
        self.window.go_on();
        self.in_use = self.next;
        // For the window after this one, if none comes until then.
        self.next.flags |= status::CALIBRATION_LATE;
    }

    /// After the last tick of a window: the calibration is a window older.
    #[inline(always)]
    pub(super) fn end_window(&mut self) -> Window<T> {
        match self.windows_left.checked_sub(1) {
            Some(left) => self.windows_left = left,
            None => self.next.flags |= status::CALIBRATION_EXPIRED,
        }
        self.window
    }
}

/// Calibrations from half a second to a second ago. Every sensor fault is noticed in a shorter time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct CalibrationHistory<T: Real> {
    calibrations: [Calibration<T>; 2],
    older: Slot,
    /// Set when the channel has returned to the older one. That is final; only its delays may become shorter.
    restored: bool,
}
integrity!(CalibrationHistory<T>: calibrations, older, restored);

/// Windows between two calibrations that are kept.
const WINDOWS_BETWEEN: u32 = 128;

impl<T: Real> CalibrationHistory<T> {
    pub(super) fn new(nominal: Calibration<T>) -> Self {
        Self { calibrations: [nominal; 2], older: Slot::FIRST, restored: false }
    }

    /// Keeps every n-th calibration, in place of the older one.
    #[inline(always)]
    pub(super) fn record(&mut self, calibration: &Calibration<T>) {
        if calibration.window.is_multiple_of(WINDOWS_BETWEEN) && !self.restored {
            self.older.put(&mut self.calibrations, calibration);
            self.older = self.older.other();
        }
    }

    /// Returns to the older one.
    #[inline(always)]
    pub(super) fn restore(&mut self) {
        self.restored = true;
    }

    /// Gives the older one the delays of another calibration, if these are shorter together. Its gain stays.
    #[inline(always)]
    pub(super) fn reduce_lead(&mut self, other: &Calibration<T>) {
        let Some(older) = self.older.of_mut(&mut self.calibrations) else { return };
        if other.response_delay + other.velocity_delay < older.response_delay + older.velocity_delay {
            older.lead = LeadNetwork::of(other.lead.pole(), other.lead.rate(), older.lead.gain());
            (older.response_delay, older.velocity_delay) = (other.response_delay, other.velocity_delay);
        }
    }
}

/// The calibration in use.
#[inline(always)]
pub(super) fn in_use<'a, T: Real>(
    calibrations: &'a [Calibration<T>; 2],
    slot: Slot,
    history: &'a CalibrationHistory<T>,
) -> &'a Calibration<T> {
    if history.restored { history.older.of(&history.calibrations) } else { slot.of(calibrations) }
}

/// The values of a tick that controller and trip levels use.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrustedSignals<T> {
    pub(super) command: T,
    pub(super) force: T,
    pub(super) displacement: T,
    pub(super) velocity: T,
    pub(super) spool: T,
    pub(super) status: u32,
}
