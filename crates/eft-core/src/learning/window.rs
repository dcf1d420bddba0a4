//! Sums over a window of ticks, the input of the learner.

use crate::LARGEST;
use crate::integrity::integrity;
use crate::number::{Flags, Mask, Scalar};

/// The summed signals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Sums<T> {
    /// Piston velocities (m/s).
    pub velocity: T,
    /// Forces (N) that the oil carries: the measured ones and the friction.
    pub force: T,
    /// Spool openings (1).
    pub spool: T,
    /// The same (N) at the command.
    pub command: T,
    /// Valve commands (V).
    pub valve_command: T,
    /// Spool openings (1) at the ticks whose valve command was lost.
    pub spool_without_command: T,
}
integrity!(Sums<T>: velocity, force, spool, command, valve_command, spool_without_command);

/// Signals whose change over a window is used, at one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Moment<T> {
    /// Force (N) that the oil carries: the measured one and the friction.
    pub force: T,
    /// The same (N) at the command.
    pub command: T,
}
integrity!(Moment<T>: force, command);

/// A window of ticks of one channel, or of several in lanes. It is the learner's only input.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Window<S: Scalar> {
    /// Its number since the start; wraps.
    pub number: u32,
    /// Ticks without a valid sample, plus one in a window without a valid sample before it.
    pub lost: S::Flags,
    /// Ticks whose valve command was lost.
    pub lost_commands: S::Flags,
    /// Sums over its valid ticks.
    pub sums: Sums<S>,
    /// Signals at the last valid tick before it.
    pub start: Moment<S>,
    /// Signals at its last valid tick.
    pub end: Moment<S>,
    /// Supply pressure over the configured one (1) at its last valid tick; 1 if it is not measured.
    pub supply: S,
}
integrity!(Window<T>: number, lost, lost_commands, sums, start, end, supply);

impl<S: Scalar> Window<S> {
    /// A window without a valid sample before it.
    pub(crate) fn first(number: u32) -> Self {
        Self {
            number,
            lost: S::Flags::from_lanes(|_| 1),
            lost_commands: S::Flags::default(),
            sums: Sums::default(),
            start: Moment::default(),
            end: Moment::default(),
            supply: S::splat(1.0),
        }
    }

    /// Begins the next window.
    #[inline(always)]
    pub(crate) fn go_on(&mut self) {
        *self = Self {
            number: self.number.wrapping_add(1),
            lost: S::Flags::default(),
            lost_commands: S::Flags::default(),
            sums: Sums::default(),
            start: self.end,
            ..*self
        };
    }

    /// Adds the measurements of a tick where it is `good`.
    #[inline(always)]
    pub(crate) fn add(&mut self, good: S::Mask, velocity: S, spool: S, now: Moment<S>) {
        let (sums, end) = (&mut self.sums, self.end);
        add::<S>(&mut sums.velocity, good, velocity);
        add::<S>(&mut sums.force, good, now.force);
        add::<S>(&mut sums.spool, good, spool);
        add::<S>(&mut sums.command, good, now.command);
        self.end = Moment {
            force: S::select(good, now.force, end.force),
            command: S::select(good, now.command, end.command),
        };
    }

    /// Adds such a tick's valve command (V), which is finite.
    #[inline(always)]
    pub(crate) fn add_command(&mut self, good: S::Mask, valve_command: S) {
        add::<S>(&mut self.sums.valve_command, good, valve_command);
    }

    /// Adds a sampled valve command (V). If it is not finite it is lost, and the spool opening (1) is added instead.
    #[inline(always)]
    pub(crate) fn add_sampled_command(&mut self, good: S::Mask, valve_command: S, spool: S) {
        let known = valve_command.abs().le(S::splat(LARGEST));
        if known.all() {
            return self.add_command(good, valve_command);
        }
        self.add_command(good & known, valve_command);
        add::<S>(&mut self.sums.spool_without_command, good & !known, spool);
        count::<S>(&mut self.lost_commands, good & !known);
    }

    /// Counts a tick without a valid sample in the mask's lanes.
    #[inline(always)]
    pub(crate) fn lose(&mut self, there: S::Mask) {
        count::<S>(&mut self.lost, there);
    }

    /// The window of one lane.
    pub(crate) fn lane(&self, lane: usize) -> Window<S::Element> {
        let of = |value: S| value.lane(lane);
        let moment = |at: &Moment<S>| Moment { force: of(at.force), command: of(at.command) };
        let Sums { velocity, force, spool, command, valve_command, spool_without_command } = self.sums;
        Window {
            number: self.number,
            lost: self.lost.lane(lane),
            lost_commands: self.lost_commands.lane(lane),
            sums: Sums {
                velocity: of(velocity),
                force: of(force),
                spool: of(spool),
                command: of(command),
                valve_command: of(valve_command),
                spool_without_command: of(spool_without_command),
            },
            start: moment(&self.start),
            end: moment(&self.end),
            supply: of(self.supply),
        }
    }
}

#[inline(always)]
fn add<S: Scalar>(sum: &mut S, there: S::Mask, value: S) {
    *sum = *sum + S::select(there, value, S::splat(0.0));
}

#[inline(always)]
fn count<S: Scalar>(ticks: &mut S::Flags, there: S::Mask) {
    *ticks = S::Flags::from_lanes(|i| ticks.lane(i).saturating_add(u32::from(there.lane(i))));
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "small whole numbers are exact")]
mod tests {
    use super::*;

    fn add(window: &mut Window<f64>, value: f64) {
        window.add(true, value, 3.0 * value, Moment { force: 2.0 * value, command: -value });
        window.add_sampled_command(true, 4.0 * value, 3.0 * value);
    }

    #[test]
    fn sums_and_moments_are_those_of_whole_windows() {
        let mut window = Window::first(u32::MAX);
        let mut tick = 0.0;
        let mut next = |bad: Option<u32>| {
            for n in 0..4 {
                tick += 1.0;
                if bad == Some(n) { window.lose(true) } else { add(&mut window, tick) }
            }
            let closed = window;
            window.go_on();
            closed
        };
        let windows = [next(None), next(None), next(Some(2)), next(None)];
        assert_eq!(windows.map(|w| w.lost), [1, 0, 1, 0]);
        assert_eq!(windows.map(|w| w.number), [u32::MAX, 0, 1, 2]);
        let last = windows[3];
        assert_eq!((last.sums.velocity, last.sums.command), (58.0, -58.0));
        assert_eq!((last.sums.force, last.sums.spool, last.sums.valve_command), (116.0, 174.0, 232.0));
        assert_eq!((last.end.force - last.start.force, last.end.command), (8.0, -16.0));
    }

    #[test]
    fn a_lost_valve_command_is_counted_separately() {
        let mut window = Window::first(0);
        add(&mut window, 1.0);
        window.add(true, 2.0, 6.0, Moment { force: 4.0, command: -2.0 });
        window.add_sampled_command(true, f64::NAN, 6.0);
        assert_eq!((window.sums.valve_command, window.sums.spool_without_command), (4.0, 6.0));
        assert_eq!((window.sums.spool, window.lost_commands), (9.0, 1));
    }
}
