//! What a channel remembers.

use crate::compensation::Calibration;
use crate::controller::ControllerState;
use crate::learning::Window;
use crate::number::Real;
use crate::protection::{Cause, PlausibilityState, ProtectionState, StuckWatchState};
use crate::status;
use crate::velocity::VelocityState;

/// What a channel remembers; made by [`Channel::at_rest`](crate::Channel::at_rest) or [`Channel::prime`](crate::Channel::prime).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct ChannelState<T: Real> {
    pub(super) controller: ControllerState<T>,
    pub(super) velocity: VelocityState<T>,
    pub(super) protection: ProtectionState<T>,
    pub(super) plausibility: PlausibilityState<T>,
    /// Ticks in a row that the controller refused and of which no velocity could be estimated.
    pub(super) velocity_gap: u32,
    /// Ticks of the window so far; behind the last one all of them, until the next begins.
    pub(super) ticks: u32,
    pub(super) window: Window<T>,
    /// Whether the second of the calibrations is in use, and whether it is the latest.
    pub(super) second: bool,
    pub(super) second_is_latest: bool,
    /// Flags of the calibration in use, and of the next one as far as it is known.
    pub(super) flags: u32,
    pub(super) next_flags: u32,
    pub(super) calibrations: [Calibration<T>; 2],
    /// Earlier ones, to go back to where a sensor turns out to lie.
    pub(super) sound: Sound<T>,
    pub(super) stuck: StuckWatchState<T>,
}

impl<T: Real> ChannelState<T> {
    /// The calibration in use.
    pub fn calibration(&self) -> &Calibration<T> {
        in_use(&self.calibrations, self.second, &self.sound)
    }

    /// Trips the protection from outside, at the last command: an emergency stop, or another actuator of the same
    /// specimen.
    pub fn trip(&mut self) {
        self.protection.trip();
    }

    /// Asks the protection for the soft end: the command, still followed, fades along the ramp.
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

    /// The first tick of a window: what was published takes effect. Without anything new the calibration stays, for the
    /// valve does not change when the learner stops; behind so many windows it has expired.
    #[inline(always)]
    pub(super) fn begin_window(&mut self, age_limit: u32) {
        self.ticks = 0;
        self.window.go_on();
        self.second = self.second_is_latest;
        self.flags = self.next_flags;
        // For the window after this one, if none comes until then.
        self.next_flags |= status::CALIBRATION_LATE;
        if self.flags & status::CALIBRATION_LATE != 0 {
            let published = pick(&self.calibrations, self.second).window;
            if self.window.number.wrapping_sub(published) > age_limit {
                self.flags |= status::CALIBRATION_EXPIRED;
            }
        }
    }
}

/// Calibrations of half a second to a second ago: longer than any fault of a sensor stays unnoticed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(super) struct Sound<T: Real> {
    kept: [Calibration<T>; 2],
    /// Whether the second of them is the older one.
    older_is_second: bool,
    /// Once the older one is in use, for good.
    in_use: bool,
}

/// Windows between two calibrations that are kept.
const KEPT_EVERY: u32 = 128;

impl<T: Real> Sound<T> {
    pub(super) fn new(nominal: Calibration<T>) -> Self {
        Self { kept: [nominal; 2], older_is_second: false, in_use: false }
    }

    /// Keeps a calibration whose turn it is, in the older one's place.
    #[inline(always)]
    pub(super) fn keep(&mut self, calibration: &Calibration<T>) {
        if calibration.window.is_multiple_of(KEPT_EVERY) && !self.in_use {
            let [first, second] = &mut self.kept;
            *(if self.older_is_second { second } else { first }) = *calibration;
            self.older_is_second = !self.older_is_second;
        }
    }

    /// Goes back to the older one.
    #[inline(always)]
    pub(super) fn go_back(&mut self) {
        self.in_use = true;
    }
}

/// The calibration in use.
#[inline(always)]
pub(super) fn in_use<'a, T: Real>(
    calibrations: &'a [Calibration<T>; 2],
    second: bool,
    sound: &'a Sound<T>,
) -> &'a Calibration<T> {
    if sound.in_use { pick(&sound.kept, sound.older_is_second) } else { pick(calibrations, second) }
}

#[inline(always)]
pub(super) fn pick<C>(of: &[C; 2], second: bool) -> &C {
    let [first, _] = of;
    of.get(usize::from(second)).unwrap_or(first)
}
