//! Notices a force that reads zero while its command moves, as that of a load cell without its bridge's supply. Its
//! reading may have an offset.
//!
//! Near zero force such a reading agrees with its prediction, and the oil's flow is within the tolerance of the flow
//! balance. A sound force passes zero about as fast as its command. It does not if the compensation is so wrong that the
//! force does not follow its command, if friction holds the piston, and while the piston crosses a play of its attachment.
//! A play delays each passage, so that the longest one before tells how long a sound reading may stay zero.

use crate::integrity::integrity;
use crate::number::Real;
use crate::protection::plausibility::sums::low_pass;

/// Largest mean error of a force that follows its command, as a share of the mean command.
const FOLLOWING: f64 = 0.25;
/// Share of the longest passage before that is added to the time. Slower commands cross a play more slowly.
const LONGEST: f64 = 2.0;

/// The immutable configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ZeroForceWatch<T> {
    /// Largest offset (N) of a reading that may be zero, and its largest change (N) by noise, after the low-pass.
    pub(in crate::protection) offset: T,
    pub(in crate::protection) noise: T,
    /// Change of the command (N) and path of the piston (m) since the reading became zero.
    pub(in crate::protection) change: T,
    pub(in crate::protection) path: T,
    /// Time (s) for which the command is beyond this change.
    pub(in crate::protection) time: T,
    /// Coefficient (1) of the mean error and the mean command.
    pub(in crate::protection) mean_gain: T,
}
integrity!(ZeroForceWatch<T>: offset, noise, change, path, time, mean_gain);

/// The state. `default()` is that before the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub(crate) struct ZeroForce<T> {
    /// Command (N) after the low-pass of the force.
    command: T,
    /// Mean sizes (N) of force error and command.
    mean_error: T,
    mean_command: T,
    /// Force (N), command (N) and displacement (m) when the reading became zero.
    force_before: T,
    command_before: T,
    displacement_before: T,
    /// Time (s) since the command has changed enough, and the longest one after which the reading has left zero.
    time: T,
    longest: T,
    /// Whether the force followed its command when the reading became zero, whether its last reading beyond zero was
    /// positive, and whether a force that followed has changed its sign.
    followed: bool,
    positive: bool,
    passed: bool,
}
integrity!(
    ZeroForce<T>: command, mean_error, mean_command, force_before, command_before, displacement_before, time, longest, followed,
    positive, passed
);

impl<T: Real> ZeroForceWatch<T> {
    /// Adds a tick's command (N), and force (N) and displacement (m) after a low-pass with this coefficient. The result
    /// is whether the force reads zero while it should not.
    #[inline(always)]
    pub(super) fn contradicts(
        &self,
        state: &mut ZeroForce<T>,
        [command, force, displacement]: [T; 3],
        [low_gain, period]: [T; 2],
    ) -> bool {
        if !(command - force).is_finite() {
            return false;
        }
        let command = low_pass(&mut state.command, low_gain, command);
        let error = low_pass(&mut state.mean_error, self.mean_gain, (command - force).abs());
        let size = low_pass(&mut state.mean_command, self.mean_gain, command.abs());
        let near_zero = force.abs() <= self.offset;
        if !near_zero {
            let positive = force > T::splat(0.0);
            state.passed |= state.followed & (positive != state.positive);
            state.positive = positive;
        }
        if !(near_zero & ((force - state.force_before).abs() <= self.noise)) {
            state.longest = if state.time > state.longest { state.time } else { state.longest };
            (state.force_before, state.command_before, state.displacement_before) =
                (force, command, displacement);
            state.time = T::splat(0.0);
            state.followed = error < T::splat(FOLLOWING) * size && size > self.change;
            return false;
        }
        let changed = (command - state.command_before).abs() > self.change;
        state.time = if changed { state.time + period } else { T::splat(0.0) };
        let moved = (displacement - state.displacement_before).abs() > self.path;
        let limit = self.time + T::splat(LONGEST) * state.longest;
        state.followed & state.passed & moved & (state.time >= limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    const PERIOD: f64 = 1.0 / 4096.0;
    const WATCH: ZeroForceWatch<f64> =
        ZeroForceWatch { offset: 800.0, noise: 100.0, change: 1e3, path: 3e-4, time: 0.012, mean_gain: 1e-3 };

    /// A sine of 1.5 Hz with an amplitude, `late` (rad).
    fn sine(amplitude: f64, time: f64, late: f64) -> f64 {
        amplitude * libm::sin(TAU * 1.5 * time - late)
    }

    /// Time (s) of the first contradiction within 3 s of a command of 6 kN, with a force (N) and a displacement (m).
    fn first(force: impl Fn(f64) -> f64, displacement: impl Fn(f64) -> f64) -> Option<f64> {
        let mut state = ZeroForce::default();
        (0..12_288).map(|n| f64::from(n) * PERIOD).find(|&time| {
            let readings = [sine(6e3, time, 0.0), force(time), displacement(time)];
            WATCH.contradicts(&mut state, readings, [1.0, PERIOD])
        })
    }

    #[test]
    fn a_reading_that_stays_zero_is_noticed_wherever_it_begins() {
        let moves = |time: f64| sine(0.05, time, 1.0);
        for (begins, reading) in
            (0..40).map(|n| 2.0 + f64::from(n) / 60.0).zip([50.0, -790.0, 400.0].into_iter().cycle())
        {
            let dead = |reading: f64| {
                first(|time| if time < begins { sine(6e3, time, 0.1) } else { reading }, moves)
            };
            let found = dead(reading).unwrap();
            // Near its largest value the command takes longer to change.
            assert!(found > begins && found < begins + 0.16, "{begins}: {found}");
            assert_eq!(dead(810.0), None);
        }
    }

    #[test]
    fn a_force_that_passes_zero_is_none() {
        let moves = |time: f64| sine(0.05, time, 1.0);
        for (amplitude, late) in [(6e3, 0.0), (6e3, 0.4), (4e3, -0.4), (9e3, 0.2)] {
            assert_eq!(first(|time| sine(amplitude, time, late), moves), None, "{amplitude} {late}");
        }
        // Without a compensation little of the force remains at a resonance.
        assert_eq!(first(|time| sine(90.0, time, 0.0), moves), None);
        // Friction holds the piston.
        let held = |time: f64| if time < 2.0 { sine(6e3, time, 0.1) } else { 0.0 };
        assert_eq!(first(held, |_| 0.01), None);
    }

    #[test]
    fn a_play_that_every_passage_crosses_is_none_and_a_longer_zero_is_noticed() {
        let moves = |time: f64| sine(0.05, time, 1.0);
        for play in [0.8e3, 1.5e3] {
            let crosses =
                |time: f64| Some(sine(6e3, time, 0.0)).filter(|force| force.abs() > play).unwrap_or(0.0);
            assert_eq!(first(crosses, moves), None, "{play}");
            for begins in (0..40).map(|n| 2.0 + f64::from(n) / 60.0) {
                let found = first(|time| if time < begins { crosses(time) } else { 0.0 }, moves).unwrap();
                assert!(found > begins && found < begins + 0.3, "{play} {begins}: {found}");
            }
        }
    }

    #[test]
    fn nothing_is_noticed_before_a_force_that_followed_has_changed_its_sign() {
        let moves = |time: f64| sine(0.05, time, 1.0);
        let until = |end: f64| first(move |time| if time < end { sine(6e3, time, 0.1) } else { 0.0 }, moves);
        assert_eq!(until(0.3), None);
        assert!(until(0.4).is_some_and(|time| time < 0.5));
    }

    /// A state in which the force followed its command, and then became zero at a command and a displacement of 0.
    fn zero() -> ZeroForce<f64> {
        ZeroForce {
            mean_error: 499.0,
            mean_command: 2e3,
            followed: true,
            passed: true,
            ..ZeroForce::default()
        }
    }

    #[test]
    fn change_path_and_time_must_all_be_large() {
        let after = |longest: f64, command: f64, displacement: f64| {
            let mut state = ZeroForce { longest, ..zero() };
            let watch = ZeroForceWatch { time: 10.0 * PERIOD, ..WATCH };
            (1..100).find(|_| watch.contradicts(&mut state, [command, 99.0, displacement], [1.0, PERIOD]))
        };
        let samples = |command: f64, displacement: f64| after(0.0, command, displacement);
        assert_eq!(after(2.0 * PERIOD, 1001.0, 3.1e-4), Some(14));
        assert_eq!(samples(1001.0, 3.1e-4), Some(10));
        assert_eq!(samples(-1001.0, -3.1e-4), Some(10));
        assert_eq!(samples(999.0, 3.1e-4), None);
        assert_eq!(samples(1001.0, 2.9e-4), None);
    }

    #[test]
    fn a_reading_at_the_largest_offset_or_change_reads_zero() {
        for (before, reading) in [(800.0, 800.0), (-800.0, -800.0), (0.0, 100.0), (0.0, -100.0)] {
            let mut state = ZeroForce { force_before: before, ..zero() };
            let found = (0..60).any(|_| WATCH.contradicts(&mut state, [1100.0, reading, 1.0], [1.0, PERIOD]));
            assert!(found, "{before} {reading}");
        }
    }

    #[test]
    fn a_force_below_a_newton_has_a_sign() {
        let watch = ZeroForceWatch { offset: 0.1, ..WATCH };
        for force in [0.5, -0.5] {
            let mut state = ZeroForce { followed: true, positive: force < 0.0, ..ZeroForce::default() };
            watch.contradicts(&mut state, [force, force, 0.0], [1.0, PERIOD]);
            assert!(state.passed && state.positive == (force > 0.0), "{force}");
        }
    }

    #[test]
    fn the_time_begins_anew_with_a_small_change() {
        let mut state = zero();
        let mut add = |command: f64, count: u32| {
            (0..count).any(|_| WATCH.contradicts(&mut state, [command, 0.0, 1.0], [1.0, PERIOD]))
        };
        assert!(!add(1100.0, 45));
        assert!(!add(900.0, 1));
        assert!(!add(1100.0, 45));
        assert!(add(1100.0, 10));
    }

    #[test]
    fn a_force_has_followed_if_its_error_is_below_a_quarter_of_the_command() {
        let watch = ZeroForceWatch { mean_gain: 0.0, ..WATCH };
        for reading in [-101.0, -801.0] {
            for (mean_error, mean_command, followed) in
                [(499.0, 2e3, true), (501.0, 2e3, false), (200.0, 1001.0, true), (200.0, 999.0, false)]
            {
                let mut state = ZeroForce { mean_error, mean_command, ..ZeroForce::default() };
                // The last reading that changed decides, and the command there is that before the change.
                watch.contradicts(&mut state, [500.0, reading, 0.2], [1.0, PERIOD]);
                assert_eq!(state.followed, followed, "{mean_error} {mean_command}");
                assert_eq!(
                    (state.force_before, state.command_before, state.displacement_before),
                    (reading, 500.0, 0.2)
                );
            }
        }
    }

    #[test]
    fn means_and_command_pass_their_low_passes_and_a_lost_command_is_left_out() {
        let mut state = zero();
        let before = state;
        for (command, force) in [(f64::NAN, 0.0), (f64::INFINITY, 0.0), (f64::MAX, -f64::MAX)] {
            assert!(!WATCH.contradicts(&mut state, [command, force, 1.0], [0.5, PERIOD]));
            assert_eq!(state, before);
        }
        let watch = ZeroForceWatch { mean_gain: 0.5, ..WATCH };
        watch.contradicts(&mut state, [-4e3, 99.0, 0.0], [0.5, PERIOD]);
        assert_eq!((state.command, state.mean_error, state.mean_command), (-2e3, 1299.0, 2e3));
    }
}
