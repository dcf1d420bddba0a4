//! Means over a window of ticks, from which the estimators live.

use crate::scalar::{Mask, Scalar};

/// What the controller measures at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurements<S> {
    /// Piston velocity (m/s).
    pub velocity: S,
    /// Force (N).
    pub force: S,
    /// Spool opening (1).
    pub spool: S,
    /// Valve command (V) that stood when the others were sampled.
    pub valve_command: S,
    /// Supply pressure (Pa); the configured one where there is no transducer.
    pub supply_pressure: S,
}

/// Sums or means over a window.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub(crate) struct Window<S> {
    pub(crate) velocity: S,
    pub(crate) force: S,
    pub(crate) spool: S,
    pub(crate) valve_command: S,
    pub(crate) command: S,
}

/// The window that is being filled, the one before, and what changed over it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct WindowState<S> {
    sums: Window<S>,
    /// Windows, from this one on, that are not whole: one after a bad sample, two at the start.
    spoiled: S,
    pub(crate) means: Window<S>,
    /// 1 where the means are new.
    pub(crate) whole: S,
    /// The last valid force (N), command (N) and supply (over the configured one).
    force: S,
    command: S,
    pub(crate) supply: S,
    /// Force and command at the window's start.
    first_force: S,
    first_command: S,
    pub(crate) force_change: S,
    pub(crate) command_change: S,
}

impl<S: Scalar> Default for WindowState<S> {
    fn default() -> Self {
        let zero = S::splat(0.0);
        Self {
            sums: Window::default(),
            spoiled: S::splat(2.0),
            means: Window::default(),
            whole: zero,
            force: zero,
            command: zero,
            supply: S::splat(1.0),
            first_force: zero,
            first_command: zero,
            force_change: zero,
            command_change: zero,
        }
    }
}

impl<S: Scalar> WindowState<S> {
    /// Adds one tick's command (N), measurements and supply (over the configured one) where they are valid.
    #[inline(always)]
    pub(crate) fn collect(&mut self, command: S, measured: &Measurements<S>, supply: S, valid: S::Mask) {
        let zero = S::splat(0.0);
        let add = |sum: &mut S, value: S| *sum = *sum + S::select(valid, value, zero);
        add(&mut self.sums.velocity, measured.velocity);
        add(&mut self.sums.force, measured.force);
        add(&mut self.sums.spool, measured.spool);
        add(&mut self.sums.valve_command, measured.valve_command);
        add(&mut self.sums.command, command);
        self.force = S::select(valid, measured.force, self.force);
        self.command = S::select(valid, command, self.command);
        self.supply = S::select(valid, supply, self.supply);
        if !valid.all() {
            self.spoil(!valid);
        }
    }

    /// Adds a valve command (V) to a tick that was collected without one.
    #[inline(always)]
    pub(crate) fn add_valve_command(&mut self, valve_command: S, missing: S::Mask) {
        let sum = self.sums.valve_command;
        self.sums.valve_command = S::select(missing, sum + valve_command, sum);
    }

    /// Leaves a tick out.
    #[inline(always)]
    pub(crate) fn spoil(&mut self, bad: S::Mask) {
        self.spoiled = S::select(bad, S::splat(1.0), self.spoiled);
    }

    /// The window's end: means where every tick was good.
    #[inline(always)]
    pub(crate) fn close(&mut self, per_window: S) {
        let (zero, one) = (S::splat(0.0), S::splat(1.0));
        let sums = self.sums;
        self.sums = Window::default();
        let whole = !self.spoiled.gt(zero);
        self.whole = S::select(whole, one, zero);
        let left = self.spoiled - one;
        self.spoiled = S::select(left.gt(zero), left, zero);
        let (force_change, command_change) =
            (self.force - self.first_force, self.command - self.first_command);
        self.first_force = self.force;
        self.first_command = self.command;
        if whole.any() {
            let mean = |sum: S, last: S| S::select(whole, sum * per_window, last);
            self.means = Window {
                velocity: mean(sums.velocity, self.means.velocity),
                force: mean(sums.force, self.means.force),
                spool: mean(sums.spool, self.means.spool),
                valve_command: mean(sums.valve_command, self.means.valve_command),
                command: mean(sums.command, self.means.command),
            };
            self.force_change = S::select(whole, force_change, self.force_change);
            self.command_change = S::select(whole, command_change, self.command_change);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, clippy::indexing_slicing, reason = "small whole numbers are exact")]
mod tests {
    use super::*;

    fn measured(value: f64) -> Measurements<f64> {
        Measurements {
            velocity: value,
            force: 2.0 * value,
            spool: 3.0 * value,
            valve_command: 4.0 * value,
            supply_pressure: 1.0,
        }
    }

    #[test]
    fn means_and_changes_are_those_of_whole_windows() {
        let mut state = WindowState::default();
        let mut tick = 0.0;
        let mut window = |state: &mut WindowState<f64>, bad: Option<u32>| {
            state.close(0.25);
            for n in 0..4 {
                tick += 1.0;
                if bad == Some(n) {
                    state.spoil(true)
                } else {
                    state.collect(-tick, &measured(tick), 0.9, true)
                }
            }
        };
        // At the start, and behind a bad sample, nothing is new.
        let seen = [None, None, None, Some(2), None, None].map(|bad| {
            window(&mut state, bad);
            (state.whole > 0.0, state.means.velocity, state.force_change, state.command_change)
        });
        let fresh = (true, 6.5, 8.0, -4.0);
        assert_eq!(seen[..2], [(false, 0.0, 0.0, 0.0); 2]);
        assert_eq!(
            seen[2..],
            [fresh, (true, 10.5, 8.0, -4.0), (false, 10.5, 8.0, -4.0), (true, 18.5, 8.0, -4.0)]
        );
        assert_eq!((state.means.force, state.means.spool, state.means.valve_command), (37.0, 55.5, 74.0));
        assert_eq!(state.means.command, -18.5);
    }
}
