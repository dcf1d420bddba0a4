//! Sums over a window of ticks, from which the learner lives.

use crate::LARGEST;
use crate::number::Real;

/// What is summed up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Sums<T> {
    /// Piston velocities (m/s).
    pub velocity: T,
    /// Forces (N).
    pub force: T,
    /// Spool openings (1).
    pub spool: T,
    /// Force commands (N).
    pub command: T,
    /// Valve commands (V).
    pub valve_command: T,
    /// Spool openings (1) at the ticks whose valve command was lost.
    pub spool_without_command: T,
}

/// What changes over a window, at one moment of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Moment<T> {
    /// Force (N).
    pub force: T,
    /// Force command (N).
    pub command: T,
}

/// A window of ticks: all that the learner is given.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct Window<T> {
    /// Its number since the start; wraps.
    pub number: u32,
    /// Ticks without a valid sample; one more in a window that nothing was measured before.
    pub lost: u32,
    /// Ticks whose valve command was lost.
    pub lost_commands: u32,
    /// Over its valid ticks.
    pub sums: Sums<T>,
    /// At the last valid tick before it.
    pub start: Moment<T>,
    /// At its last valid tick.
    pub end: Moment<T>,
    /// Supply pressure over the configured one (1) at its last valid tick; 1 where none is measured.
    pub supply: T,
}

impl<T: Real> Window<T> {
    /// A window that nothing was measured before.
    pub(crate) fn first(number: u32) -> Self {
        Self {
            number,
            lost: 1,
            lost_commands: 0,
            sums: Sums::default(),
            start: Moment::default(),
            end: Moment::default(),
            supply: T::splat(1.0),
        }
    }

    /// Goes on to the window behind it.
    #[inline(always)]
    pub(crate) fn go_on(&mut self) {
        *self = Self {
            number: self.number.wrapping_add(1),
            lost: 0,
            lost_commands: 0,
            sums: Sums::default(),
            start: self.end,
            ..*self
        };
    }

    /// Takes in the measurements of a tick.
    #[inline(always)]
    pub(crate) fn add(&mut self, velocity: T, spool: T, now: Moment<T>) {
        let sums = &mut self.sums;
        sums.velocity = sums.velocity + velocity;
        sums.force = sums.force + now.force;
        sums.spool = sums.spool + spool;
        sums.command = sums.command + now.command;
        self.end = now;
    }

    /// Takes in such a tick's valve command (V), which is finite.
    #[inline(always)]
    pub(crate) fn add_command(&mut self, valve_command: T) {
        self.sums.valve_command = self.sums.valve_command + valve_command;
    }

    /// Takes in a valve command (V) that was sampled: where it is not finite it is lost, and the spool opening (1) counts.
    #[inline(always)]
    pub(crate) fn add_sampled_command(&mut self, valve_command: T, spool: T) {
        if valve_command.abs() <= T::splat(LARGEST) {
            self.add_command(valve_command);
        } else {
            self.sums.spool_without_command = self.sums.spool_without_command + spool;
            self.lost_commands += 1;
        }
    }

    /// Takes in a tick without a valid sample.
    #[inline(always)]
    pub(crate) fn lose(&mut self) {
        self.lost = self.lost.saturating_add(1);
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "small whole numbers are exact")]
mod tests {
    use super::*;

    fn add(window: &mut Window<f64>, value: f64) {
        window.add(value, 3.0 * value, Moment { force: 2.0 * value, command: -value });
        window.add_sampled_command(4.0 * value, 3.0 * value);
    }

    #[test]
    fn sums_and_moments_are_those_of_whole_windows() {
        let mut window = Window::first(u32::MAX);
        let mut tick = 0.0;
        let mut next = |bad: Option<u32>| {
            for n in 0..4 {
                tick += 1.0;
                if bad == Some(n) { window.lose() } else { add(&mut window, tick) }
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
    fn lost_valve_command_is_counted_apart() {
        let mut window = Window::first(0);
        add(&mut window, 1.0);
        window.add(2.0, 6.0, Moment { force: 4.0, command: -2.0 });
        window.add_sampled_command(f64::NAN, 6.0);
        assert_eq!((window.sums.valve_command, window.sums.spool_without_command), (4.0, 6.0));
        assert_eq!((window.sums.spool, window.lost_commands), (9.0, 1));
    }
}
